"""Results as Markdown tables and as plain JSON types."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import stickslip
from studies.markdown import table
from studies.real_axes.contents import Contents
from studies.real_axes.study import NO_WORSE, Agreement, Judgement, Outcome, repeats_agree

SCHEMA_VERSION = 1

_SHORT = {
    "mass": "m",
    "inertia": "J",
    "viscous_friction": "c",
    "coulomb_friction": "fc",
    "offset": "o",
}


def results(
    judgements: Sequence[Judgement], contents: Mapping[str, Contents], missing: Sequence[str]
) -> dict[str, Any]:
    """Return everything as plain JSON types."""
    return {
        "schema": SCHEMA_VERSION,
        "stickslip": stickslip.__version__,
        "logs": [judgement.to_dict() for judgement in judgements],
        "repeats": repeats_agree(judgements),
        "contents": {
            name: {
                "plain_error": found.plain_error,
                "effects": dict(found.effects),
                "path": [list(step) for step in found.path],
                "delay": found.delay,
                "ripple_period": found.ripple_period,
            }
            for name, found in contents.items()
        },
        "missing_files": list(missing),
    }


def summary(judgements: Sequence[Judgement]) -> list[str]:
    """Return the counts for the acceptance of the estimator, one line each."""
    sound = [j for j in judgements if j.log.usable]
    rest = [j for j in judgements if not j.log.usable]
    given = [j for j in judgements if j.usable]
    halves = [a for j in given if j.usable_halves for a in j.halves.values()]
    inside = [a for j in given for a in j.inside.values()]
    repeats = [s for group in repeats_agree(judgements).values() for s in group.values()]
    ratios = [j.prediction_ratio for j in given if math.isfinite(j.prediction_ratio)]
    times = sorted(j.whole.seconds for j in judgements)
    return [
        f"{len(judgements)} logs, {len(sound)} of which an effort law fits: "
        f"{sum(j.trusted for j in sound)} have status ok, {sum(j.usable for j in sound)} give "
        f"values; of the others {sum(j.trusted for j in rest)} have status ok.",
        f"{sum(bool(j.faults) for j in given if j.trusted)} of {sum(j.trusted for j in given)} "
        "logs with status ok have a fault, "
        f"{sum(bool(j.faults) for j in given if not j.trusted)} of "
        f"{sum(not j.trusted for j in given)} with status not_identifiable.",
        f"Halves: {_share(a.agree for a in halves)} parameters agree, the root mean square of "
        f"their differences is {_rms(a.z for a in halves):.2f} standard deviations.",
        f"Reference inside the interval: {_share(a.agree for a in inside)} parameters.",
        f"Repeats: {sum(int(s['agree']) for s in repeats)} of "
        f"{sum(int(s['pairs']) for s in repeats)} pairs agree; the widest interval is up to "
        f"{max((s['half_width_ratio'] for s in repeats), default=math.nan):.1f} times the "
        "narrowest of its group.",
        "Prediction of the other half no worse than least squares with the same terms: "
        f"{_share(ratio <= NO_WORSE for ratio in ratios)} logs.",
        f"Time of a call: median {times[len(times) // 2]:.2f} s, longest {times[-1]:.2f} s, "
        f"{sum(j.whole.status == 'crash' for j in judgements)} crashes.",
    ]


def _rms(values: Iterable[float]) -> float:
    listed = list(values)
    return math.sqrt(sum(v * v for v in listed) / len(listed)) if listed else math.nan


def _share(flags: Iterable[bool]) -> str:
    listed = list(flags)
    return f"{sum(listed)} of {len(listed)}"


def page(
    judgements: Sequence[Judgement], contents: Mapping[str, Contents], missing: Sequence[str]
) -> str:
    """Return the page with all tables."""
    parts = [
        "# `stickslip.identify` on public logs of real axes",
        "\n".join(f"- {line}" for line in summary(judgements)),
        "m or J mass or inertia, c viscous and fc Coulomb friction, o offset; ± half of the 95 % "
        "interval; in brackets the reference with its tolerance, ✗ where it is outside. Halves: "
        "parameters whose halves differ by more than their intervals allow. Prediction: relative "
        "error of the effort on the other half [%], of the estimate, of least squares with the "
        "same terms, and of least squares with the terms that the machine needs.",
        table(
            (
                "log",
                "samples, Hz",
                "status (halves)",
                "estimate",
                "halves differ",
                "prediction [%]",
                "delay [ms]",
                "s",
                "faults",
            ),
            [_row(judgement) for judgement in judgements],
        ),
        "## Repeats",
        table(
            (
                "group",
                "parameter",
                "logs",
                "pairs that agree",
                "mean",
                "spread [%]",
                "widest / narrowest interval",
            ),
            [
                (
                    group,
                    name,
                    str(s["logs"]),
                    f"{s['agree']} of {s['pairs']}",
                    f"{s['mean']:.4g}",
                    f"{100 * s['relative_spread']:.1f}",
                    f"{s['half_width_ratio']:.1f}",
                )
                for group, names in repeats_agree(judgements).items()
                for name, s in names.items()
            ],
        ),
    ]
    if contents:
        parts += ["## Contents of the logs", contents_table(contents)]
    if missing:
        parts += ["## Extra files that were not found", ", ".join(missing)]
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def contents_table(contents: Mapping[str, Contents]) -> str:
    """Return the cross-validated effect of the terms, one row a log."""
    return table(
        ("log", "plain error [%]", "delay [ms]", "each alone [%]", "one after the other [%]"),
        [
            (
                name,
                _percent(found.plain_error),
                f"{1e3 * found.delay:.1f}",
                ", ".join(
                    f"{term} {_percent(error)}"
                    for term, error in sorted(found.effects.items(), key=lambda item: item[1])
                    if error < 0.98 * found.plain_error
                ),
                ", ".join(f"{term} {_percent(error)}" for term, error in found.path),
            )
            for name, found in contents.items()
        ],
    )


def _row(judgement: Judgement) -> tuple[str, ...]:
    log, whole = judgement.log, judgement.whole
    differ = [
        f"{_SHORT.get(name, name)} {_pair(agreement)}"
        for name, agreement in judgement.halves.items()
        if not agreement.agree
    ]
    return (
        log.name,
        f"{len(log.log)}, {1.0 / log.log.sampling_time:.0f}",
        f"{whole.status} ({judgement.first.status}, {judgement.second.status})",
        _estimates(judgement, whole),
        ", ".join(differ),
        " / ".join(
            _percent(judgement.prediction[key]) for key in ("estimate", "same_terms", "own_terms")
        ),
        f"{1e3 * judgement.delay:.1f}",
        f"{whole.seconds:.2f}",
        "; ".join(judgement.faults),
    )


def _pair(agreement: Agreement) -> str:
    return f"{agreement.first:.3g} | {agreement.second:.3g}".replace("|", "vs")


def _estimates(judgement: Judgement, outcome: Outcome) -> str:
    parts: list[str] = []
    for name, value in outcome.values.items():
        half = outcome.half_widths.get(name)
        text = f"{_SHORT.get(name, name)} {value:.4g}" + (f" ± {half:.2g}" if half else "")
        known = judgement.reference.get(name)
        if known is not None:
            text += f" ({known.value:.4g} ± {known.tolerance:.2g})"
        if name in judgement.inside and not judgement.inside[name].agree:
            text += " ✗"
        parts.append(text)
    if outcome.message:
        parts.append(outcome.message.replace("|", "/").replace("\n", " ")[:120])
    return "; ".join(parts)


def _percent(value: float) -> str:
    return f"{100 * value:.1f}" if math.isfinite(value) else "–"
