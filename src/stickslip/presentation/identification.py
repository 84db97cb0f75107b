"""Tables, figures and page of an identification; nothing is estimated here."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from stickslip.presentation import drawing as draw
from stickslip.presentation.drawing import Look, Plot, axis, layout, line, quantity_axis
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
    headed_list,
)
from stickslip.presentation.table import Cell, Column, Table, Tone
from stickslip.presentation.words import (
    NONE,
    Judgement,
    assumed_units,
    judged,
    printed_unit,
    reasons_of_status,
    side_text,
    value_text,
    value_texts,
)
from stickslip.records import (
    AxisLog,
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    FrictionEstimate,
    Identification,
    JointLogs,
    ModelSelection,
    Residuals,
    Resimulation,
    Validation,
    in_words,
    parameter_label,
    share_text,
    unit_text,
)

_TONES: dict[Judgement, Tone] = {
    Judgement.IDENTIFIED: "good",
    Judgement.NOT_IDENTIFIED: "bad",
}

_CLOUD = 3000  # most points of the data cloud [-]: more make the page larger
_MOTION = "Motion, measured and re-simulated"
_EVOLUTION = (
    "Each estimate from the log up to a time, with its 95 % interval. An estimate that settles "
    "agrees with a law that fits the whole log; one that keeps drifting shows that friction "
    "changes, or that the law lacks a term. The axis is scaled to the settled part; the first "
    "values may be outside."
)


def identification_page(found: Identification) -> Page:
    """Return the page of an identification."""
    estimate, joint, selection = found.estimate, found.estimate.joint, found.estimate.selection
    assumed = assumed_units(found.logs)
    below = [Text(each, "reason") for each in (assumed, side_text(estimate)) if each]
    if found.validation is not None:
        below.append(Text(validation_text(found.validation)))
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
            status.trusted, status.word, status.text + caution, reasons_of_status(estimate)
        ),
        facts=_facts(found),
        sections=sections,
        version=estimate.provenance.stickslip_version,
    )


def validation_text(validation: Validation) -> str:
    """Return a sentence on the prediction of another log."""
    if validation.error is None:
        return f"No prediction of {validation.log}: {validation.reason}."
    return (
        f"The prediction leaves {validation.error:.2%} of the effort of {validation.log}, a log "
        "that was not fitted."
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
        row = [Cell(parameter_label(name), symbol=draw.symbol(name)), *value_texts(parameter)]
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
    condition = diagnostics.condition_number
    if len(logs) == 1:
        which, spacing = "Log", f"one every {1e3 * found.log.sampling_time:.4g}\u00a0ms"
    else:
        which, spacing = f"{len(logs)} logs", "fitted jointly"
    if found.residuals is None:
        unexplained = _share(diagnostics.relative_residual)
        meaning = "norm of the residual over norm of the fitted signal"
    else:
        unexplained = _share(found.residuals.share)
        meaning = "norm of the residual effort over norm of the effort"
    return [
        Fact("Estimator", found.estimate.estimator),
        Fact(
            which,
            f"{sum(map(len, logs))} samples, {sum(log.duration for log in logs):.4g}\u00a0s",
            spacing,
        ),
        Fact("Unexplained", unexplained, meaning),
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
    """Return the contribution of each log to a joint fit, and the differences between them."""
    log = found.log
    differences = [
        f"{each.log}: {in_words(each.parameter)} differs by {each.difference:.3g} "
        f"{unit_text(log.unit(each.parameter))} ({each.relative:+.1%}, p = {each.p_value:.1g})"
        for each in joint.deviations
    ]
    heads = ("Samples", "Duration", "One every", "Residual")
    rows = [
        [
            each.name,
            str(each.samples),
            f"{each.duration:.4g} s",
            f"{1e3 * each.sampling_time:.4g} ms",
            f"{each.residual:.3g} {unit_text(log.unit('effort'))}",
        ]
        for each in joint.logs
    ]
    columns = [Column("Log", "left"), *map(Column, heads)]
    table = Table(columns=columns, rows=rows, style="parameters")
    return [Text(joint.text, "lead"), *([Listed(differences)] if differences else []), table]


def _model(selection: ModelSelection) -> list[Block]:
    """Return the summary of the model selection, and all terms."""
    heads = ("Squared error saved on moves left out", "p-value", "Share of the effort")
    rows = [
        [
            each.text,
            Cell("selected", "good") if each.selected else NONE,
            f"{100 * each.gain:.1f} ± {100 * each.gain_std:.1f} %",
            f"{each.p_value:.1g}",
            f"{100 * each.share:.2f} %",
        ]
        for each in selection.scores
    ]
    columns = [Column("Term", "left"), Column("Selected", "left"), *map(Column, heads)]
    table = Table(columns=columns, rows=rows, style="parameters")
    return [Text(selection.summary, "lead"), *([table] if selection.scores else [])]


def _figures(found: Identification) -> tuple[list[Section], list[str]]:
    """Return the sections with figures, and the names of those that could not be made."""
    curve, energy, evolution = found.curve, found.energy, found.evolution
    residuals, again, estimate = found.residuals, found.resimulation, found.estimate
    settling = None if evolution is None else evolution_plots(evolution, estimate, found.truth)
    made: list[tuple[str, str, Sequence[Block] | None]] = [
        ("friction", "Friction curve", curve and [curve_plot(curve, found)]),
        ("energy", "Energy balance", energy and [balance_plot(energy, found)]),
        ("evolution", "Evolution", settling and [Text(_EVOLUTION, "lead"), Grid(settling)]),
        ("residuals", "Residuals", residuals and residual_plots(residuals, found)),
        ("motion", _MOTION, again and [resimulation_plot(again, found)]),
    ]
    sections = [Section(anchor, name, list(blocks)) for anchor, name, blocks in made if blocks]
    if not estimate.status.trusted:
        recorded: list[Plot] = [log_plot(log, k) for k, log in enumerate(found.logs, start=1)]
        sections.insert(0, Section("recorded", "Recorded signals", recorded))
    of_one_log = {"evolution", "motion"} if found.further else set[str]()
    missing = [name for anchor, name, blocks in made if not blocks and anchor not in of_one_log]
    return sections, missing


def _provenance(found: Identification) -> list[Block]:
    """Return notes, assumptions in reading, and the origin of the result."""
    provenance, notes = found.estimate.provenance, found.estimate.diagnostics.notes
    blocks = [
        *headed_list("Notes", [in_words(note) for note in notes]),
        *headed_list("Assumed in reading the log", provenance.assumptions),
    ]
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
        ("Duration", f"{log.duration:.6g} s"),
        (
            "Sampling time",
            f"{log.sampling_time:.6g} s, jitter at most {share_text(log.timing_jitter)} of it",
        ),
    ]
    ranges = (("motion", "position", log.measured_position), ("effort", "effort", log.effort))
    for name, quantity, values in ranges:
        unit = unit_text(log.unit(quantity))
        facts.append((f"Range of {name}", f"{values.min():.5g} to {values.max():.5g} {unit}"))
    return facts


def _share(value: float | None) -> str:
    return "not available" if value is None or not math.isfinite(value) else f"{value:.2%}"


def curve_plot(curve: FrictionCurve, found: Identification) -> Plot:
    """Draw friction against velocity: the data cloud, the fitted law and its band."""
    kind = found.log.kind
    also = " and offset" if "offset" in found.estimate.parameters else ""
    stride = max(1, math.ceil(curve.velocity.size / _CLOUD))
    cloud = draw.markers(
        curve.velocity[::stride],
        curve.friction[::stride],
        name="measured",
        look={"color": draw.GREY, "size": 4.5, "opacity": 0.35},
        hoverinfo="skip",
    )
    law, name = curve.fitted_velocity, "95 % band of the law"
    fitted = "fitted law" + also.replace("and", "with")
    thinned = (
        f" Every {_ordinal(stride)} of {curve.velocity.size} points is drawn." if stride > 1 else ""
    )
    return Plot(
        anchor="curve-plot",
        alternative=(
            f"Friction force against velocity, from {np.min(curve.velocity):.3g} to "
            f"{np.max(curve.velocity):.3g} {printed_unit('velocity', kind)}: a cloud of measured "
            "points with the fitted law and its 95 percent band."
        ),
        caption=(
            "Each point is the effort less the force that accelerates (and, of a flexible arm, the "
            "spring force) at one sample. The fitted law should run through the middle of the "
            "cloud at every speed; a cloud that bends away from it at low speed shows a Stribeck "
            "effect, one that splits into several bands shows friction that depends on position "
            f"or temperature.{thinned}"
        ),
        traces=[
            cloud,
            *draw.band(law, curve.band_low, curve.band_high, name=name),
            line(law, curve.fitted_friction, fitted, Look(draw.BLUE, 1.4)),
        ],
        layout=layout(
            x=quantity_axis("velocity", kind),
            y=[axis(f"friction{also} [{unit_text(found.log.unit('effort'))}]")],
            hovermode="closest",
        ),
        height=420,
    )


def balance_plot(energy: EnergyBalance, found: Identification) -> Plot:
    """Draw how the input energy is stored, and the dissipated beside the explained energy."""
    kind, time = found.log.kind, energy.time
    also = " and offset" if "offset" in found.estimate.parameters else ""
    measured, explained = energy.measured_dissipation, energy.explained_dissipation
    unit = unit_text(found.log.unit("energy"))
    traces = [
        line(time, energy.input, "input", Look(draw.ORANGE)),
        line(time, energy.kinetic, "kinetic", Look(draw.SKY)),
    ]
    if np.any(energy.potential):
        look = Look(draw.PINK, 2.0, "dot")
        traces.append(line(time, energy.potential, "potential", look))
    traces.append(line(time, measured, "dissipated, measured", Look(draw.PALE, 5.0), 2))
    look = Look(draw.BLUE, dash="dash")
    traces.append(line(time, explained, "dissipated, explained by the law", look, 2))
    return Plot(
        anchor="energy-plot",
        alternative=(
            "Two panels over time: input, kinetic and potential energy; and the dissipated energy "
            "as measured and as the fitted friction explains it. At the end of the log "
            f"{measured[-1]:.3g} {unit} are dissipated, of which the fit explains "
            f"{explained[-1]:.3g} {unit}."
        ),
        caption=(
            "The upper panel shows how the input energy is stored. The lower one shows the input "
            "energy less kinetic and potential energy (measured) and the energy that the fitted "
            f"friction{also} {'take' if also else 'takes'} (explained). The two should agree. A "
            "gap that grows with time is dissipation without a term in the law, or a wrong mass or "
            "effort scale."
        ),
        traces=traces,
        layout=layout(
            x=quantity_axis("time", kind),
            y=[
                quantity_axis("energy", kind, found.log.effort_unit),
                axis(f"dissipated [{unit}]"),
            ],
        ),
        height=480,
    )


def evolution_plots(
    evolution: EstimateEvolution, estimate: FrictionEstimate, truth: Mapping[str, float] | None
) -> list[Plot]:
    """Draw the evolution of each estimate with its band, and the true value if it is known."""
    plots: list[Plot] = []
    time = evolution.time
    for name, values in evolution.values.items():
        widths = estimate.parameters[name].quantile * evolution.stds[name]
        label, unit = parameter_label(name), unit_text(estimate.unit(name))
        true = None if truth is None else truth.get(name)
        traces = [
            *draw.band(time, values - widths, values + widths, name="95 % interval"),
            line(time, values, "estimate", Look(draw.BLUE, 2.2)),
        ]
        if true is not None:
            look = Look(draw.VERMILION, dash="dash")
            traces.append(draw.level(time, true, "true value", look))
        settled = f"It ends at {values[-1]:.4g} {unit}" if math.isfinite(values[-1]) else ""
        known = "" if true is None else f"; the true value is {true:.4g} {unit}"
        # The settled part: the first values may be far off
        later = values[values.size // 4 :], (values - widths)[-1:], (values + widths)[-1:]
        settings = draw.range_of(*later, [] if true is None else [true], room=0.25)
        plots.append(
            Plot(
                anchor=f"evolution-{name.replace('_', '-')}",
                alternative=f"{label} over time. {settled}{known}.",
                traces=traces,
                layout=layout(
                    x=quantity_axis("time", estimate.kind),
                    y=[axis(f"{draw.symbol(name)} [{unit}]", **settings)],
                ),
                height=260,
                heading=label,
            )
        )
    return plots


def residual_plots(residuals: Residuals, found: Identification) -> list[Plot]:
    """Draw the residual over time and its autocorrelation."""
    kind = found.log.kind
    unit = unit_text(found.log.unit("effort"))
    residual, lag, bound = residuals.residual, residuals.lag, residuals.white_bound
    outside = float(np.mean(np.abs(residuals.autocorrelation[lag > 0]) > bound))
    over_time = Plot(
        anchor="residual-plot",
        alternative=(
            f"Residual effort over time, between {np.nanmin(residual):.3g} and "
            f"{np.nanmax(residual):.3g} {unit}."
        ),
        caption=(
            "Effort that the identified terms do not explain while the axis moves, "
            f"{share_text(residuals.share)} of the effort. A pattern that repeats with the motion "
            "is a term that the model lacks; spikes at reversals are presliding or a delayed sign "
            "of the velocity."
        ),
        traces=[line(residuals.time, residual, "residual", Look(draw.INK, 0.9))],
        layout=layout(x=quantity_axis("time", kind), y=[axis(f"residual effort [{unit}]")]),
        height=280,
    )
    # A vertical stem a lag
    stems, heights = np.full((2, 3 * lag.size), np.nan)
    stems[0::3] = stems[1::3] = lag
    heights[0::3], heights[1::3] = 0.0, residuals.autocorrelation
    ends = np.array([0.0, float(lag[-1])])
    white = draw.band(
        ends, np.full(2, -bound), np.full(2, bound), name="95 % band of a white residual"
    )
    correlation = Plot(
        anchor="correlation-plot",
        alternative=(
            f"Autocorrelation of the residual up to a lag of {lag[-1]:.3g} seconds, with "
            f"the band of plus and minus {bound:.2g} that a white residual stays in; "
            f"{outside:.0%} of the lags lie outside."
        ),
        caption=(
            f"A white residual stays inside the shaded band at 95 % of the lags; here "
            f"{1 - outside:.0%} do. Beyond it, samples are correlated. The intervals above allow "
            "for that: they do not assume independent samples."
        ),
        traces=[*white, line(stems, heights, "residual", Look(draw.INK, 1.5))],
        layout=layout(x=axis("lag [s]"), y=[axis("autocorrelation [-]", range=[-1.05, 1.05])]),
        height=300,
    )
    return [over_time, correlation]


def resimulation_plot(again: Resimulation, found: Identification) -> Plot:
    """Draw the measured motion beside the identified model's motion under the same effort."""
    kind, time = found.log.kind, again.time
    traces = [
        line(time, values, name, look, row)
        for row, pair in (
            (1, (again.measured_position, again.simulated_position)),
            (2, (again.measured_velocity, again.simulated_velocity)),
        )
        for name, values, look in (
            ("measured", pair[0], Look(draw.PALE, 4.0)),
            ("identified model", pair[1], Look(draw.BLUE, 1.4)),
        )
    ]
    restart = (
        "from the first sample to the last without correction"
        if again.horizon >= float(time[-1] - time[0])
        else f"and restarts from the measurement every {again.horizon:.3g} s"
    )
    return Plot(
        anchor="motion-plot",
        alternative=(
            "Two panels over time: position and velocity, measured and simulated with the "
            f"identified model. The position fit is {again.fit:.1%}."
        ),
        caption=(
            f"The identified model is driven by the logged effort, {restart}. It explains "
            f"{again.fit:.1%} of the measured position (100 % is a perfect fit). Stops at other "
            "times than measured show an error of friction near standstill."
        ),
        traces=traces,
        layout=layout(
            x=quantity_axis("time", kind),
            y=[quantity_axis("position", kind), quantity_axis("velocity", kind)],
        ),
        height=480,
    )


def log_plot(log: AxisLog, number: int = 1) -> Plot:
    """Draw the position, velocity and effort of a log as they were recorded."""
    gaps, time, velocity = log.segment_starts[1:], log.time, log.measured_velocity
    measured = velocity is not None
    if velocity is None:
        velocity = np.gradient(log.measured_position, time)
    first, second = Look(draw.BLUE, 1.4), Look(draw.VERMILION, 1.4, "dot")
    breaks = np.insert(time, gaps, time[gaps])
    traces = [
        line(breaks, np.insert(values, gaps, np.nan), name, look, row)
        for values, name, look, row in (
            (log.measured_position, "measured", first, 1),
            (velocity, "measured", first, 2),
            (log.effort, "measured", first, 3),
            (log.measured_load_position, "second mass", second, 1),
            (log.measured_load_velocity, "second mass", second, 2),
        )
        if values is not None
    ]
    return Plot(
        anchor=f"log-plot-{number}",
        alternative=(
            f"Three panels over {time[-1] - time[0]:.3g} s: position, velocity and effort of "
            f"{log.name} as they were recorded."
        ),
        caption=(
            "As recorded, in SI units. Check that signs, units and scales are those of the axis, "
            "and that it moves both ways at several speeds."
            + ("" if measured else " The velocity is the difference quotient of the position.")
            + draw.thinned_text(time.size)
        ),
        traces=traces,
        layout=layout(
            x=quantity_axis("time", log.kind),
            y=[
                quantity_axis(name, log.kind, log.effort_unit)
                for name in ("position", "velocity", "effort")
            ],
        ),
        height=520,
    )


def _ordinal(k: int) -> str:
    endings = {1: "st", 2: "nd", 3: "rd"}
    ending = "th" if 10 <= k % 100 <= 20 else endings.get(k % 10, "th")
    return f"{k}{ending}"
