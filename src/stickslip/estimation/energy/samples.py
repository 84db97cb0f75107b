"""Samples of a log in the form that the online estimators take."""

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.levels import load_position
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import recursion_fields
from stickslip.estimation.signals.kinematics import LowPass, central_difference
from stickslip.records import AxisLog, InputError

_SAME_SAMPLING_TIME = 0.01  # relative difference that counts as none [-]


def check_fits(log: AxisLog, sampling_time: float, *, resumes: bool = True) -> None:
    """Reject a log with a gap, or with another sampling time than the state was made for [s].

    ``resumes`` is whether a state can be resumed after a gap.
    """
    if log.segment_starts.size > 1:
        k = int(log.segment_starts[1])
        raise InputError(
            "gap" if resumes else "gap_without_resumption",
            where=log.name,
            gap=log.time[k] - log.time[k - 1],
            sample=k,
        )
    own = log.sampling_time
    if abs(own - sampling_time) > _SAME_SAMPLING_TIME * sampling_time:
        raise InputError(
            "other_sampling_time",
            where=log.name,
            name="the state",
            own=sampling_time,
            other="the log",
            sampling_time=own,
        )


def samples_of(state: State, log: AxisLog, *, load: bool) -> Float[np.ndarray, "n 5"]:
    """Return the samples of a log without gaps for a state, one row each.

    ``load`` is whether the state was made for measurements of the load. Raises InputError if the
    log has a gap or another sampling time than the state, or lacks a signal that it was made for.
    """
    own = recursion_fields(state)
    check_fits(log, float(own.sampling_time), resumes=False)
    velocities = [("", log.measured_velocity)]
    if load:
        velocities.append((" of the load", log.measured_load_velocity))
    for of, velocity in velocities:
        if of:
            load_position(log)
        if velocity is None and own.differentiates == 0:
            raise InputError("state_needs_velocity", where=log.name, of=of)
    columns = (
        log.effort,
        log.measured_position,
        log.measured_velocity,
        log.measured_load_position,
        log.measured_load_velocity,
    )
    return np.column_stack([np.zeros(len(log)) if c is None else c for c in columns])


def filtered_samples(
    part: AxisLog, low_pass: LowPass, *, load: bool, effort_delay: float = 0.0
) -> Float[np.ndarray, "n 5"]:
    """Return the samples of a stretch without gaps, one row each, with derived velocities.

    Velocities that were not measured are differentiated from low-passed positions. ``load`` is
    whether the axis is a flexible arm; if not, its load is zero. The effort is advanced by the
    samples ``effort_delay`` by which it acts after it is logged [-]. Raises InputError if the
    position of the load is needed and not there.
    """
    T = part.sampling_time

    def velocity(
        measured: Float[np.ndarray, " n"] | None, position: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " n"]:
        if measured is not None:
            return measured
        return central_difference(low_pass.apply(position, T), T)

    x = part.measured_position
    x2 = v2 = np.zeros(len(part))
    if load:
        x2 = load_position(part)
        v2 = velocity(part.measured_load_velocity, x2)
    k = np.arange(len(part))
    effort = np.interp(k - effort_delay, k, part.effort)
    return np.column_stack([effort, x, velocity(part.measured_velocity, x), x2, v2])
