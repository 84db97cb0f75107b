"""The words and tables of the page. Every text that comes from a user is escaped here."""

import html
import math
from collections.abc import Mapping
from typing import Any

from stickslip.records import (
    AxisLog,
    Identification,
    Judged,
    Judgement,
    ParameterEstimate,
    in_words,
    judged,
    missing_parameters,
    parameter_label,
    share_text,
    unit_of,
    unit_text,
    value_texts,
)
from stickslip.report.drawing import symbol

__all__ = ["footer", "header", "joint", "parameters", "provenance", "selection"]

_KIND = {"linear": "linear axis", "rotary": "rotary axis"}


def header(identification: Identification) -> str:
    """Return the head of the page: which axis, the verdict in words, and the main figures."""
    log, estimate = identification.log, identification.estimate
    status = estimate.status
    mark, tone = ("✓", "trusted") if status.trusted else ("!", "doubtful")
    caution = "" if status.trusted else " Do not use the values below as they stand."
    reasons = "".join(f"<li>{_escape(each)}</li>" for each in missing_parameters(estimate))
    listed = f"<ul>{reasons}</ul>" if reasons else ""
    return (
        '<header class="top">\n'
        f'<p class="kicker">stickslip · friction identification · {_KIND[log.kind]}</p>\n'
        f"<h1>{_escape(identification.name)}</h1>\n"
        f'<div class="verdict {tone}"><p class="word">{mark} {status.word}</p>'
        f"<p>{_escape(status.text)}{caution}</p>{listed}</div>\n"
        f"{_facts(identification)}</header>\n"
    )


def _facts(identification: Identification) -> str:
    diagnostics = identification.estimate.diagnostics
    log, several = identification.log, identification.logs
    crossed = diagnostics.cross_validation_residual
    unexplained, unexplained_of = (
        (diagnostics.relative_residual, "norm of the residual over norm of the fitted signal")
        if identification.residuals is None
        else (identification.residuals.share, "norm of the residual effort over norm of the effort")
    )
    facts = [
        ("Estimator", _escape(identification.estimate.estimator), ""),
        (
            "Log" if len(several) == 1 else f"{len(several)} logs",
            f"{sum(map(len, several))} samples, {sum(map(_duration, several)):.4g}\u00a0s",
            f"one every {1e3 * log.sampling_time:.4g}\u00a0ms"
            if len(several) == 1
            else "fitted jointly",
        ),
        ("Unexplained", _share(unexplained), unexplained_of),
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
    heads = ["Parameter", "Value", "95 % interval", "Unit"]
    if truth is not None:
        heads.append("True value (error)")
    heads.append("Verdict")
    rows: list[str] = []
    for name, parameter in estimate.parameters.items():
        cells = _parameter_cells(parameter)
        if truth is not None:
            cells.append(("True (error)", "number", _true_value(parameter, truth.get(name))))
        cells.append(("Verdict", "", _judged(judged(estimate, name))))
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


_MARKS = {
    Judgement.IDENTIFIED: '<span class="mark-yes">✓ identified</span>',
    Judgement.NOT_IDENTIFIED: '<span class="mark-no">✗ not identified</span>',
}


def _judged(found: Judged) -> str:
    """Return a judgement with its reason."""
    mark = _MARKS.get(found.judgement, found.judgement.value)
    return f"<span>{mark}{f': {_escape(found.reason)}' if found.reason else ''}</span>"


def joint(identification: Identification) -> str:
    """Return what each log of a joint fit contributes and where they differ; empty for one log."""
    found = identification.estimate.joint
    if found is None:
        return ""
    kind = identification.log.kind
    unit = unit_text(unit_of("effort", kind))
    rows = "".join(
        f'<tr><th scope="row">{_escape(each.name)}</th>'
        f'<td class="number" data-label="Samples">{each.samples}</td>'
        f'<td class="number" data-label="Duration">{each.duration:.4g} s</td>'
        f'<td class="number" data-label="One every">{1e3 * each.sampling_time:.4g} ms</td>'
        f'<td class="number" data-label="Residual">{each.residual:.3g} {unit}</td></tr>\n'
        for each in found.logs
    )
    heads = ("Log", "Samples", "Duration", "One every", "Residual")
    columns = "".join(f'<th scope="col">{head}</th>' for head in heads)
    differences = tuple(
        f"{each.log}: {in_words(each.parameter)} differs by {each.difference:.3g} "
        f"{unit_text(unit_of(each.parameter, kind))} ({each.relative:+.1%}, p = {each.p_value:.1g})"
        for each in found.deviations
    )
    return (
        f'<p class="lead">{_escape(found.text)}</p>\n'
        f"{_list(differences) if differences else ''}"
        f'<table class="parameters"><thead><tr>{columns}</tr></thead>\n'
        f"<tbody>\n{rows}</tbody></table>\n"
    )


def _parameter_cells(parameter: ParameterEstimate) -> list[tuple[str, str, str]]:
    shown, between = map(_minus, value_texts(parameter))
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
    estimate = identification.estimate
    parts: list[str] = []
    if estimate.diagnostics.notes:
        parts.append("<h3>Notes</h3>\n" + _list(tuple(map(in_words, estimate.diagnostics.notes))))
    if estimate.provenance.assumptions:
        parts.append(
            "<h3>Assumed in reading the log</h3>\n" + _list(estimate.provenance.assumptions)
        )
    rows = [
        ("Files", ", ".join(_escape(f) for f in estimate.provenance.files) or "made in memory"),
        (
            "SHA-256 of the input",
            f"<code>{_escape(estimate.provenance.input_sha256) or '–'}</code>",
        ),
    ]
    if identification.further:
        parts.append("<h3>Logs</h3>\n" + _rows(rows))
        for each in identification.logs:
            parts.append(f"<h3>Log {_escape(each.name)}</h3>\n" + _rows(_log_rows(each)))
    else:
        parts.append("<h3>Log</h3>\n" + _rows([*rows, *_log_rows(identification.log)]))
    options = [
        (_escape(key.replace("_", " ")), _escape(_plain(value)))
        for key, value in estimate.provenance.options.items()
    ]
    if options:
        parts.append(f"<h3>Options of {_escape(estimate.estimator)}</h3>\n" + _rows(options))
    return "".join(parts)


def _log_rows(log: AxisLog) -> list[tuple[str, str]]:
    segments = log.segment_starts.size
    return [
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
