"""The figures of an identification, each from one finished record; nothing is estimated here."""

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from stickslip.presentation.figures import drawing as draw
from stickslip.presentation.figures.drawing import (
    Look,
    Plot,
    Trace,
    axis,
    axis_title,
    band,
    layout,
    line,
)
from stickslip.presentation.words import printed_unit, share_text
from stickslip.records import (
    AxisLog,
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    FrictionEstimate,
    Identification,
    Residuals,
    Resimulation,
    parameter_label,
    unit_of,
)

__all__ = [
    "balance_plot",
    "curve_plot",
    "evolution_plots",
    "log_plot",
    "residual_plots",
    "resimulation_plot",
]

_CLOUD = 3000


def curve_plot(curve: FrictionCurve, found: Identification) -> Plot:
    """Draw friction against velocity: the data cloud, the fitted law and its band."""
    kind = found.log.kind
    also = " and offset" if "offset" in found.estimate.parameters else ""
    stride = max(1, math.ceil(curve.velocity.size / _CLOUD))
    cloud = draw.markers(
        curve.velocity[::stride],
        curve.friction[::stride],
        name="measured",
        look={"color": draw.GREY, "size": 3.5, "opacity": 0.35},
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
            *band(law, curve.band_low, curve.band_high, name=name),
            line(law, curve.fitted_friction, fitted, Look(draw.BLUE, 2.4)),
        ],
        layout=layout(
            x=axis(axis_title("velocity", kind)),
            y=[axis(f"friction{also} [{printed_unit('effort', kind)}]")],
            hovermode="closest",
        ),
        height=420,
    )


def balance_plot(energy: EnergyBalance, found: Identification) -> Plot:
    """Draw where the input energy went, and what was dissipated against what the law explains."""
    kind, time = found.log.kind, energy.time
    also = " and offset" if "offset" in found.estimate.parameters else ""
    measured, explained = energy.measured_dissipation, energy.explained_dissipation
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
            f"{measured[-1]:.3g} J are dissipated, of which the fit explains {explained[-1]:.3g} J."
        ),
        caption=(
            "Above, where the input energy is stored. Below, what is left of it when kinetic and "
            f"potential energy are taken off (measured) and what the fitted friction{also} "
            f"{'take' if also else 'takes'} (explained). The two should lie on each other; a gap "
            "that grows with time is dissipation that the law does not know, or a wrong mass or "
            "effort scale."
        ),
        traces=traces,
        layout=layout(
            x=axis(axis_title("time", kind)),
            y=[axis(axis_title("energy", kind)), axis(f"dissipated [{unit_of('energy', kind)}]")],
        ),
        height=480,
    )


def evolution_plots(
    evolution: EstimateEvolution, estimate: FrictionEstimate, truth: Mapping[str, float] | None
) -> list[Plot]:
    """Draw how each estimate settles, with its band, and the true value where it is known."""
    plots: list[Plot] = []
    time = evolution.time
    for name, values in evolution.values.items():
        widths = estimate.parameters[name].quantile * evolution.stds[name]
        label, unit = parameter_label(name), printed_unit(name, estimate.kind)
        true = None if truth is None else truth.get(name)
        traces = [
            *band(time, values - widths, values + widths, name="95 % interval"),
            line(time, values, "estimate", Look(draw.BLUE, 2.2)),
        ]
        if true is not None:
            look = Look(draw.VERMILION, dash="dash")
            traces.append(draw.level(time, true, "true value", look))
        settled = f"It ends at {values[-1]:.4g} {unit}" if math.isfinite(values[-1]) else ""
        known = "" if true is None else f"; the true value is {true:.4g} {unit}"
        # How the estimate settles, not its first wild guesses
        later = values[values.size // 4 :], (values - widths)[-1:], (values + widths)[-1:]
        settings = draw.range_of(*later, [] if true is None else [true], room=0.25)
        plots.append(
            Plot(
                anchor=f"evolution-{name.replace('_', '-')}",
                alternative=f"{label} over time. {settled}{known}.",
                traces=traces,
                layout=layout(
                    x=axis(axis_title("time", estimate.kind)),
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
    unit = printed_unit("effort", kind)
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
            "is a term that the model lacks; spikes at reversals are presliding or a late sign of "
            "the velocity."
        ),
        traces=[line(residuals.time, residual, "residual", Look(draw.INK, 0.9))],
        layout=layout(x=axis(axis_title("time", kind)), y=[axis(f"residual effort [{unit}]")]),
        height=280,
    )
    # A vertical stem a lag
    stems, heights = np.full((2, 3 * lag.size), np.nan)
    stems[0::3] = stems[1::3] = lag
    heights[0::3], heights[1::3] = 0.0, residuals.autocorrelation
    ends = np.array([0.0, float(lag[-1])])
    white = band(ends, np.full(2, -bound), np.full(2, bound), name="95 % band of a white residual")
    correlation = Plot(
        anchor="correlation-plot",
        alternative=(
            f"Autocorrelation of the residual up to a lag of {lag[-1]:.3g} seconds, with "
            f"the band of plus and minus {bound:.2g} that a white residual stays in; "
            f"{outside:.0%} of the lags lie outside."
        ),
        caption=(
            f"A white residual stays inside the shaded band at 95 % of the lags; here "
            f"{1 - outside:.0%} do. Where it does not, samples repeat one another. The intervals "
            "above allow for that: they do not assume that every sample is independent."
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
        else f"and starts anew from the measurement every {again.horizon:.3g} s"
    )
    return Plot(
        anchor="motion-plot",
        alternative=(
            "Two panels over time: position and velocity, measured and simulated with the "
            f"identified model. The position fit is {again.fit:.1%}."
        ),
        caption=(
            f"The identified model is driven by the logged effort, {restart}. It explains "
            f"{again.fit:.1%} of the measured position (100 % is a perfect fit). Look for "
            "stops that come too early or too late: they show friction that is off near standstill."
        ),
        traces=traces,
        layout=layout(
            x=axis(axis_title("time", kind)),
            y=[axis(axis_title("position", kind)), axis(axis_title("velocity", kind))],
        ),
        height=480,
    )


def log_plot(log: AxisLog, number: int = 1) -> Plot:
    """Draw the position, velocity and effort of a log as they were recorded."""
    gaps = log.segment_starts[1:]
    time = log.time
    measured = log.measured_velocity is not None
    velocity = (
        np.gradient(log.measured_position, time)
        if log.measured_velocity is None
        else log.measured_velocity
    )

    def recorded(values: Float[np.ndarray, " n"], row: int, *, load: bool = False) -> Trace:
        apart = np.insert(time, gaps, time[gaps]), np.insert(values, gaps, np.nan)
        look = Look(draw.VERMILION, 1.4, "dot") if load else Look(draw.BLUE, 1.4)
        return line(*apart, "second mass" if load else "measured", look, row)

    traces = [
        recorded(log.measured_position, 1),
        recorded(velocity, 2),
        recorded(log.effort, 3),
    ]
    if log.measured_load_position is not None:
        traces.append(recorded(log.measured_load_position, 1, load=True))
    if log.measured_load_velocity is not None:
        traces.append(recorded(log.measured_load_velocity, 2, load=True))
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
            x=axis(axis_title("time", log.kind)),
            y=[axis(axis_title(name, log.kind)) for name in ("position", "velocity", "effort")],
        ),
        height=520,
    )


def _ordinal(k: int) -> str:
    endings = {1: "st", 2: "nd", 3: "rd"}
    ending = "th" if 10 <= k % 100 <= 20 else endings.get(k % 10, "th")
    return f"{k}{ending}"
