"""Figures 1 to 9 of part B, from the law of a pulse and ten runs of each case."""

import numpy as np
from jaxtyping import Float

from stickslip.planning import PulseLaw
from stickslip.simulation import simulate
from studies.van_de_wijdeven.part_b.cases import BOUNDED, PAPWC, PWC, READINGS, UNBOUNDED
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.numbers import FAR, NEAR, width_by_gain
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import (
    COULOMB_FRICTION,
    LONGEST_PULSE,
    PULSE_EFFORT,
    RUNS_IN_A_ROW,
    SAMPLING_TIME,
    TOLERANCE,
    source_plant,
)
from studies.van_de_wijdeven.records import Curve, CurveRole, Panel, ReproducedFigure

_SHOWN = (0, RUNS_IN_A_ROW - 1)
_BOUNDS: tuple[tuple[float | None, str, CurveRole], ...] = (
    (UNBOUNDED, "t_p,max = ∞", "first"),
    (BOUNDED, f"t_p,max = {LONGEST_PULSE:g} s", "second"),
)
_TIME = 1.0  # of each run that is drawn: what comes later is like its end [s]
_TIME_LABEL = "time [s]"
_POINTS = 301
_BETWEEN = 4  # points a sample of an error that is drawn
_ZOOM = {PWC: 0.5, PAPWC: 0.05}  # half the vertical range around the target [mm]
_MARGIN = 0.08  # of the vertical range, on either side

_RUNS = (
    "Left the first run, right the tenth, each run beginning with the estimates and the covariance "
    "that the one before ended with. "
)


def part_b_figures(evidence: Evidence) -> tuple[ReproducedFigure, ...]:
    """Return the nine figures in the source's order."""
    return (
        _displacement(evidence.law),
        ReproducedFigure(
            number="2",
            title="Model of the system",
            caption="The mass m, pushed by the input u against viscous friction c and against f, "
            "which is Coulomb friction and stiction.",
            columns=1,
            panels=(),
            sketch="mass with friction",
        ),
        _errors(evidence, "3", PWC),
        _errors(evidence, "4", PAPWC),
        _pulses(evidence, "5", PWC),
        _pulses(evidence, "6", PAPWC),
        _gains(evidence, "7", PWC),
        _gains(evidence, "8", PAPWC),
        _frictions(evidence),
    )


def _displacement(law: PulseLaw) -> ReproducedFigure:
    b = law.gain(PULSE_EFFORT)
    fitted = FAR / float(law.width_for(FAR, effort=PULSE_EFFORT)) ** 2
    long = width_by_gain(NEAR, fitted)

    def panel(title: str, widest: float, wanted: float, *, marks: bool) -> Panel:
        widths = np.linspace(0.0, widest, _POINTS)
        roles: tuple[CurveRole, ...] = ("first", "second", "third")
        lines = (
            ("exact, Eq. 3", law.displacement(PULSE_EFFORT, widths)),
            ("Eq. 4 with b", b * widths**2),
            (f"Eq. 4 with {fitted / b:.2f} b", fitted * widths**2),
        )
        curves = [
            Curve(label=label, role=role, x=1e3 * widths, y=1e3 * values)
            for role, (label, values) in zip(roles, lines, strict=True)
        ]
        curves.append(_level(f"{1e3 * wanted:g} mm", 1e3 * wanted, (0.0, 1e3 * widest)))
        if marks:
            reached = 1e3 * float(law.displacement(PULSE_EFFORT, long))
            curves.append(
                Curve(
                    label=f"{1e3 * long:.0f} ms go {reached:.2f} mm",
                    role="fourth",
                    x=1e3 * np.array([long, long]),
                    y=np.array([0.0, reached]),
                )
            )
        top = 1.3e3 * wanted if not marks else 1.6e3 * wanted
        return Panel(
            title=title,
            x_label="pulse width t_p [ms]",
            y_label="displacement d [mm]",
            y_range=(0.0, top),
            curves=tuple(curves),
        )

    return ReproducedFigure(
        number="1",
        title="Displacement d as function of the pulse width t_p",
        caption="All parameters known, as in Table 1. Solid: exact, with viscous friction. Dotted: "
        "without it. Dash-dotted: without it, with b̂ such that 10 mm come out right. The right "
        "panel, not in the source, is its example of 2.0 mm left over: with that b̂ the pulse is "
        "too long and goes too far.",
        columns=2,
        panels=(
            panel("whole", 0.1, FAR, marks=False),
            panel("around 2.0 mm", 0.05, NEAR, marks=True),
        ),
    )


def _level(label: str, value: float, ends: tuple[float, float]) -> Curve:
    return Curve(label=label, role="truth", x=np.array(ends), y=np.full(2, value))


def _errors(evidence: Evidence, number: str, controller: str) -> ReproducedFigure:
    panels: list[Panel] = []
    for reading in READINGS[controller]:
        for zoomed in (False, True):
            panels += [
                _error_panel(evidence, controller, reading, run, zoomed=zoomed) for run in _SHOWN
            ]
    lines = (
        f"±d_min, what a single sample does (Eq. 23), {_dmin(evidence):.2f} mm"
        if controller == PWC
        else f"the tolerance, ±{1e6 * TOLERANCE:g} µm"
    )
    return ReproducedFigure(
        number=number,
        title=f"Error as a function of time, {_name(controller)}",
        caption=_RUNS + "Rows in pairs: the whole, and the same around zero, which the source does "
        f"not show; dashed {lines}. The upper pair is {READINGS[controller][0]}, the lower "
        f"{READINGS[controller][1]}.",
        columns=2,
        panels=tuple(panels),
    )


def _name(controller: str) -> str:
    return "the original PWC" if controller == PWC else "adaptive PAPWC"


def _dmin(evidence: Evidence) -> float:
    return 1e3 * float(evidence.law.displacement(PULSE_EFFORT, SAMPLING_TIME))


def _error_panel(
    evidence: Evidence, controller: str, reading: str, run: int, *, zoomed: bool
) -> Panel:
    curves: list[Curve] = []
    for bound, label, role in _BOUNDS:
        series = evidence.series[controller, reading, bound]
        time, error = _between_samples(series, run)
        curves.append(Curve(label=label, role=role, x=time, y=1e3 * error))
    title = f"run {run + 1}, {reading}"
    if not zoomed:
        return Panel(title=title, x_label=_TIME_LABEL, y_label="error [mm]", curves=tuple(curves))
    limit = _dmin(evidence) if controller == PWC else 1e3 * TOLERANCE
    word = "±d_min" if controller == PWC else "±tolerance"
    curves += [_level(word, sign * limit, (0.0, _TIME)) for sign in (1.0, -1.0)]
    half = _ZOOM[controller]
    return Panel(
        title=f"{title}: around zero",
        x_label=_TIME_LABEL,
        y_label="error [mm]",
        y_range=(-half, half),
        curves=tuple(curves),
    )


def _between_samples(
    series: Series, run: int
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return the error of a run between its samples too, as far as it is drawn [s, m]."""
    controller, log = series.controllers[run], series.runs[run].run.log
    samples = round(_TIME / controller.sampling_time)
    motion = simulate(
        source_plant(),
        np.repeat(log.effort[:samples], _BETWEEN),
        sampling_time=controller.sampling_time / _BETWEEN,
    )
    return motion.time, controller.target - motion.position


def _pulses(evidence: Evidence, number: str, controller: str) -> ReproducedFigure:
    panels = [
        _pulse_panel(evidence.series[controller, reading, bound], run, f"{label}, {reading}")
        for reading in _drawn_readings(controller)
        for bound, label, _ in _BOUNDS
        for run in _SHOWN
    ]
    readings = (
        f"{READINGS[controller][0]}; with {READINGS[controller][1]} it looks alike."
        if controller == PWC
        else f"The upper pair of rows is {READINGS[controller][0]}, the lower "
        f"{READINGS[controller][1]}."
    )
    return ReproducedFigure(
        number=number,
        title=f"Input f_p as a function of time, {_name(controller)}",
        caption=_RUNS + "Above without a bound of the pulse width, below with it. " + readings,
        columns=2,
        panels=tuple(panels),
    )


def _drawn_readings(controller: str) -> tuple[str, ...]:
    return READINGS[controller][:1] if controller == PWC else READINGS[controller]


def _pulse_panel(series: Series, run: int, what: str) -> Panel:
    log = series.runs[run].run.log
    shown = log.time <= _TIME
    return Panel(
        title=f"run {run + 1}, {what}",
        x_label=_TIME_LABEL,
        y_label="f_p [N]",
        y_range=(-1.1 * PULSE_EFFORT, 1.1 * PULSE_EFFORT),
        curves=(
            Curve(
                label="input", role="first", x=log.time[shown], y=log.effort[shown], staircase=True
            ),
        ),
    )


def _gains(evidence: Evidence, number: str, controller: str) -> ReproducedFigure:
    return ReproducedFigure(
        number=number,
        title=f"b̂ as a function of time, {_name(controller)}",
        caption=_RUNS + "Each value holds until the outcome of the next pulse is known. Dashed: "
        "the theoretical b. The upper row is "
        f"{READINGS[controller][0]}, the lower {READINGS[controller][1]}.",
        columns=2,
        panels=_estimate_panels(
            evidence,
            controller,
            "pulse_gain",
            y_label="b̂ [m/s²]",
            truth=("b", evidence.gain),
        ),
    )


def _frictions(evidence: Evidence) -> ReproducedFigure:
    return ReproducedFigure(
        number="9",
        title="f̂_c as a function of time, adaptive PAPWC",
        caption=_RUNS + "Dashed: the true Coulomb friction. What viscous friction takes away is "
        f"taken for Coulomb friction. The upper row is {READINGS[PAPWC][0]}, the lower "
        f"{READINGS[PAPWC][1]}.",
        columns=2,
        panels=_estimate_panels(
            evidence,
            PAPWC,
            "coulomb_friction",
            y_label="f̂_c [N]",
            truth=("f_c", COULOMB_FRICTION),
        ),
    )


def _estimate_panels(
    evidence: Evidence,
    controller: str,
    name: str,
    *,
    y_label: str,
    truth: tuple[str, float],
) -> tuple[Panel, ...]:
    panels: list[Panel] = []
    for reading in READINGS[controller]:
        drawn = [
            [
                _estimate(evidence.series[controller, reading, bound], run, name, label, role)
                for bound, label, role in _BOUNDS
            ]
            for run in _SHOWN
        ]
        span = _range([curve.y for curves in drawn for curve in curves], truth[1])
        panels += [
            Panel(
                title=f"run {run + 1}, {reading}",
                x_label=_TIME_LABEL,
                y_label=y_label,
                y_range=span,
                curves=(*curves, _level(*truth, (0.0, _TIME))),
            )
            for run, curves in zip(_SHOWN, drawn, strict=True)
        ]
    return tuple(panels)


def _estimate(series: Series, run: int, name: str, label: str, role: CurveRole) -> Curve:
    done = series.runs[run]
    shown = done.estimate_times <= _TIME
    values = done.estimates[name][shown]
    return Curve(
        label=label,
        role=role,
        x=np.append(done.estimate_times[shown], _TIME),
        y=np.append(values, values[-1]),
        staircase=True,
    )


def _range(values: list[Float[np.ndarray, " _"]], truth: float) -> tuple[float, float]:
    every = np.append(np.concatenate(values), truth)
    low, high = float(np.min(every)), float(np.max(every))
    margin = _MARGIN * (high - low)
    return low - margin, high + margin
