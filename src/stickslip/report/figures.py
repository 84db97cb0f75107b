"""The figures of an identification, each from one finished record; nothing is estimated here."""

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from stickslip.records import (
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    FrictionEstimate,
    Identification,
    Residuals,
    Resimulation,
    parameter_label,
    share_text,
    unit_of,
    unit_text,
)
from stickslip.report.drawing import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    PALE,
    PINK,
    SKY,
    VERMILION,
    Plot,
    Trace,
    axis,
    axis_title,
    band,
    layout,
    line,
    numbers,
    symbol,
)

__all__ = ["balance_plot", "curve_plot", "evolution_plots", "residual_plots", "resimulation_plot"]

_CLOUD = 3000


def curve_plot(curve: FrictionCurve, identification: Identification) -> Plot:
    """Draw friction against velocity: the data cloud, the fitted law and its band."""
    kind = identification.log.kind
    also = " and offset" if "offset" in identification.estimate.parameters else ""
    stride = max(1, math.ceil(curve.velocity.size / _CLOUD))
    cloud: Trace = {
        "type": "scatter",
        "mode": "markers",
        "name": "measured",
        "x": numbers(curve.velocity[::stride]),
        "y": numbers(curve.friction[::stride]),
        "marker": {"color": GREY, "size": 3.5, "opacity": 0.35},
        "hoverinfo": "skip",
    }
    unit = unit_text(unit_of("velocity", kind))
    thinned = (
        f" Every {_ordinal(stride)} of {curve.velocity.size} points is drawn." if stride > 1 else ""
    )
    return Plot(
        anchor="curve-plot",
        alternative=(
            f"Friction force against velocity, from {np.min(curve.velocity):.3g} to "
            f"{np.max(curve.velocity):.3g} {unit}: a cloud of measured points with the fitted law "
            "and its 95 percent band."
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
            *band(
                curve.fitted_velocity, curve.band_low, curve.band_high, name="95 % band of the law"
            ),
            line(
                curve.fitted_velocity,
                curve.fitted_friction,
                name="fitted law" + also.replace("and", "with"),
                colour=BLUE,
                width=2.4,
            ),
        ],
        layout=layout(
            x=axis(axis_title("velocity", kind)),
            y=[axis(f"friction{also} [{unit_text(unit_of('effort', kind))}]")],
            hovermode="closest",
        ),
        height=420,
    )


def balance_plot(energy: EnergyBalance, identification: Identification) -> Plot:
    """Draw where the input energy went, and what was dissipated against what the law explains."""
    kind = identification.log.kind
    also = " and offset" if "offset" in identification.estimate.parameters else ""
    upper = [
        line(energy.time, energy.input, name="input", colour=ORANGE),
        line(energy.time, energy.kinetic, name="kinetic", colour=SKY),
    ]
    if np.any(energy.potential):
        upper.append(
            line(
                energy.time, energy.potential, name="potential", colour=PINK, dash="dot", width=2.0
            )
        )
    lower = [
        line(
            energy.time,
            energy.measured_dissipation,
            name="dissipated, measured",
            colour=PALE,
            width=5.0,
            row=2,
        ),
        line(
            energy.time,
            energy.explained_dissipation,
            name="dissipated, explained by the law",
            colour=BLUE,
            dash="dash",
            row=2,
        ),
    ]
    return Plot(
        anchor="energy-plot",
        alternative=(
            "Two panels over time: input, kinetic and potential energy; and the dissipated energy "
            "as measured and as the fitted friction explains it. At the end of the log "
            f"{energy.measured_dissipation[-1]:.3g} J are dissipated, of which the fit explains "
            f"{energy.explained_dissipation[-1]:.3g} J."
        ),
        caption=(
            "Above, where the input energy is stored. Below, what is left of it when kinetic and "
            f"potential energy are taken off (measured) and what the fitted friction{also} "
            f"{'take' if also else 'takes'} (explained). The two should lie on each other; a gap "
            "that grows with time is dissipation that the law does not know, or a wrong mass or "
            "effort scale."
        ),
        traces=[*upper, *lower],
        layout=layout(
            x=axis(axis_title("time", kind)),
            y=[
                axis(axis_title("energy", kind)),
                axis(f"dissipated [{unit_of('energy', kind)}]"),
            ],
        ),
        height=480,
    )


def evolution_plots(
    evolution: EstimateEvolution, estimate: FrictionEstimate, truth: Mapping[str, float] | None
) -> list[Plot]:
    """Draw how each estimate settles, with its band, and the true value where it is known."""
    plots: list[Plot] = []
    for name, values in evolution.values.items():
        widths = estimate.parameters[name].quantile * evolution.stds[name]
        label = parameter_label(name)
        true_value = None if truth is None else truth.get(name)
        unit = unit_text(unit_of(name, estimate.kind))
        traces = [
            *band(
                evolution.time,
                values - widths,
                values + widths,
                name="95 % interval",
            ),
            line(evolution.time, values, name="estimate", colour=BLUE, width=2.2),
        ]
        if true_value is not None:
            ends = evolution.time[[0, -1]]
            traces.append(
                line(
                    ends,
                    np.full(2, true_value),
                    name="true value",
                    colour=VERMILION,
                    dash="dash",
                )
            )
        settled = f"It ends at {values[-1]:.4g} {unit}" if math.isfinite(values[-1]) else ""
        known = "" if true_value is None else f"; the true value is {true_value:.4g} {unit}"
        plots.append(
            Plot(
                anchor=f"evolution-{name.replace('_', '-')}",
                alternative=f"{label} over time. {settled}{known}.",
                caption="",
                traces=traces,
                layout=layout(
                    x=axis(axis_title("time", estimate.kind)),
                    y=[
                        axis(
                            f"{symbol(name)} [{unit}]",
                            **_settled_range(values, widths, true_value),
                        )
                    ],
                ),
                height=260,
                heading=label,
            )
        )
    return plots


def residual_plots(residuals: Residuals, identification: Identification) -> list[Plot]:
    """Draw the residual over time and its autocorrelation."""
    kind = identification.log.kind
    unit = unit_text(unit_of("effort", kind))
    inside = residuals.lag > 0
    outside = float(np.mean(np.abs(residuals.autocorrelation[inside]) > residuals.white_bound))
    over_time = Plot(
        anchor="residual-plot",
        alternative=(
            "Residual effort over time, between "
            f"{np.nanmin(residuals.residual):.3g} and {np.nanmax(residuals.residual):.3g} {unit}."
        ),
        caption=(
            "Effort that the identified terms do not explain while the axis moves, "
            f"{share_text(residuals.share)} of the effort. A pattern that repeats with the motion "
            "is a term that the model lacks; spikes at reversals are presliding or a late sign of "
            "the velocity."
        ),
        traces=[
            line(residuals.time, residuals.residual, name="residual", colour=INK, width=0.9),
        ],
        layout=layout(
            x=axis(axis_title("time", kind)),
            y=[axis(f"residual effort [{unit}]")],
        ),
        height=280,
    )
    stems = np.full(3 * residuals.lag.size, np.nan)
    heights = stems.copy()
    stems[0::3] = stems[1::3] = residuals.lag
    heights[0::3] = 0.0
    heights[1::3] = residuals.autocorrelation
    bound = residuals.white_bound
    ends = np.array([0.0, float(residuals.lag[-1])])
    correlation = Plot(
        anchor="correlation-plot",
        alternative=(
            f"Autocorrelation of the residual up to a lag of {residuals.lag[-1]:.3g} seconds, with "
            f"the band of plus and minus {bound:.2g} that a white residual stays in; "
            f"{outside:.0%} of the lags lie outside."
        ),
        caption=(
            f"A white residual stays inside the shaded band at 95 % of the lags; here "
            f"{1 - outside:.0%} do. Where it does not, samples repeat one another. The intervals "
            "above allow for that: they do not assume that every sample is independent."
        ),
        traces=[
            *band(
                ends, np.full(2, -bound), np.full(2, bound), name="95 % band of a white residual"
            ),
            _stems(stems, heights),
        ],
        layout=layout(
            x=axis("lag [s]"),
            y=[axis("autocorrelation [-]", range=[-1.05, 1.05])],
        ),
        height=300,
    )
    return [over_time, correlation]


def resimulation_plot(resimulation: Resimulation, identification: Identification) -> Plot:
    """Draw the measured motion beside the identified model's motion under the same effort."""
    kind = identification.log.kind
    time = resimulation.time
    traces: list[Trace] = []
    for row, measured, simulated in (
        (1, resimulation.measured_position, resimulation.simulated_position),
        (2, resimulation.measured_velocity, resimulation.simulated_velocity),
    ):
        pair = (
            line(time, measured, name="measured", colour=PALE, width=4.0, row=row),
            line(time, simulated, name="identified model", colour=BLUE, width=1.4, row=row),
        )
        traces.extend(pair)
    whole = resimulation.horizon >= float(time[-1] - time[0])
    restart = (
        "from the first sample to the last without correction"
        if whole
        else f"and starts anew from the measurement every {resimulation.horizon:.3g} s"
    )
    return Plot(
        anchor="motion-plot",
        alternative=(
            "Two panels over time: position and velocity, measured and simulated with the "
            f"identified model. The position fit is {resimulation.fit:.1%}."
        ),
        caption=(
            f"The identified model is driven by the logged effort, {restart}. It explains "
            f"{resimulation.fit:.1%} of the measured position (100 % is a perfect fit). Look for "
            "stops that come too early or too late: they show friction that is off near standstill."
        ),
        traces=traces,
        layout=layout(
            x=axis(axis_title("time", kind)),
            y=[axis(axis_title("position", kind)), axis(axis_title("velocity", kind))],
        ),
        height=480,
    )


def _stems(x: Float[np.ndarray, " n"], y: Float[np.ndarray, " n"]) -> Trace:
    """Draw a vertical stem a lag; they are few, so none is thinned."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "residual",
        "x": numbers(x),
        "y": numbers(y),
        "connectgaps": False,
        "line": {"color": INK, "width": 1.5},
    }


def _settled_range(
    values: Float[np.ndarray, " n"], widths: Float[np.ndarray, " n"], true_value: float | None
) -> dict[str, list[float]]:
    """Choose a vertical range that shows how the estimate settles, not its first wild guesses."""
    later = slice(values.size // 4, None)
    settled = values[later], (values - widths)[-1:], (values + widths)[-1:]
    shown = np.concatenate([*settled, [] if true_value is None else [true_value]])
    shown = shown[np.isfinite(shown)]
    if not shown.size:
        return {}
    low, high = float(np.min(shown)), float(np.max(shown))
    margin = 0.25 * (high - low) or 0.05 * abs(high) or 1.0
    return {"range": [low - margin, high + margin]}


def _ordinal(k: int) -> str:
    endings = {1: "st", 2: "nd", 3: "rd"}
    ending = "th" if 10 <= k % 100 <= 20 else endings.get(k % 10, "th")
    return f"{k}{ending}"
