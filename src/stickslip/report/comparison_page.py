"""The page of estimators side by side, on a log or over the runs of a scenario."""

import html
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from stickslip.records import (
    ComparedEstimator,
    EstimatorComparison,
    EstimatorScore,
    EstimatorStudy,
    count_of,
    in_words,
    missing_parameters,
    parameter_label,
    prefixed,
    ratio_text,
    rounded,
    share_text,
    unit_of,
    unit_text,
)
from stickslip.report.comparison_figures import estimate_plots, motion_plots, score_plots
from stickslip.report.dense import row, wide
from stickslip.report.drawing import Plot, key
from stickslip.report.interactive import SCRIPT_POLICY, ending_with, figure, write_page
from stickslip.report.sheet import Section, contents, head, section

__all__ = ["write_comparison_page"]


def write_comparison_page(found: EstimatorComparison | EstimatorStudy, path: Path | str) -> Path:
    """Write a comparison of estimators as one HTML page that works offline.

    The page holds everything it needs (about 5 MB, nearly all of it the drawing library) and
    fetches nothing. It appears under its name only once it is complete.

    Parameters
    ----------
    found
        What to show; nothing is computed from it but the drawing.
    path
        The HTML file to write; an existing one is replaced.

    Returns
    -------
    The path written.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    parts = _log_page(found) if isinstance(found, EstimatorComparison) else _study_page(found)
    return write_page(parts, path)


def _log_page(found: EstimatorComparison) -> Iterable[str]:
    log, applied = found.log, found.applied
    drawn, motions = estimate_plots(found), motion_plots(found)
    sections = [
        Section("estimates", "Estimates", _estimates(found)),
        Section(
            "intervals",
            "Side by side",
            _grid(
                drawn,
                "Each parameter as every estimator found it, with its 95 % interval where the "
                "method gives one. Intervals that do not meet show that a method is biased on such "
                "a log, or too sure of itself.",
            ),
        ),
    ]
    if motions:
        sections.append(
            Section(
                "motion",
                "What each misses of the motion",
                _grid(
                    motions,
                    "Each identified axis is driven by the logged effort, and starts anew from the "
                    "measured motion twenty times. Shown is the simulated position less the "
                    "measured one, all at one scale.",
                ),
            )
        )
    sections += _left_out({each.name: each.why_not for each in found.compared if each.why_not})
    sections.append(Section("notes", "Notes and provenance", _log_provenance(found)))
    good = sum(
        each.estimate is not None and each.estimate.status.trusted for each in found.compared
    )
    verdict = (
        f"{count_of(len(applied), 'estimator')} of {len(found.compared)} "
        f"{'applies' if len(applied) == 1 else 'apply'} to this log; {good} "
        f"{'gives' if good == 1 else 'give'} an estimate that can be trusted."
    )
    if found.contradictions:
        verdict += " Some of these contradict each other."
    yield from _page(
        sections,
        [*drawn, *motions],
        name=log.name,
        kicker=f"estimators compared · {log.kind} axis",
        verdict=verdict,
        trusted=found.trusted,
        version=found.stickslip_version,
    )


def _study_page(study: EstimatorStudy) -> Iterable[str]:
    drawn = score_plots(study)
    sections = [
        Section("scores", "How near to the truth", _scores(study)),
        Section(
            "errors",
            "Side by side",
            _grid(
                drawn,
                "Mean error of each estimator over the runs, with their standard deviation on "
                "either side; orange where it is biased by more than three standard errors.",
            ),
        ),
        *_left_out({each.name: each.why_not for each in study.scores if each.why_not}),
        Section("notes", "Scenario, notes and provenance", _study_provenance(study)),
    ]
    verdict = (
        f"{count_of(len(study.applied), 'estimator')} of {len(study.scores)} over "
        f"{count_of(study.runs, 'run')} of {study.samples} samples, whose truth is known."
    )
    yield from _page(
        sections,
        drawn,
        name=study.name,
        kicker=f"estimators compared · Monte Carlo, {study.kind} axis",
        verdict=verdict,
        trusted=study.trusted,
        version=study.stickslip_version,
    )


def _page(
    sections: Sequence[Section],
    plots: Sequence[Plot],
    *,
    name: str,
    kicker: str,
    verdict: str,
    trusted: bool,
    version: str,
) -> Iterable[str]:
    """Yield a page: its head with the verdict, its sections, and its drawings."""
    mark, tone = ("✓", "trusted") if trusted else ("!", "doubtful")
    word = "Compared" if trusted else "None of the estimates can be trusted"
    yield head(f"Estimators on {name}", policy=SCRIPT_POLICY)
    yield (
        f'<header class="top">\n<p class="kicker">stickslip · {kicker}</p>\n'
        f"<h1>{html.escape(name)}</h1>\n"
        f'<div class="verdict {tone}"><p class="word">{mark} {word}</p><p>{verdict}</p></div>\n'
        "</header>\n"
    )
    yield contents([(each.anchor, each.name) for each in sections])
    yield "<main>\n"
    for each in sections:
        yield section(*each)
    yield "</main>\n"
    yield (
        f"<footer>Written by stickslip {html.escape(version)}. This page holds everything it shows "
        "and fetches nothing.</footer>\n"
    )
    yield from ending_with(plots)


def _grid(plots: Sequence[Plot], lead: str) -> str:
    body = "".join(figure(plot, key(plot.traces)) for plot in plots)
    return f'<p class="lead">{lead}</p>\n<div class="grid">\n{body}</div>\n'


def _head_row(cells: Sequence[str]) -> str:
    columns = "".join(f'<th scope="col">{cell}</th>' for cell in cells)
    return f"<thead><tr>{columns}</tr></thead>\n"


def _estimates(found: EstimatorComparison) -> str:
    kind = found.log.kind
    heads = [
        "Estimator",
        *(f"{parameter_label(n)} [{unit_text(unit_of(n, kind))}]" for n in found.parameters),
        "Effort left",
        "Position explained",
        "A sample",
        "Status",
    ]
    body = "".join(row(each.name, _cells(found, each)) for each in found.applied)
    assumed = [each.assumed_inertia for each in found.applied if each.assumed_inertia is not None]
    body_name = "mass" if kind == "linear" else "inertia"
    star = (
        f" * These estimate no {body_name}, and were given that of the energy estimator, "
        f"{assumed[0]:.6g} {unit_text(unit_of(body_name, kind))}."
        if assumed
        else ""
    )
    return (
        wide(f"{_head_row(heads)}<tbody>\n{body}</tbody>")
        + _contradictions(found)
        + '<p class="reason">Values with half of their 95 % interval. Effort left: norm of effort '
        "less inertia force and friction over norm of the effort, smoothed and decimated alike for "
        "every estimator. Position explained: 1 less the norm of simulated less measured position "
        "over that of the measured one less its mean, the identified axis being driven by the "
        "logged effort and started anew twenty times. A sample: time of a whole fit over the "
        "samples of the log."
        f"{star}{_known(found)}</p>\n"
    )


def _contradictions(found: EstimatorComparison) -> str:
    """Return the parameters of which trusted intervals do not overlap; empty for none."""
    kind = found.log.kind
    items: list[str] = []
    for each in found.contradictions:
        shown = ", ".join(
            f"{html.escape(name)} "
            + f"{0.5 * (low + high):.4g} ± {0.5 * (high - low):.2g}".replace("-", "−")
            for name, (low, high) in each.intervals.items()
        )
        unit = unit_text(unit_of(each.parameter, kind))
        label = parameter_label(each.parameter, kind)
        stands = f"; {html.escape(each.alone)} stands alone, the others agree" if each.alone else ""
        items.append(f"<li>{label} [{unit}]: {shown}{stands}</li>")
    if not items:
        return ""
    return (
        "<p><strong>Contradictory results: at least one method is wrong.</strong> The 95 % "
        f'intervals of these estimates do not overlap.</p>\n<ul class="plain">{"".join(items)}'
        "</ul>\n"
    )


def _known(found: EstimatorComparison) -> str:
    """Return what the estimators were told of the axis; nothing if they were told nothing."""
    kind = found.log.kind
    body = "mass" if kind == "linear" else "inertia"
    told: dict[str, float] = {}
    for each in found.applied:
        if each.estimate is None or each.assumed_inertia is not None:
            continue
        for name in ("inertia", "load_inertia", "stiffness"):
            value = each.estimate.provenance.options.get(name)
            if isinstance(value, int | float):
                told[name.replace("inertia", body)] = value
    parts = [
        f"{name.replace('_', ' ')} {value:.6g} {unit_text(unit_of(name, kind))}"
        for name, value in told.items()
    ]
    return f" Told to be known: {', '.join(parts)}." if parts else ""


def _cells(found: EstimatorComparison, each: ComparedEstimator) -> list[str]:
    estimate = each.estimate
    if estimate is None:
        return []
    cells: list[str] = []
    for name in found.parameters:
        parameter = estimate.parameters.get(name)
        if parameter is None or parameter.value is None:
            given = name in {"mass", "inertia"} and each.assumed_inertia is not None
            cells.append("*" if given else "–")
        elif parameter.ci95 is None:
            cells.append(f"{parameter.value:.4g}")
        else:
            half = 0.5 * (parameter.ci95[1] - parameter.ci95[0])
            cells.append(f"{rounded(parameter.value, half)} ± {half:.2g}")
    left, again, seconds = each.unexplained_effort, each.resimulation, each.seconds_per_sample
    style, mark = ("mark-yes", "✓") if estimate.status.trusted else ("mark-no", "✗")
    cells += [
        "–" if left is None else share_text(left),
        "–" if again is None else f"{again.fit:.2%}",
        "–" if seconds is None else prefixed(seconds, "s"),
    ]
    cells = [cell.replace("-", "−").replace(" ", "\u00a0") for cell in cells]
    return [
        *cells,
        f'<span class="{style}">{mark} {estimate.status.value.replace("_", " ")}</span>',
    ]


def _scores(study: EstimatorStudy) -> str:
    parts: list[str] = []
    delays = any(each.delay_found is not None for each in study.applied)
    for name in study.parameters:
        truth, unit = study.truth.get(name, 0.0), unit_text(unit_of(name, study.kind))
        size, in_unit = (100.0 / abs(truth), "%") if truth else (1.0, unit)
        bound = study.bound.get(name)
        least = "" if bound is None else f"; Cramér-Rao bound {bound * size:.3g} {in_unit}"
        heads = [
            "Estimator",
            f"Bias [{in_unit}]",
            f"RMSE [{in_unit}]",
            "RMSE over the bound",
            "95 % intervals that hold the truth",
            "Runs",
            "Status ok",
            "A sample",
            *(["Delay found"] if delays else []),
        ]
        body = "".join(
            row(
                f"{each.name} *" if each.assumes_inertia else each.name,
                _score_cells(each, name, size, delays=delays),
            )
            for each in study.applied
            if name in each.scores
        )
        parts.append(
            f"<h3>{parameter_label(name)}: {truth:.6g} {unit}{least}</h3>\n"
            + wide(f"{_head_row(heads)}<tbody>\n{body}</tbody>")
        )
    if any(each.assumes_inertia for each in study.applied):
        body_name = "mass" if study.kind == "linear" else "inertia"
        parts.append(
            f'<p class="reason">* with the {body_name} that the energy estimator found in each '
            "run.</p>\n"
        )
    return "".join(parts)


def _score_cells(each: EstimatorScore, name: str, size: float, *, delays: bool) -> list[str]:
    score = each.scores[name]
    seconds = each.seconds_per_sample
    cells = [
        f"{score.bias * size:+.3g}",
        f"{score.rmse * size:.3g}",
        "–" if score.bound_ratio is None else ratio_text(score.bound_ratio),
        "–" if score.coverage is None else f"{score.coverage:.1%}",
        str(score.runs),
        f"{each.trusted:.0%}",
        "–" if seconds is None else prefixed(seconds, "s"),
    ]
    if delays:
        cells.append("–" if each.delay_found is None else f"{each.delay_found:.1%}")
    return [cell.replace("-", "−").replace(" ", "\u00a0") for cell in cells]


def _left_out(reasons: Mapping[str, str]) -> list[Section]:
    if not reasons:
        return []
    items = "".join(
        f"<li>{html.escape(name)}: {html.escape(in_words(why))}</li>"
        for name, why in reasons.items()
    )
    return [Section("left-out", "Does not apply", f'<ul class="plain">{items}</ul>\n')]


def _log_provenance(found: EstimatorComparison) -> str:
    parts: list[str] = []
    for each in found.applied:
        if each.estimate is None:
            continue
        notes = [each.estimate.status.text] if not each.estimate.status.trusted else []
        notes += missing_parameters(each.estimate)
        notes += [in_words(note) for note in each.estimate.diagnostics.notes]
        if notes:
            parts.append(
                f"<details><summary>{html.escape(each.name)}</summary>\n{_listed(notes)}</details>\n"
            )
    log, source = found.log, found.log.source
    rows = [
        ("Samples", f"{len(log)}, one every {1e3 * log.sampling_time:.4g} ms"),
        ("Files", "made in memory" if source is None else html.escape(", ".join(source.files))),
    ]
    if source is not None:
        rows.append(("SHA-256 of the input", f"<code>{html.escape(source.sha256)}</code>"))
        if source.assumptions:
            parts.append(f"<h3>Assumed in reading the log</h3>\n{_listed(source.assumptions)}")
    return "".join(parts) + f"<h3>Log</h3>\n{_rows(rows)}"


def _study_provenance(study: EstimatorStudy) -> str:
    parts = [_listed(study.notes)] if study.notes else []
    for table, keys in study.scenario.items():
        rows = [(html.escape(name), _plain(value, unit)) for name, (value, unit) in keys.items()]
        parts.append(f"<h3><code>[{html.escape(table)}]</code></h3>\n{_rows(rows)}")
    rows = [
        ("Scenario", html.escape(study.file)),
        ("SHA-256", f"<code>{html.escape(study.sha256)}</code>"),
    ]
    return "".join(parts) + f"<h3>Provenance</h3>\n{_rows(rows)}"


def _listed(sentences: Sequence[str]) -> str:
    items = "".join(f"<li>{html.escape(each)}</li>" for each in sentences)
    return f'<ul class="plain">{items}</ul>\n'


def _plain(value: Any, unit: str) -> str:
    if isinstance(value, bool):
        return str(value).lower()  # as the file has it
    several = value if isinstance(value, tuple | list) else (value,)
    text = ", ".join(f"{each:.6g}" if isinstance(each, float) else str(each) for each in several)
    return f"{html.escape(text)} {unit_text(unit)}".rstrip()


def _rows(rows: Sequence[tuple[str, str]]) -> str:
    body = "".join(f'<tr><th scope="row">{term}</th><td>{value}</td></tr>' for term, value in rows)
    return f'<table class="options"><tbody>{body}</tbody></table>\n'
