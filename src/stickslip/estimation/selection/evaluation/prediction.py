"""The effort that an estimate predicts for a log, sample by sample."""

from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float

from stickslip.estimation.prepare import PreparedLog, prepare
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.search.windows import half_width
from stickslip.estimation.weak_form.motion import (
    MotionTuning,
    SlipMotion,
    SlipMotions,
    slip_motions,
)
from stickslip.estimation.weak_form.windows import Weight, convolved, whole_windows
from stickslip.friction.estimated_law import law_effort
from stickslip.records import AxisLog, EffortKind, FrictionEstimate, InputError, ModelSelection


def predict_effort(
    estimate: FrictionEstimate,
    log: AxisLog,
    *,
    inertia: float | None = None,
    window: float | None = None,
) -> Float[np.ndarray, " n"]:
    """Return the effort that an estimate predicts from the motion of a log.

    The inverse dynamics ``u = m a + c v + f_c sign(v) + f_0 + ...`` with all terms that the
    estimate has, at the middle of the time for which each effort acts: the delay of the effort and
    its kind (held, sampled or a mean) are in it. A ripple and a spring belong to positions, which
    the log must count from the same origin. A drift belongs to the clock of the log that it was
    estimated from; it is extrapolated.

    Parameters
    ----------
    estimate
        Of any estimator, of a rigid axis, with all parameters identified.
    log
        Of the same axis. Its effort is not used.
    inertia
        Moving mass or inertia, where the estimate does not hold it [kg or kg m^2].
    window
        Half of the width of the windows over which the acceleration is smoothed [s], at least 3
        samples; None for the width that `SelectedModelEstimator` fits the log over. A narrower one
        follows faster efforts and passes more noise of the position.

    Returns
    -------
    Effort at each sample of the log, shape (n,) [N or N m, or the unit of the effort that the
    estimate was fitted to]. NaN where the axis may be at rest (below 2 % of its largest speed or
    within the noise of the speed), as friction there is whatever balances the effort, and within a
    window of the ends of the log and of gaps.

    Raises
    ------
    InputError
        If a parameter is not identified, there is no inertia, the estimate is of a flexible arm or
        of another kind of axis, or nothing moves in the log.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip import identify
    >>> from stickslip.records import AxisLog
    >>> time = np.arange(0, 10, 0.001)
    >>> velocity = 0.1 * np.sin(2 * time) + 0.05 * np.sin(5 * time)
    >>> acceleration = 0.2 * np.cos(2 * time) + 0.25 * np.cos(5 * time)
    >>> position = -0.05 * np.cos(2 * time) - 0.01 * np.cos(5 * time)
    >>> effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity
    >>> log = AxisLog(name="stage", kind="linear", time=time, effort=effort,
    ...               measured_position=position)
    >>> predicted = predict_effort(identify(log.part(0, 5000)).estimate, log)
    >>> bool(np.nanmax(np.abs(predicted - effort)) < 0.02)
    True
    """
    values = _values(estimate, log, inertia)
    prepared = _moving(log)
    T = prepared.sampling_time
    motions, weight = _windows(prepared, window)
    selection = estimate.selection or _NOTHING_SELECTED
    at = selection.effort_delay + _middles(log.time, T, selection.effort_kind)
    predicted = np.full(len(log), np.nan)
    for motion in motions.stretches:
        effort = _effort(values, selection, motion, weight)
        inside = (at >= motion.time[0]) & (at <= motion.time[-1])
        predicted[inside] = np.interp(at[inside], motion.time, effort)
    return _logged(values, selection, log.time, predicted)


def prediction_error(
    estimate: FrictionEstimate, log: AxisLog, *, inertia: float | None = None
) -> float | None:
    """Return the share of the effort that the prediction does not explain, in slip [-].

    Norm of the error over norm of the effort, both means over windows as wide as those that
    `SelectedModelEstimator` fits the log over, without clipped and repaired samples. None if no
    window is whole.

    Arguments and errors are those of `predict_effort`.
    """
    values = _values(estimate, log, inertia)
    selection = estimate.selection or _NOTHING_SELECTED
    prepared = _moving(log, selection.effort_kind)
    motions, weight = _windows(prepared, None)
    taps = weight.mean()
    delay = selection.effort_delay + (0.5 - prepared.effort_lead) * prepared.sampling_time
    left = size = 0.0
    for motion in motions.stretches:
        effort = _effort(values, selection, motion, weight)
        effort = np.interp(motion.time + delay, motion.time, effort, left=np.nan, right=np.nan)
        effort = _logged(values, selection, motion.time, effort)
        known = np.isfinite(effort)
        error = motion.effort - np.where(known, effort, motion.effort)
        whole = whole_windows(motion.direction, motion.usable & known, weight.half_width)
        left += float(np.sum(convolved(error, taps)[whole] ** 2))
        size += float(np.sum(convolved(motion.effort, taps)[whole] ** 2))
    return float(np.sqrt(left / size)) if size > 0.0 else None


def effort_at_rest(
    estimate: FrictionEstimate, time: float, position: float, direction: float
) -> float:
    """Return the effort at which the model starts to move from rest [N or N m].

    The axis is rigid, and all parameters that act at rest are identified; ``direction`` is 1 or -1.
    """
    values = {name: p.value for name, p in estimate.parameters.items() if p.value is not None}
    motion = SlipMotion(
        time=np.array([time]),
        effort=np.zeros(1),
        position=np.array([position]),
        velocity=np.zeros(1),
        direction=np.array([int(direction)]),
        travelled=np.zeros(1),
        model_effort=np.zeros(1),
        usable=np.ones(1, dtype=bool),
    )
    selection = estimate.selection or _NOTHING_SELECTED
    effort = law_effort(values, motion.velocity, motion.direction.astype(float))
    effort += _further_effort(values, selection, motion)
    return float(_logged(values, selection, motion.time, effort)[0])


_NOTHING_SELECTED = ModelSelection(summary="", scores=())


def _moving(log: AxisLog, effort_kind: EffortKind = "held") -> PreparedLog:
    """Return a log as prepared, if anything moves in it."""
    if np.ptp(log.measured_position) == 0:
        raise InputError("position_constant", where=log.name)
    return prepare(log, effort_kind=effort_kind).with_parts()


def _windows(prepared: PreparedLog, window: float | None) -> tuple[SlipMotions, Weight]:
    """Return the motion, and the windows of its acceleration."""
    T = prepared.sampling_time
    motions, tuning = slip_motions(prepared, MotionTuning()), SearchTuning()
    half = half_width(motions, T, tuning) if window is None else round(window / T)
    half = max(half, tuning.fewest_samples)
    return motions, Weight(half_width=half, sampling_time=T, margin=0)


def _effort(
    values: Mapping[str, float], selection: ModelSelection, motion: SlipMotion, weight: Weight
) -> Float[np.ndarray, " n"]:
    """Return the effort that acts at each sample of a motion [N or N m]; NaN at rest."""
    effort = values["inertia"] * _derivative(motion, weight, weight.second())
    if "elasticity" in values:
        effort += values["elasticity"] * _derivative(motion, weight, weight.fourth())
    effort += law_effort(values, motion.velocity, np.sign(motion.velocity))
    effort += _further_effort(values, selection, motion)
    effort[motion.direction == 0] = np.nan
    return effort


def _logged(
    values: Mapping[str, float],
    selection: ModelSelection,
    time: Float[np.ndarray, " n"],
    effort: Float[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Return the logged effort for an effort that acts on the axis, both [N or N m].

    A dead band takes a part of the logged effort, and the gain drifts.
    """
    gain = 1.0 + values.get("gain_drift", 0.0) * (time - selection.reference_time)
    return (effort + values.get("dead_band", 0.0) * np.sign(effort)) / gain


def _middles(
    time: Float[np.ndarray, " n"], sampling_time: float, kind: EffortKind
) -> Float[np.ndarray, " n"]:
    """Return the middle of the time for which each effort acts, without a delay [s]."""
    steps = np.diff(time)
    steps[steps > _GAP * sampling_time] = sampling_time
    if kind == "held":
        return time + 0.5 * np.append(steps, sampling_time)
    if kind == "mean":
        return time - 0.5 * np.append(sampling_time, steps)
    return time


_GAP = 3.0  # sampling times [-], beyond which a step of time is a gap and no effort is held


_SHAPES = ("ripple_period", "presliding_distance", "effort_delay")  # also in the selection


def _values(estimate: FrictionEstimate, log: AxisLog, inertia: float | None) -> dict[str, float]:
    """Return all parameters, the moving mass or inertia as ``"inertia"`` [SI]."""
    if estimate.kind != log.kind:
        raise InputError("log_of_other_kind", where=log.name, own=estimate.kind, kind=log.kind)
    if {"load_mass", "load_inertia", "stiffness"} & estimate.parameters.keys():
        raise InputError("prediction_of_arm")
    if estimate.joint is not None:
        raise InputError("prediction_of_joint_fit", log=estimate.joint.logs[0].name)
    held = [name for name, p in estimate.parameters.items() if p.identified or name not in _SHAPES]
    values = {name: estimate.value(name) for name in held}
    own = values.get("mass", values.get("inertia", inertia))
    if own is None:
        raise InputError("estimate_without_inertia")
    return {**values, "inertia": own}


def _derivative(
    motion: SlipMotion, weight: Weight, taps: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " n"]:
    """Return a derivative; NaN where the window reaches beyond the ends of the stretch."""
    derivative = np.full(motion.position.size, np.nan)
    whole = slice(weight.reach, motion.position.size - weight.reach)
    derivative[whole] = convolved(motion.position - motion.position[0], taps)[whole]
    return derivative


def _further_effort(
    values: Mapping[str, float], selection: ModelSelection, motion: SlipMotion
) -> Float[np.ndarray, " n"]:
    """Return the effort of the terms of position, distance and time [N or N m]."""
    shapes = {score.term: score.shape for score in selection.scores if score.selected}
    coulomb, viscous = _symmetric(values, "coulomb"), _symmetric(values, "viscous")
    place = motion.position - selection.reference_position
    elapsed = motion.time - selection.reference_time
    wave = 2.0 * np.pi / values.get("ripple_period", shapes.get("ripple", np.inf)) * place
    distance = values.get("presliding_distance", shapes.get("presliding", np.inf))
    reached = motion.travelled / distance
    columns: Mapping[str, Callable[[], Float[np.ndarray, " n"]]] = {
        "spring_stiffness": lambda: place,
        "gravity_sine": lambda: np.sin(motion.position),
        "gravity_cosine": lambda: np.cos(motion.position),
        "ripple_sine": lambda: np.sin(wave),
        "ripple_cosine": lambda: np.cos(wave),
        "presliding_friction": lambda: motion.direction * np.exp(-reached),
        "model_error": lambda: motion.model_effort,
        "offset_drift": lambda: elapsed,
        "friction_drift": lambda: (
            elapsed * (coulomb * motion.direction + viscous * motion.velocity)
        ),
        "viscous_drift": lambda: motion.velocity * elapsed,
    }
    effort = motion.model_effort.copy()
    for name, column in columns.items():
        if name in values:
            effort += values[name] * column()
    return effort


def _symmetric(values: Mapping[str, float], kind: str) -> float:
    """Return the friction of a kind, the mean of both directions where they differ [SI]."""
    sides = [values.get(f"{kind}_friction{side}", 0.0) for side in ("_positive", "_negative")]
    return values.get(f"{kind}_friction", 0.5 * sum(sides))
