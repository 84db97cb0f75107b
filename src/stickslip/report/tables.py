"""The words and tables of the page. Every text that comes from a user is escaped here."""

import html
import math
from collections.abc import Mapping
from typing import Any

from stickslip.records import (
    SIGNED_PARAMETERS,
    AxisLog,
    Identification,
    ParameterEstimate,
    Status,
    in_words,
    parameter_label,
    rounded,
    rounded_interval,
    share_text,
    unit_of,
    unit_text,
)
from stickslip.report.drawing import symbol

__all__ = ["footer", "header", "parameters", "provenance", "selection"]

_KIND = {"linear": "linear axis", "rotary": "rotary axis"}


def header(identification: Identification) -> str:
    """Return the head of the page: which axis, the verdict in words, and the main figures."""
    log, estimate = identification.log, identification.estimate
    status = estimate.status
    mark, tone = ("✓", "trusted") if status.trusted else ("!", "doubtful")
    caution = "" if status.trusted else " Do not use the values below as they stand."
    grouped: dict[str, list[str]] = {}
    for verdict in estimate.diagnostics.verdicts:
        if not verdict.identifiable:
            grouped.setdefault(verdict.reason, []).append(parameter_label(verdict.parameter))
    reasons = "".join(
        f"<li>{', '.join(names)}: {_escape(in_words(reason))}</li>"
        for reason, names in grouped.items()
    )
    listed = f"<ul>{reasons}</ul>" if reasons else ""
    return (
        '<header class="top">\n'
        f'<p class="kicker">stickslip · friction identification · {_KIND[log.kind]}</p>\n'
        f"<h1>{_escape(log.name)}</h1>\n"
        f'<div class="verdict {tone}"><p class="word">{mark} {status.word}</p>'
        f"<p>{_escape(status.text)}{caution}</p>{listed}</div>\n"
        f"{_facts(identification)}</header>\n"
    )


def _facts(identification: Identification) -> str:
    log, diagnostics = identification.log, identification.estimate.diagnostics
    crossed = diagnostics.cross_validation_residual
    facts = [
        ("Estimator", _escape(identification.estimate.estimator), ""),
        (
            "Log",
            f"{len(log)} samples, {_duration(log):.4g}\u00a0s",
            f"one every {1e3 * log.sampling_time:.4g}\u00a0ms",
        ),
        (
            "Unexplained",
            _share(diagnostics.relative_residual),
            "norm of the residual over norm of the fitted signal",
        ),
        (
            "In cross-validation",
            _share(crossed),
            "on data left out of the fit; much larger values mean overfitting or drift",
        ),
        (
            "Effective sample size",
            f"{diagnostics.effective_samples:.0f} of {diagnostics.samples}",
            "independent samples with the same information as the correlated residual",
        ),
        (
            "Condition number",
            _finite(diagnostics.condition_number),
            "of the scaled regressor; above about 100 the parameters are hard to tell apart",
        ),
    ]
    items = "".join(
        f"<div><dt>{term}</dt><dd>{value}<span class='meaning'>{meaning}</span></dd></div>"
        for term, value, meaning in facts
    )
    return f'<dl class="facts">{items}</dl>\n'


def parameters(identification: Identification) -> str:
    """Return the table of parameters, with the true values where the log was simulated."""
    estimate, truth = identification.estimate, identification.truth
    reasons = {v.parameter: v for v in estimate.diagnostics.verdicts}
    heads = ["Parameter", "Value", "95 % interval", "Unit"]
    if truth is not None:
        heads.append("True value (error)")
    heads.append("Verdict")
    rows: list[str] = []
    for name, parameter in estimate.parameters.items():
        verdict = reasons.get(name)
        cells = _parameter_cells(parameter)
        if truth is not None:
            cells.append(("True (error)", "number", _true_value(parameter, truth.get(name))))
        if estimate.status is Status.UNPHYSICAL and _impossible(parameter):
            word = "<span>unphysical: it cannot be negative</span>"
        elif parameter.identified and not estimate.status.usable:
            word = "<span>not to be used</span>"
        elif parameter.identified and (verdict is None or verdict.identifiable):
            word = '<span class="mark-yes">✓ identified</span>'
        else:
            reason = "" if verdict is None else f": {_escape(in_words(verdict.reason))}"
            word = f'<span><span class="mark-no">✗ not identified</span>{reason}</span>'
        cells.append(("Verdict", "", word))
        row = "".join(
            f'<td class="{style}" data-label="{label}">{value}</td>'
            for label, style, value in cells
        )
        label = f'{parameter_label(name)} <span class="symbol">{symbol(name)}</span>'
        rows.append(f'<tr><th scope="row">{label}</th>{row}</tr>\n')
    columns = "".join(f'<th scope="col">{head}</th>' for head in heads)
    return (
        '<table class="parameters"><caption>Sign convention: inertia × acceleration = effort − '
        "offset − friction(velocity). Intervals allow for correlated residuals.</caption>\n"
        f"<thead><tr>{columns}</tr></thead>\n<tbody>\n{''.join(rows)}</tbody></table>\n"
    )


def selection(identification: Identification) -> str:
    """Return the summary of the model selection and the table of all terms; empty without one."""
    selected = identification.estimate.selection
    if selected is None:
        return ""
    rows = "".join(
        f'<tr><th scope="row">{_escape(score.text)}</th>'
        f'<td data-label="Selected">{"✓ selected" if score.selected else "–"}</td>'
        f'<td class="number" data-label="Gain">{100 * score.gain:.1f} ± '
        f"{100 * score.gain_std:.1f} %</td>"
        f'<td class="number" data-label="p">{score.p_value:.1g}</td>'
        f'<td class="number" data-label="Share">{100 * score.share:.2f} %</td></tr>\n'
        for score in selected.scores
    )
    heads = (
        "Term",
        "Selected",
        "Squared error saved on moves left out",
        "p-value",
        "Share of the effort",
    )
    columns = "".join(f'<th scope="col">{head}</th>' for head in heads)
    return (
        f'<p class="lead">{_escape(selected.summary)}</p>\n'
        f'<table class="parameters"><thead><tr>{columns}</tr></thead>\n'
        f"<tbody>\n{rows}</tbody></table>\n"
    )


def _impossible(parameter: ParameterEstimate) -> bool:
    """Return whether a value is negative that cannot be."""
    return (
        parameter.name not in SIGNED_PARAMETERS
        and parameter.value is not None
        and parameter.value <= 0
    )


def _parameter_cells(parameter: ParameterEstimate) -> list[tuple[str, str, str]]:
    value, std, interval = parameter.value, parameter.std, parameter.ci95
    if value is None:
        shown = between = "–"
    elif std is None or interval is None:
        shown, between = _minus(f"{value:.5g}"), "none"
    else:
        shown = _minus(rounded(value, std))
        between = _minus(rounded_interval(*interval, std))
    return [
        ("Value", "number value", shown),
        ("95 % interval", "number", between),
        ("Unit", "unit", unit_text(parameter.unit)),
    ]


def _true_value(parameter: ParameterEstimate, truth: float | None) -> str:
    if truth is None:
        return "–"
    if parameter.value is None or truth == 0:
        return _minus(f"{truth:.6g}")
    error = _minus(f"{parameter.value / truth - 1:+.2%}")
    return f"{_minus(f'{truth:.6g}')} <span class='reason'>({error})</span>"


def provenance(identification: Identification) -> str:
    """Return notes, what was assumed in reading, and what the result was made from."""
    log, estimate = identification.log, identification.estimate
    parts: list[str] = []
    if estimate.diagnostics.notes:
        parts.append("<h3>Notes</h3>\n" + _list(tuple(map(in_words, estimate.diagnostics.notes))))
    if estimate.provenance.assumptions:
        parts.append(
            "<h3>Assumed in reading the log</h3>\n" + _list(estimate.provenance.assumptions)
        )
    segments = log.segment_starts.size
    rows = [
        ("Files", ", ".join(_escape(f) for f in estimate.provenance.files) or "made in memory"),
        (
            "SHA-256 of the input",
            f"<code>{_escape(estimate.provenance.input_sha256) or '–'}</code>",
        ),
        ("Samples", f"{len(log)} in {segments} segment{'' if segments == 1 else 's'}"),
        ("Duration", f"{_duration(log):.6g} s"),
        (
            "Sampling time",
            f"{log.sampling_time:.6g} s, jitter at most {share_text(log.timing_jitter)} of it",
        ),
        (
            "Range of motion",
            f"{log.measured_position.min():.5g} to {log.measured_position.max():.5g} "
            f"{unit_text(unit_of('position', log.kind))}",
        ),
        (
            "Range of effort",
            f"{log.effort.min():.5g} to {log.effort.max():.5g} "
            f"{unit_text(unit_of('effort', log.kind))}",
        ),
    ]
    parts.append("<h3>Log</h3>\n" + _rows(rows))
    options = [
        (_escape(key.replace("_", " ")), _escape(_plain(value)))
        for key, value in estimate.provenance.options.items()
    ]
    if options:
        parts.append(f"<h3>Options of {_escape(estimate.estimator)}</h3>\n" + _rows(options))
    return "".join(parts)


def footer(identification: Identification) -> str:
    """Return the last line of the page."""
    version = _escape(identification.estimate.provenance.stickslip_version)
    return (
        f"<footer>Written by stickslip {version}. This page holds everything it shows and fetches "
        "nothing.</footer>\n"
    )


def _duration(log: AxisLog) -> float:
    return float(log.time[-1] - log.time[0])


def _list(sentences: tuple[str, ...]) -> str:
    items = "".join(f"<li>{_escape(each)}</li>" for each in sentences)
    return f'<ul class="plain">{items}</ul>\n'


def _rows(rows: list[tuple[str, str]]) -> str:
    body = "".join(f'<tr><th scope="row">{term}</th><td>{value}</td></tr>' for term, value in rows)
    return f'<table class="options"><tbody>{body}</tbody></table>\n'


def _plain(value: Any) -> str:
    if value is None:
        return "not given"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {_plain(each)}" for key, each in value.items()) or "none"
    return str(value).replace("_", " ")


def _share(value: float | None) -> str:
    return "not available" if value is None or not math.isfinite(value) else f"{value:.2%}"


def _finite(value: float) -> str:
    return f"{value:.3g}" if math.isfinite(value) else "infinite"


def _minus(number: str) -> str:
    return number.replace("-", "−")


def _escape(text: str) -> str:
    return html.escape(text, quote=True)
