"""An identification as tables and as a page."""

import math
from collections.abc import Sequence

from stickslip.presentation.figures.drawing import Plot, symbol
from stickslip.presentation.figures.identification import (
    balance_plot,
    curve_plot,
    evolution_plots,
    log_plot,
    residual_plots,
    resimulation_plot,
)
from stickslip.presentation.page import (
    Block,
    Fact,
    Grid,
    Heading,
    Listed,
    Page,
    Section,
    Text,
    Verdict,
)
from stickslip.presentation.table import Cell, Column, Table, Tone
from stickslip.presentation.words import (
    NONE,
    Judgement,
    assumed_units,
    judged,
    missing_parameters,
    printed_unit,
    share_text,
    value_text,
    value_texts,
)
from stickslip.records import (
    AxisLog,
    Identification,
    JointLogs,
    ModelSelection,
    in_words,
    parameter_label,
    unit_text,
)

__all__ = ["identification_page", "parameter_table"]

_TONES: dict[Judgement, Tone] = {
    Judgement.IDENTIFIED: "good",
    Judgement.NOT_IDENTIFIED: "bad",
}

_EVOLUTION = (
    "How each estimate settles as the log goes on, with its 95 % interval. A level that "
    "is reached and kept speaks for a law that fits the whole log; one that keeps "
    "drifting means that friction changes, or that the law lacks something. The axis is "
    "scaled to the settled part, the first guesses may lie outside."
)


def identification_page(found: Identification) -> Page:
    """Return the page of an identification."""
    estimate, joint, selection = found.estimate, found.estimate.joint, found.estimate.selection
    assumed = assumed_units(found.logs)
    below = [Text(assumed, "reason")] if assumed else []
    figures, missing = _figures(found)
    sections = [
        Section("parameters", "Parameters", [parameter_table(found), *below]),
        *([] if joint is None else [Section("logs", "Logs", _logs(joint, found))]),
        *([] if selection is None else [Section("model", "Model selection", _model(selection))]),
        *figures,
        Section("provenance", "Notes and provenance", _provenance(found), "Provenance"),
    ]
    status = estimate.status
    caution = "" if status.trusted else " Do not use the values below as they stand."
    if missing:
        why = "the simulator lacks terms of the model" if status.trusted else "the estimate is poor"
        words = f"Not drawn, as {why}: "
        last = sections[-2]
        text = Text(f"{words}{', '.join(missing).lower()}.", "missing")
        sections[-2] = last._replace(blocks=[*last.blocks, text])
    return Page(
        title=f"Friction of {found.name}",
        kicker=f"friction identification · {found.log.kind} axis",
        name=found.name,
        verdict=Verdict(
            status.trusted, status.word, status.text + caution, missing_parameters(estimate)
        ),
        facts=_facts(found),
        sections=sections,
        version=estimate.provenance.stickslip_version,
    )


def parameter_table(found: Identification) -> Table:
    """Return the parameters, with the true values where the log was simulated."""
    estimate, truth = found.estimate, found.truth
    columns = [
        Column("Parameter", "left"),
        Column("Value", css="value"),
        Column("95 % interval", "center"),
        Column("Unit", "left", css="unit"),
        *([] if truth is None else [Column("True value"), Column("Error")]),
        Column("Verdict", "left"),
    ]
    rows: list[list[str | Cell]] = []
    for name, parameter in estimate.parameters.items():
        row = [Cell(parameter_label(name), symbol=symbol(name)), *value_texts(parameter)]
        row.append(unit_text(parameter.unit))
        if truth is not None:
            true, value = truth.get(name), parameter.value
            row.append(NONE if true is None else f"{true:.6g}")
            row.append(f"{value / true - 1:+.2%}" if value is not None and true else NONE)
        verdict = judged(estimate, name)
        tone = _TONES.get(verdict.judgement, "")
        rows.append([*row, Cell(verdict.judgement.value, tone, verdict.reason)])
    return Table(
        columns=columns,
        rows=rows,
        style="parameters",
        caption="Sign convention: inertia × acceleration = effort − offset − friction(velocity). "
        "Intervals allow for correlated residuals.",
    )


def _facts(found: Identification) -> list[Fact]:
    diagnostics, logs = found.estimate.diagnostics, found.logs
    unexplained = (
        Fact(
            "Unexplained",
            _share(diagnostics.relative_residual),
            "norm of the residual over norm of the fitted signal",
        )
        if found.residuals is None
        else Fact(
            "Unexplained",
            _share(found.residuals.share),
            "norm of the residual effort over norm of the effort",
        )
    )
    condition = diagnostics.condition_number
    return [
        Fact("Estimator", found.estimate.estimator),
        Fact(
            "Log" if len(logs) == 1 else f"{len(logs)} logs",
            f"{sum(map(len, logs))} samples, {sum(map(_duration, logs)):.4g}\u00a0s",
            f"one every {1e3 * found.log.sampling_time:.4g}\u00a0ms"
            if len(logs) == 1
            else "fitted jointly",
        ),
        unexplained,
        Fact(
            "In cross-validation",
            _share(diagnostics.cross_validation_residual),
            "on data left out of the fit; much larger values mean overfitting or drift",
        ),
        Fact(
            "Effective sample size",
            f"{diagnostics.effective_samples:.0f} of {diagnostics.samples}",
            "independent samples with the same information as the correlated residual",
        ),
        Fact(
            "Condition number",
            f"{condition:.3g}" if math.isfinite(condition) else "infinite",
            "of the scaled regressor; above about 100 the parameters are hard to separate",
        ),
    ]


def _logs(joint: JointLogs, found: Identification) -> list[Block]:
    """Return what each log of a joint fit contributes, and where they differ."""
    kind = found.log.kind
    differences = [
        f"{each.log}: {in_words(each.parameter)} differs by {each.difference:.3g} "
        f"{printed_unit(each.parameter, kind)} ({each.relative:+.1%}, p = {each.p_value:.1g})"
        for each in joint.deviations
    ]
    heads = ("Samples", "Duration", "One every", "Residual")
    table = Table(
        columns=[Column("Log", "left"), *map(Column, heads)],
        rows=[
            [
                each.name,
                str(each.samples),
                f"{each.duration:.4g} s",
                f"{1e3 * each.sampling_time:.4g} ms",
                f"{each.residual:.3g} {printed_unit('effort', kind)}",
            ]
            for each in joint.logs
        ],
        style="parameters",
    )
    return [Text(joint.text, "lead"), *([Listed(differences)] if differences else []), table]


def _model(selection: ModelSelection) -> list[Block]:
    """Return the summary of the model selection, and all terms."""
    heads = ("Squared error saved on moves left out", "p-value", "Share of the effort")
    table = Table(
        columns=[Column("Term", "left"), Column("Selected", "left"), *map(Column, heads)],
        rows=[
            [
                each.text,
                "✓ selected" if each.selected else NONE,
                f"{100 * each.gain:.1f} ± {100 * each.gain_std:.1f} %",
                f"{each.p_value:.1g}",
                f"{100 * each.share:.2f} %",
            ]
            for each in selection.scores
        ],
        style="parameters",
    )
    return [Text(selection.summary, "lead"), *([table] if selection.scores else [])]


def _figures(found: Identification) -> tuple[list[Section], list[str]]:
    """Return the sections with figures, and the names of those that could not be made."""
    curve, energy, evolution = found.curve, found.energy, found.evolution
    residuals, again = found.residuals, found.resimulation
    estimate, truth = found.estimate, found.truth
    settling = None if evolution is None else evolution_plots(evolution, estimate, truth)
    made: list[tuple[str, str, Sequence[Block] | None]] = [
        ("friction", "Friction curve", curve and [curve_plot(curve, found)]),
        ("energy", "Energy balance", energy and [balance_plot(energy, found)]),
        ("evolution", "Evolution", settling and [Text(_EVOLUTION, "lead"), Grid(settling)]),
        ("residuals", "Residuals", residuals and residual_plots(residuals, found)),
        (
            "motion",
            "Motion, measured and re-simulated",
            again and [resimulation_plot(again, found)],
        ),
    ]
    sections = [Section(anchor, name, list(blocks)) for anchor, name, blocks in made if blocks]
    if not estimate.status.trusted:
        recorded: list[Plot] = [log_plot(log, k) for k, log in enumerate(found.logs, start=1)]
        sections.insert(0, Section("recorded", "Recorded signals", recorded))
    of_one_log = {"evolution", "motion"} if found.further else set[str]()
    missing = [name for anchor, name, blocks in made if not blocks and anchor not in of_one_log]
    return sections, missing


def _provenance(found: Identification) -> list[Block]:
    """Return notes, what was assumed in reading, and what the result was made from."""
    provenance, notes = found.estimate.provenance, found.estimate.diagnostics.notes
    blocks: list[Block] = []
    if notes:
        blocks += [Heading("Notes"), Listed([in_words(note) for note in notes])]
    if provenance.assumptions:
        blocks += [Heading("Assumed in reading the log"), Listed(provenance.assumptions)]
    facts = [
        ("Files", ", ".join(provenance.files) or "made in memory"),
        ("SHA-256 of the input", Cell(provenance.input_sha256 or NONE, "code")),
    ]
    if found.further:
        blocks += [Heading("Logs"), Table.of_facts(facts)]
        for each in found.logs:
            blocks += [Heading(f"Log {each.name}"), Table.of_facts(_log_facts(each))]
    else:
        blocks += [Heading("Log"), Table.of_facts([*facts, *_log_facts(found.log)])]
    options = [
        (key.replace("_", " "), value_text(each)) for key, each in provenance.options.items()
    ]
    if options:
        heading = Heading(f"Options of {found.estimate.estimator}")
        blocks += [heading, Table.of_facts(options)]
    return blocks


def _log_facts(log: AxisLog) -> list[tuple[str, str]]:
    segments = log.segment_starts.size
    facts = [
        ("Samples", f"{len(log)} in {segments} segment{'' if segments == 1 else 's'}"),
        ("Duration", f"{_duration(log):.6g} s"),
        (
            "Sampling time",
            f"{log.sampling_time:.6g} s, jitter at most {share_text(log.timing_jitter)} of it",
        ),
    ]
    ranges = (("motion", "position", log.measured_position), ("effort", "effort", log.effort))
    for name, quantity, values in ranges:
        unit = printed_unit(quantity, log.kind)
        facts.append((f"Range of {name}", f"{values.min():.5g} to {values.max():.5g} {unit}"))
    return facts


def _duration(log: AxisLog) -> float:
    return float(log.time[-1] - log.time[0])


def _share(value: float | None) -> str:
    return "not available" if value is None or not math.isfinite(value) else f"{value:.2%}"
