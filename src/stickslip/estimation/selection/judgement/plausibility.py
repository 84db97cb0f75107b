"""Plausibility of a log: its units, sampling and signs, and the values that are given with it.

Each check returns a sentence with cause, size and remedy, or an empty text.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.model import DELAY_TERM, Model, testable
from stickslip.estimation.selection.model_rows import ModelRows, model_rows
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.significance import significant_value
from stickslip.estimation.selection.terms import MODEL_SCALE
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.records import AxisKind, AxisLog, FrictionEstimate, count_of, quantity_name


@dataclass(frozen=True, kw_only=True)
class PlausibilityTuning:
    """Bounds beyond which a log is not what it is declared to be."""

    largest_speed: float = 10.0
    """Speed of a linear axis [m/s]: the fastest linear motors reach it."""
    largest_travel: float = 30.0
    """Range of positions of a linear axis [m]: gantries reach it."""
    declared_ratio: float = 5.0
    """Ratio by which speed and travel may be larger in a file that states the unit of the position
    [-]: sledges and trains. Stages read in the wrong unit are 1000 times as fast."""
    largest_rotary_speed: float = 2500.0
    """Speed of a rotary axis [rad/s], 24 000 rpm: spindles reach it, positioning axes do not."""
    shortest_move: float = 30.0
    """Samples that half of the time in motion must have in a move [-]: its ramps have a quarter of
    them, which the narrowest window (7 samples) needs. At 20 samples, inertias are up to 35 % off;
    at 40 samples, within 3 %."""
    fastest_sampling: float = 2e-3  #: Sampling time [s] below which short moves are noise.
    largest_inertia_error: float = 0.02
    """Relative error of a given inertia beyond which it is reported [-]: data sheets are as
    exact."""
    largest_delay_error: float = 1.0
    """Error of a given delay of the effort beyond which it is reported [samples]."""
    largest_p_value: float = 1e-3  #: p-value below which such an error is significant [-].
    slowest_sampling: float = 0.2
    """Sampling time from which moves of a positioning axis fit between two samples [s]."""
    least_deviations: float = 5.0
    """Standard deviations by which an inertia must be below zero to count as negative [-]."""
    largest_model_error: float = 0.3
    """Relative error of the effort of a model [-] beyond which it is that of another machine, if
    the error is also `largest_residual` of the other effort: masses are known to 10 %."""
    largest_residual: float = 0.25
    """Share of the effort that no term and no noise explains [-], beyond which the model does not
    describe the axis."""
    fewest_levels: int = 10
    """Distinct efforts [-]: fewer may be exact ones, between which a drive switches. Fewer than 10
    rounded ones have steps that are coarse beside friction."""
    least_rounding: float = 0.2
    """Residual of few efforts over their rounding error [-], from which they are rounded: most
    models leave half of it for rounded efforts, and much less for exact ones."""
    most_levels: int = 2000
    """Distinct efforts [-] above which their steps are small."""
    largest_step: float = 0.15
    """Step of the effort over Coulomb friction [-], above which rounding may change the sign of
    viscous friction."""
    least_rise: float = 0.5  #: The same over the largest viscous friction [-].
    dithered: float = 0.5
    """Noise of the effort over its step [-], above which rounding errors are noise."""
    unsigned_level: float = 0.05
    """Share of the largest effort [-] below which an effort counts as zero."""
    unsigned_share: float = 0.001
    """Share of such samples [-] from which the effort reaches zero by more than chance."""
    largest_jitter: float = 0.15
    """Jitter of the time stamps [-] from which their errors may leave the effort unexplained: a bus
    or an operating system delays them by less."""


ROUNDING = float(np.sqrt(12.0))  #: Step over the standard deviation of its rounding error [-].
_LATTICE = 1e-5  # relative error to which readings of an encoder are multiples of its step [-]
_FEWEST_BITS = 9  # of an encoder in a turn, the coarsest that is considered
_MOST_BITS = 32  # of an encoder in a turn, the finest that is considered
_TURN = 0.02  # relative error up to which a period is that of an angle in a unit [-]
_TURN_OR_DEGREES = 10.0  # units: an angle that wraps below is in turns, above in degrees


def implausible_time(log: PreparedLog, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the time cannot be in seconds; empty if it can."""
    T = log.sampling_time
    if tuning.slowest_sampling <= T:
        return (
            f"one sample every {T:.4g} s for {len(log.log) * T:.4g} s: is the time in ms? convert "
            "it, for instance --time '1e-3 * COLUMN'; otherwise record faster"
        )
    return ""


def implausible_units(log: PreparedLog, motions: SlipMotions, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the position cannot be in its declared unit; empty if it can.

    A linear axis that seems to move at 100 m/s is logged in mm. An encoder with exactly 2^n steps
    in 360 units counts degrees.
    """
    speed = motions.top_speed
    moving = motions.moving(lambda m: m.position)
    if moving.size == 0:
        return ""
    travel = float(np.ptp(moving))
    if log.log.kind == "linear":
        ratio = tuning.declared_ratio if _states_unit(log.log) else 1.0
        if speed > ratio * tuning.largest_speed or travel > ratio * tuning.largest_travel:
            return (
                f"travel of {travel:.3g} m at up to {speed:.3g} m/s: is the position in mm? "
                "if so, state --unit position=mm"
            )
        return ""
    if log.wrap_period > 0 and abs(log.wrap_period / (2.0 * np.pi) - 1.0) > _TURN:
        degrees = log.wrap_period > _TURN_OR_DEGREES
        return (
            f"the position wraps every {log.wrap_period:.4g} units: is it in "
            f"{'degrees' if degrees else 'turns'}? if so, state --unit "
            f"position={'deg' if degrees else 'rev'}"
        )
    if speed > tuning.largest_rotary_speed or _counts_degrees(log):
        return (
            f"travel of {travel:.3g} rad at up to {speed:.3g} rad/s"
            f"{', read from an encoder that divides 360 units' if _counts_degrees(log) else ''}: "
            "is the position in degrees? if so, state --unit position=deg"
        )
    return ""


def _states_unit(log: AxisLog) -> bool:
    """Return whether the file or its schema states the unit of the position."""
    return log.source is not None and "position" not in dict(log.source.assumed_units)


def ripple_of_degrees(model: Model, kind: AxisKind) -> str:
    """Return a sentence if a ripple of a rotary axis repeats every 360 units; empty otherwise.

    A force that repeats with the turn repeats every 2 pi rad, and every 360 of an angle in degrees.
    """
    periods = [shape.value for term, shape in model.chosen if term.name == "ripple"]
    if kind == "linear" or not any(abs(period / 360.0 - 1.0) < _TURN for period in periods):
        return ""
    return (
        f"a force repeats every {periods[0]:.5g} units of the position: is it in degrees? if so, "
        "state --unit position=deg"
    )


def wrong_delay(
    model: Model, given: float | None, estimated: Callable[[], float], tuning: PlausibilityTuning
) -> str:
    """Return a sentence if a given delay of the effort disagrees with the log; empty otherwise.

    ``given`` is the stated time by which the effort acts later than it is logged [s];
    ``estimated`` returns that which the log shows [s] and is called only for the sentence.
    """
    if given is None or not testable(model):
        return ""
    basis = model.basis()
    partial = basis.partial(model.term_columns(DELAY_TERM, DELAY_TERM.shapes[0]))
    error = significant_value(basis, partial, tuning.largest_p_value)
    if error is None or abs(error) < tuning.largest_delay_error:
        return ""
    return (
        f"the given effort delay of {1e3 * given:.4g} ms disagrees with the log, which shows about "
        f"{1e3 * estimated():.3g} ms; check it, or leave it out to have it estimated"
    )


def _counts_degrees(log: PreparedLog) -> bool:
    """Return whether the readings divide 360 units, and not 2 pi, into a usual number of counts.

    Readings rounded to decimals divide 360 too; their step is a power of ten, or 2 or 5 times one.
    """
    values = np.unique(log.log.measured_position)
    steps = np.diff(values)
    steps = steps[steps > 1e-12 * max(float(np.ptp(values)), 1.0)]
    if steps.size < 10:
        return False
    step = _common_step(steps)
    if step == 0 or _is_count(2.0 * np.pi / step):
        return False
    leading = step / 10.0 ** np.floor(np.log10(step * (1.0 + _LATTICE)))
    decimal = bool(np.any(np.abs(leading / np.array([1.0, 2.0, 5.0]) - 1.0) < _LATTICE))
    return _is_count(360.0 / step) and not decimal


def _common_step(steps: Float[np.ndarray, " n"]) -> float:
    """Return the step that all differences of readings are multiples of; 0 if there is none."""
    step = float(np.min(steps))
    near = steps < 1e3 * step  # over more steps, its rounding error reaches a count
    counts = np.rint(steps[near] / step)
    step = float(np.sum(steps[near]) / np.sum(counts))
    off = np.abs(steps[near] / step - counts)
    return step if float(np.max(off)) < 0.02 else 0.0


def _is_count(counts: float) -> bool:
    """Return whether an encoder has so many counts a turn: a power of two, or a round number."""
    if not 2.0**_FEWEST_BITS <= counts <= 2.0**_MOST_BITS:
        return False
    power = 2.0 ** round(float(np.log2(counts)))
    hundreds = 100.0 * round(counts / 100.0)
    near_hundreds = abs(counts - hundreds) < 0.01 * min(1.0, 1e6 / counts)
    return abs(counts / power - 1.0) < _LATTICE or (counts < 1e6 and near_hundreds)


def too_slow_sampling(log: PreparedLog, motions: SlipMotions, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the samples are too far apart for the moves; empty otherwise."""
    lengths: list[int] = []
    for motion in motions.stretches:
        edges = np.flatnonzero(np.diff(np.concatenate(([0], motion.direction, [0]))))
        lengths += [
            stop - start for start, stop in pairwise(edges.tolist()) if motion.direction[start] != 0
        ]
    if not lengths:
        return ""
    # Moves of a sample or two are noise; the time in motion is in the others
    every = np.sort(lengths)
    typical = float(every[np.searchsorted(np.cumsum(every), 0.5 * np.sum(every))])
    T = log.sampling_time
    if typical >= tuning.shortest_move or tuning.fastest_sampling > T:
        return ""
    return f"{1.0 / T:.4g} Hz sampling is too slow for moves of {typical * T:.2g} s; record faster"


def unsettled_delay(model: Model, tuning: SearchTuning) -> str:
    """Return a sentence if the delay of the effort was not found within its bounds; else empty."""
    if model.settled:
        return ""
    return (
        f"the effort acts more than {1e3 * tuning.largest_delay:.3g} ms before or after its time "
        "stamp, or its delay cannot be found; align the columns, or give the delay"
    )


def untested(model: Model) -> str:
    """Return a sentence if no term could be tested; empty if some could."""
    if model.scores or model.rows.size == 0 or testable(model):
        return ""
    return (
        f"{count_of(model.rows.size, 'window')} of slip in one direction, too few to test whether "
        "the model lacks terms; record more or longer moves"
    )


def unexplained_effort(
    log: AxisLog,
    motions: SlipMotions,
    model: Model,
    rows: ModelRows,
    tuning: PlausibilityTuning,
) -> str:
    """Return a sentence if much of the effort is explained by no term and no noise; else empty."""
    if model.rows.size <= rows.columns.shape[1]:
        return ""
    weight = model.rows.weight
    values = rows.values()
    residual = float(np.mean((rows.target - rows.columns @ values) ** 2))
    inertia = abs(float(values[0])) if model.inertia is None else model.inertia
    position = inertia * motions.noise_of(weight.second())
    effort = noise_level(np.concatenate([m.effort for m in motions.stretches]))
    effort *= float(np.linalg.norm(weight.effort(0.0)))
    left = max(residual - position**2 - effort**2, 0.0)
    share = float(np.sqrt(left / max(float(np.mean(model.rows.own_effort**2)), _TINY)))
    if share < tuning.largest_residual:
        return ""
    text = _UNEXPLAINED if log.timing_jitter < tuning.largest_jitter else _UNEXPLAINED_BY_TIME
    return text.format(100 * share)


def effort_step(motions: SlipMotions, tuning: PlausibilityTuning) -> float:
    """Return the step of the recorded effort [N or N m]; 0 if its rounding errors are noise.

    Rounding errors of an effort that is quieter than its steps depend on the motion, and repeat
    with it: a term that explains less may describe them. The step is 0 for few distinct efforts
    too, which may be the exact ones of a drive, and for very many.
    """
    levels, step = _effort_levels(motions, tuning)
    return step if levels >= tuning.fewest_levels else 0.0


def _effort_levels(motions: SlipMotions, tuning: PlausibilityTuning) -> tuple[int, float]:
    """Return the number of distinct efforts and their step [N or N m].

    The step is 0 if noise fills it, or if there are too many efforts.
    """
    levels = np.unique(np.concatenate([m.effort[m.usable] for m in motions.stretches]))
    if not 1 < levels.size <= tuning.most_levels:
        return levels.size, 0.0
    step = _common_step(np.diff(levels))
    noise = noise_level(np.concatenate([m.effort for m in motions.stretches]))
    return levels.size, 0.0 if noise > tuning.dithered * step else step


def coarse_effort(model: Model, motions: SlipMotions, unit: str, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the steps of the effort are coarse beside friction; empty otherwise.

    Rounding errors of an effort that changes little in a move are no noise: they bias friction.
    Few efforts are exact if the model leaves only a small part of the rounding error of their step.
    """
    levels, step = _effort_levels(motions, tuning)
    if not testable(model):
        return ""
    coulomb, viscous = np.abs(model.friction())
    rise = viscous * motions.top_speed  # over several steps, rounding averages out
    if step <= max(tuning.largest_step * coulomb, tuning.least_rise * rise):
        return ""
    left = model.residual_share() * float(np.sqrt(np.mean(model.rows.effort**2)))
    if levels < tuning.fewest_levels and left < tuning.least_rounding * step / ROUNDING:
        return ""
    return (
        f"the effort is recorded in steps of {step:.3g} {unit}, {100 * step / coulomb:.0f} % of "
        "the Coulomb friction, whose rounding is no noise; record it with more digits or bits"
    )


def unsigned_effort(log: AxisLog, motions: SlipMotions, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the effort may lack its sign; empty if it has both signs, or no zeros.

    The check is for an effort that no model explains.
    """
    size = np.abs(log.effort)
    near = float(np.mean(size < tuning.unsigned_level * np.max(size)))
    direction = motions.moving(lambda m: m.direction)
    one_way = not np.any(direction > 0) or not np.any(direction < 0)
    if one_way or np.min(log.effort) < 0.0 < np.max(log.effort) or near < tuning.unsigned_share:
        return ""
    return (
        "the effort goes to zero and never changes its sign in moves both ways: it may be the "
        "size of a force or current; log it with its sign"
    )


def wrong_model(model: Model, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the effort of a model of the machine is far off; empty otherwise."""
    if MODEL_SCALE not in model.names:
        return ""
    error = float(model.coefficients(MODEL_SCALE)[0])
    wrong = abs(error) * float(np.linalg.norm(model.rows.model_effort))
    least = tuning.largest_residual * float(np.linalg.norm(model.rows.own_effort))
    if abs(error) <= tuning.largest_model_error or wrong <= least:
        return ""
    return (
        f"gravity and the other joints act with {1.0 + error:.3g} times the effort that the model "
        "of the robot states; check its masses, the unit of the effort, the gear ratio, and zero "
        "and sign of every joint"
    )


def unexplained(log: AxisLog, share: float) -> list[str]:
    """Return a sentence if an estimate leaves too much of the effort of a log unexplained.

    ``share`` is the norm of the residual over that of the effort [-]. The white noise of the
    effort, which filters reduce, is subtracted. The list is empty otherwise.
    """
    size = max(float(np.sqrt(np.mean(log.effort**2))), _TINY)
    left = float(np.sqrt(max(share**2 - (noise_level(log.effort) / size) ** 2, 0.0)))
    large = left >= PlausibilityTuning.largest_residual
    return [_UNEXPLAINED.format(100 * left)] if large else []


_UNEXPLAINED_BY_TIME = (
    "{:.0f} % of the effort is explained by no term and no noise, and the time stamps are uneven "
    "or coarse; record finer ones, or give the sampling time if the samples are evenly spaced "
    "(--sampling-time)"
)
_UNEXPLAINED = (
    "{:.0f} % of the effort is explained by no term and no noise; check the columns and their "
    "units, and whether another axis, a load or a stop acts on this one"
)


_TINY = np.finfo(float).tiny


def within_presliding(
    model: Model, estimate: FrictionEstimate, include: Sequence[str], motions: SlipMotions
) -> str:
    """Return a sentence if the motion may stay within presliding; empty if it does not.

    Friction acts like a spring there: the log shows a spring and no Coulomb friction, or friction
    that still builds up at the ends of the travel. A spring in ``include`` belongs to the axis.
    """
    travel = float(np.ptp(motions.moving(lambda m: m.position))) if model.chosen else 0.0
    unit = "m" if estimate.kind == "linear" else "rad"
    coulomb = [
        parameter.ci95
        for name, parameter in estimate.parameters.items()
        if quantity_name(name) == "coulomb_friction"
    ]
    no_coulomb = any(interval is None or interval[0] <= 0.0 for interval in coulomb)
    if "spring" in model.names and "spring" not in include and no_coulomb:
        stiffness = abs(float(model.coefficients("spring")[0]))
        if all(c is None or 0.5 * stiffness * travel > c[1] for c in coulomb):
            return (
                "the effort follows the position like a spring, and the log shows no Coulomb "
                f"friction: its travel of {travel:.3g} {unit} may stay within presliding, where "
                "friction acts like a spring; record longer moves, or include the spring if the "
                "axis has one (--include spring)"
            )
    incomplete = [
        shape.value >= _LONGEST_SHAPE * term.shapes[-1].value
        for term, shape in model.chosen
        if term.name == "presliding" and term.name not in include
    ]
    if any(incomplete):
        return (
            f"friction builds up along the whole travel of {travel:.3g} {unit}, so that the log "
            "does not show its final value; record longer moves"
        )
    return ""


_LONGEST_SHAPE = 0.95  # of the longest distance in the search [-], from which it is at that bound


def wrong_inertia(model: Model, kind: str, unit: str, tuning: PlausibilityTuning) -> str:
    """Return a sentence if a known inertia disagrees with the log; empty otherwise."""
    if model.inertia is None or not testable(model):
        return ""
    basis = model.basis()
    partial = basis.partial(model.scaled(model.rows.acceleration[:, None]))
    error = significant_value(basis, partial, tuning.largest_p_value)
    if error is None:
        return ""
    if model.inertia + error <= 0.0:
        return (
            f"with the given {kind} of {model.inertia:.4g} {unit} the log shows a negative one: "
            "the sign of the effort or of the position is reversed"
        )
    if abs(error) < tuning.largest_inertia_error * model.inertia:
        return ""
    return (
        f"the given {kind} of {model.inertia:.4g} {unit} disagrees with the log, which shows "
        f"{model.inertia + error:.4g} {unit}; check it, or leave it out to have it estimated"
    )


def reversed_sign(model: Model, kind: str, tuning: PlausibilityTuning) -> str:
    """Return a sentence if the log shows a negative inertia; empty otherwise."""
    if model.inertia is not None or not testable(model):
        return ""
    values, stds = model_rows(model, kind).fitted()
    if float(values[0]) >= -tuning.least_deviations * float(stds[0]):
        return ""
    return f"the log shows a negative {kind}: the sign of the effort or of the position is reversed"
