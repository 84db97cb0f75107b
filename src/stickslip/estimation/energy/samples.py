"""Samples of a log in the form that the online energy estimators take."""

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.levels import load_position
from stickslip.estimation.online import recursion
from stickslip.records import AxisLog, InputError

__all__ = ["check_fits", "samples_of"]

_SAME_SAMPLING_TIME = 0.01  # relative


def check_fits(
    log: AxisLog,
    sampling_time: float,
    *,
    at_gaps: str = "run its segments one by one and resume before each, or use fit",
) -> None:
    """Refuse a log that does not fit a state.

    Parameters
    ----------
    log
        What is to be run.
    sampling_time
        That the state was made for [s].
    at_gaps
        Remedy for a log with a gap.

    Raises
    ------
    InputError
        If it has a gap, or another sampling time.
    """
    if log.segment_starts.size > 1:
        k = int(log.segment_starts[1])
        raise InputError(
            f"the log has a gap of {log.time[k] - log.time[k - 1]:.6g} s before sample {k}",
            where=log.name,
            remedy=at_gaps,
        )
    own = log.sampling_time
    if abs(own - sampling_time) > _SAME_SAMPLING_TIME * sampling_time:
        raise InputError(
            f"the log has a sampling time of {own:.6g} s, the state was made for "
            f"{sampling_time:.6g} s",
            where=log.name,
            remedy=f"make the state with init(sampling_time={own:.6g})",
        )


def samples_of(
    state: Float[np.ndarray, " s"], log: AxisLog, *, load: bool
) -> Float[np.ndarray, "n 5"]:
    """Return the samples of a log without gaps, in the form that a kernel takes.

    Parameters
    ----------
    state
        That the samples are for.
    log
        Without gaps.
    load
        Whether the state was made for measurements of the load.

    Raises
    ------
    InputError
        If the log has a gap or another sampling time than the state, or lacks a signal that the
        state was made for.
    """
    check_fits(
        log,
        float(state[recursion.SAMPLING_TIME]),
        at_gaps="run its segments one by one, each from a new state with the last estimates as "
        "initial_values, or use fit",
    )
    derived = state[recursion.DERIVED] > 0.0
    if log.measured_velocity is None and not derived:
        raise InputError(
            "the log holds no velocity, the state was made for a measured one",
            where=log.name,
            remedy="make the state with init(velocity_measured=False)",
        )
    if load:
        load_position(log)
        if log.measured_load_velocity is None and not derived:
            raise InputError(
                "the log holds no velocity of the load, the state was made for a measured one",
                where=log.name,
                remedy="make the state with init(velocity_measured=False)",
            )
    absent = np.zeros(len(log))
    columns = [
        log.effort,
        log.measured_position,
        absent if log.measured_velocity is None else log.measured_velocity,
        absent if log.measured_load_position is None else log.measured_load_position,
        absent if log.measured_load_velocity is None else log.measured_load_velocity,
    ]
    return np.column_stack(columns)
