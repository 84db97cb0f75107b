"""Figures of the conjunction, from landings and from series by themselves."""

import numpy as np

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.conjunction.landings import Landing, LandingEvidence
from studies.van_de_wijdeven.conjunction.random_arms import SAMPLING_TIME
from studies.van_de_wijdeven.conjunction.series import SeriesEvidence
from studies.van_de_wijdeven.conjunction.setting import MOVE, TARGETS, TIME
from studies.van_de_wijdeven.records import Curve, CurveRole, Panel, ReproducedFigure

_TIME = "time [s]"
_SHOWN = 5  # samples from a drawn one to the next
_SIGMAS = 2.0
_ORDER = ("feedback", "resting", "series", "done", "stopped")
_ROLES: tuple[CurveRole, ...] = ("first", "second", "third", "fourth")
_ZOOM = 0.02  # of an estimate around the truth, as a share of it
_AFTER = 2.0  # of a series, drawn [s]
_FLOOR = -10.0  # of what is drawn as a power of ten


def conjunction_figures(
    landings: LandingEvidence, series: SeriesEvidence
) -> tuple[ReproducedFigure, ...]:
    """Return the five figures."""
    return (
        _landing(landings.noisy),
        _flights(landings.noisy),
        _reference(series),
        _effects(series),
        _successive(series),
    )


def _landing(landing: Landing) -> ReproducedFigure:
    motion, states = landing.motion, landing.states
    time = motion.time[::_SHOWN]
    ends = np.array([0.0, TIME, 2.0 * TIME])
    # The phase that holds from each of its begins until the next
    starts = np.array([each.start for each in landing.phases] + [ends[-1]])
    number = np.array([float(_ORDER.index(each.name)) for each in landing.phases])
    effort = np.append(motion.commanded_effort, 0.0)
    return ReproducedFigure(
        number="C.1",
        title="Two landings of the arm",
        caption="The surrogate arm, initial friction estimate zero, with noise of "
        f"{landing.case.position_noise:g} m and {landing.case.velocity_noise:g} m/s. While "
        "resting, the swing of mass 2 is fitted. Below, the estimates within a band of "
        f"{_SIGMAS:g} standard deviations, drawn over ±{100 * _ZOOM:g} % of the truth.",
        columns=1,
        panels=(
            Panel(
                title="positions",
                x_label=_TIME,
                y_label="position [m]",
                curves=(
                    Curve(label="mass 1", role="first", x=time, y=states[::_SHOWN, 0]),
                    Curve(label="mass 2", role="second", x=time, y=states[::_SHOWN, 2]),
                    Curve(
                        label="target",
                        role="truth",
                        x=ends,
                        y=np.array([*TARGETS, TARGETS[-1]]),
                        staircase=True,
                    ),
                ),
            ),
            Panel(
                title="input",
                x_label=_TIME,
                y_label="u [N]",
                curves=(
                    Curve(label="input", role="first", x=time, y=effort[::_SHOWN], staircase=True),
                ),
            ),
            Panel(
                title="phase",
                x_label=_TIME,
                y_label="phase",
                y_range=(-0.3, 3.3),
                y_ticks=_ORDER[:4],
                curves=(
                    Curve(
                        label="phase",
                        role="first",
                        x=starts,
                        y=np.append(number, number[-1]),
                        staircase=True,
                    ),
                ),
            ),
            _estimate(landing, 0, "Coulomb friction", "f̂_c [N]", surrogate.COULOMB_FRICTION),
            _estimate(landing, 1, "viscous friction", "ĉ [N s/m]", surrogate.VISCOUS_FRICTION),
        ),
    )


def _estimate(landing: Landing, which: int, title: str, label: str, truth: float) -> Panel:
    rows = np.array([(each[0], each[1 + which], each[3 + which]) for each in landing.estimates])
    time, value, std = rows[np.isfinite(rows[:, 2])].T
    low, high = value - _SIGMAS * std, value + _SIGMAS * std
    return Panel(
        title=title,
        x_label=_TIME,
        y_label=label,
        y_range=(truth * (1.0 - _ZOOM), truth * (1.0 + _ZOOM)),
        curves=(
            Curve(label="estimate", role="first", x=time, y=value),
            Curve(
                label=f"{_SIGMAS:g} standard deviations",
                role="third",
                x=np.concatenate((time, time[::-1])),
                y=np.concatenate((high, low[::-1])),
            ),
            Curve(
                label="truth",
                role="truth",
                x=np.array([0.0, 2.0 * TIME]),
                y=np.array([truth, truth]),
            ),
        ),
    )


def _flights(landing: Landing) -> ReproducedFigure:
    states, panels = landing.states, list[Panel]()
    for number, flight in enumerate(landing.flights):
        series = flight.planned
        begin = round(flight.start / SAMPLING_TIME)
        there = slice(begin, begin + series.effort.size + round(_AFTER / SAMPLING_TIME) + 1)
        time = landing.motion.time[there]
        planned = flight.start + series.time
        panels.append(
            Panel(
                title=f"series {number + 1}, to {series.target:.3f} m",
                x_label=_TIME,
                y_label="position [m]",
                curves=(
                    Curve(label="x_1 planned", role="first", x=planned, y=series.position),
                    Curve(label="x_1 achieved", role="second", x=time, y=states[there, 0]),
                    Curve(label="x_2 planned", role="third", x=planned, y=series.load_position),
                    Curve(label="x_2 achieved", role="fourth", x=time, y=states[there, 2]),
                ),
            )
        )
    return ReproducedFigure(
        number="C.2",
        title="Planned and achieved series",
        caption="The same landings; the differences are smaller than the line width. Where the "
        "swing of mass 2 exceeds the remaining distance, a first series ends beyond it, and a "
        "second one returns.",
        columns=2,
        panels=tuple(panels),
    )


def _reference(series: SeriesEvidence) -> ReproducedFigure:
    efforts: list[Panel] = []
    motions: list[Panel] = []
    for each in series.planned:
        planned, numbers = each.series, each.numbers
        shown = each.motion.time <= numbers.duration + _AFTER
        time = each.motion.time[shown]
        load = each.motion.load_position
        efforts.append(
            Panel(
                title=f"{numbers.pulses} pulses of {numbers.pulse_width:g} s: "
                f"{numbers.duration:.3g} s",
                x_label=_TIME,
                y_label="u [N]",
                y_range=(-1.1, 1.1),
                curves=(
                    Curve(
                        label="input",
                        role="first",
                        x=np.append(planned.time, time[-1]),
                        y=np.append(planned.effort, (0.0, 0.0)),
                        staircase=True,
                    ),
                ),
            )
        )
        motions.append(
            Panel(
                title=f"{numbers.pulses} pulses: motion",
                x_label=_TIME,
                y_label="position [m]",
                curves=(
                    Curve(label="mass 1", role="first", x=time, y=each.motion.position[shown]),
                    *(
                        ()
                        if load is None
                        else (Curve(label="mass 2", role="second", x=time, y=load[shown]),)
                    ),
                    Curve(label="target", role="truth", x=time[[0, -1]], y=np.array([MOVE, MOVE])),
                ),
            )
        )
    return ReproducedFigure(
        number="C.3",
        title="Shortest series from rest to rest",
        caption="At full rate, and with wider and fewer pulses: m_1 = m_2 = k_s = 1, f_c = c = "
        "0.1, at most 1 N, 1 m, T = 0.05 s. Mass 1 never turns back. Of all series of this "
        "duration these have about the least impulse.",
        columns=2,
        panels=tuple(panel for pair in zip(efforts, motions, strict=True) for panel in pair),
    )


def _effects(series: SeriesEvidence) -> ReproducedFigure:
    every = series.effects
    x = np.array([100.0 * each.friction_error for each in every])

    def panel(title: str, ours: list[float], known: list[float]) -> Panel:
        return Panel(
            title=title,
            x_label="error of f_c [%]",
            y_label="final error [% of the move]",
            curves=(
                Curve(label="this series", role="first", x=x, y=100.0 * np.array(ours) / MOVE),
                Curve(
                    label="another one of 4.6 s",
                    role="second",
                    x=x,
                    y=100.0 * np.array(known) / MOVE,
                ),
            ),
        )

    return ReproducedFigure(
        number="C.4",
        title="Final error against the error of the assumed Coulomb friction",
        caption="The series at full rate of Figure C.3, on an arm whose Coulomb friction is less "
        "(left) or more (right) than assumed. With less, mass 1 sticks nowhere on the way, and "
        "what is left depends on the duration alone; with more, it sticks where the series "
        "would let it creep, and series of one duration differ.",
        columns=2,
        panels=(
            panel(
                "mass 1",
                [each.error for each in every],
                [each.expected_error for each in every],
            ),
            panel(
                "swing of mass 2",
                [each.swing for each in every],
                [each.expected_swing for each in every],
            ),
        ),
    )


def _successive(series: SeriesEvidence) -> ReproducedFigure:
    panels: list[Panel] = []
    for learning in (False, True):
        curves: list[Curve] = []
        there = [each for each in series.successive if each.learning is learning]
        for role, each in zip(_ROLES, there, strict=True):
            left = np.maximum(np.abs(each.error), each.swing) / MOVE
            curves.append(
                Curve(
                    label=f"{100 * each.friction_error:+g} %".replace("-", "−"),
                    role=role,
                    x=np.arange(left.size + 1.0),
                    y=np.append(0.0, np.log10(np.maximum(left, 10.0**_FLOOR))),
                )
            )
        panels.append(
            Panel(
                title="estimates updated" if learning else "estimates constant",
                x_label="number of series",
                y_label="log10(final error / move)",
                y_range=(_FLOOR, 0.0),
                curves=tuple(curves),
            )
        )
    return ReproducedFigure(
        number="C.5",
        title="Successive series with a wrong initial Coulomb friction",
        caption="The larger of the error of mass 1 and the swing of mass 2, as a power of ten of "
        "the move, by the error of the initial Coulomb friction. Left, the estimate is constant: "
        "one that is too large gives the same error after every series. Right, the estimator "
        "updates it.",
        columns=2,
        panels=tuple(panels),
    )
