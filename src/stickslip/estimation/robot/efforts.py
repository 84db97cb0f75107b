"""Logs of the joints of a robot, with the effort that a model of its links states for each."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.prepare import prepare, sample_times, with_common_times
from stickslip.estimation.robot.model import RobotModel
from stickslip.estimation.signals.kinematics import LowPass, central_difference, default_cutoff
from stickslip.records import AxisLog, InputError, unit_of

_LOWER = 0.7  # ratio of successive cutoffs
_MORE = 1.15  # ratio of accelerations with successive cutoffs: a quarter of the variance is noise
_LOWEST = 8.0  # Hz, above the frequencies of the motion of links


def joint_of_each(
    axes: Sequence[str], joints: Iterable[str], stated: Mapping[str, str]
) -> dict[str, str]:
    """Return the joint of the model for each axis of a log; axes without one are left out.

    An axis is the joint of the same name, or the only joint whose name holds its own. Numbered axes
    are the joints in their order, if there are as many. Refused are stated axes and joints that do
    not exist, and a joint that is stated twice.
    """
    joints = list(joints)
    for axis, joint in stated.items():
        if axis not in axes:
            raise InputError("axis_not_found", where="the log", axis=axis, axes=list(axes))
        if joint not in joints:
            raise InputError("joint_not_in_model", joint=joint, joints=joints)
    if len(set(stated.values())) < len(stated):
        raise InputError("joint_stated_twice", joints=list(stated.values()))
    found = dict(stated)
    for alike in (_same, _holds):
        free = [joint for joint in joints if joint not in found.values()]
        for axis in [each for each in axes if each not in found]:
            own = [joint for joint in free if alike(axis, joint)]
            rivals = [each for each in axes if each not in found and own and alike(each, own[0])]
            if len(own) == 1 and len(rivals) == 1:
                found[axis] = own[0]
    numbers = [re.findall(r"\d+", axis)[-1:] for axis in axes]
    if not found and len(axes) == len(joints) and all(numbers):
        order = sorted(axes, key=lambda axis: int(re.findall(r"\d+", axis)[-1]))
        if len({each[0] for each in numbers}) == len(axes):
            found = dict(zip(order, joints, strict=True))
    return {axis: found[axis] for axis in axes if axis in found}


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _same(axis: str, joint: str) -> bool:
    return _letters(axis) == _letters(joint)


def _holds(axis: str, joint: str) -> bool:
    own, other = _letters(axis), _letters(joint)
    numbered = own.isdigit() or other.isdigit()  # "1" is in "joint_11"
    return not numbered and bool(own) and (own in other or other in own)


def _motion_of(log: AxisLog) -> Float[np.ndarray, "4 n"]:
    """Return time, position, velocity and acceleration, each stretch between gaps by itself."""
    prepared = prepare(log).with_parts()
    parts = [
        np.vstack([part.time, _smoothed(part.position, prepared.sampling_time)])
        for part in prepared.parts
    ]
    return np.hstack(parts)


def _smoothed(values: Float[np.ndarray, " n"], sampling_time: float) -> Float[np.ndarray, "3 n"]:
    """Return position, velocity and acceleration below the frequencies at which noise prevails.

    The links move at low frequencies. If a lower cutoff removes much of the acceleration, that part
    is noise of the encoder or of the clock.
    """
    T = sampling_time
    cutoff = default_cutoff(T)
    found = _derivatives(values, T, cutoff)
    while (cutoff := _LOWER * cutoff) > _LOWEST:
        calmer = _derivatives(values, T, cutoff)
        if np.std(found[2]) < _MORE * np.std(calmer[2]):
            break
        found = calmer
    return found


def _derivatives(
    values: Float[np.ndarray, " n"], T: float, cutoff: float
) -> Float[np.ndarray, "3 n"]:
    position = LowPass.of(T, cutoff).apply(values, T)
    velocity = central_difference(position, T)
    # A second difference attenuates high frequencies less than a difference of differences
    second = np.gradient(velocity, T)
    second[1:-1] = np.diff(position, 2) / T**2
    return np.vstack([position, velocity, second])


def with_model_effort(
    logs: Mapping[str, AxisLog], robot: RobotModel, joint_of: Mapping[str, str]
) -> dict[str, AxisLog]:
    """Return logs of joints, on their side of the gear, with the efforts that a model states.

    Of the rigid-body effort ``M(q) a + C(q, v) v + g(q)``, a constant inertia times the
    acceleration is left to the axis: the mean of its own element of M. Its estimated inertia is
    then this mean with that of the rotor, and errors of the mean do not matter. Joints without an
    axis are taken at rest at zero. Refused are efforts that are no force or torque, and a linear
    axis whose joint turns.
    """
    names = list(robot.joints)
    for axis, log in logs.items():
        own = robot.joints[joint_of[axis]]
        if log.kind != own:
            raise InputError(
                "robot_joint_of_other_kind",
                where=axis,
                joint=joint_of[axis],
                kind=log.kind,
                own=own,
            )
        if log.effort_unit:
            raise InputError("model_needs_torque", where=axis, unit=log.effort_unit)
    logs = with_common_times(logs)
    place = {axis: names.index(joint_of[axis]) for axis in logs}
    motions = {axis: _motion_of(log) for axis, log in logs.items()}
    still = [name for name in names if name not in {joint_of[axis] for axis in logs}]
    found: dict[str, AxisLog] = {}
    # Times, accelerations, efforts of the links, and mean inertias of the joints
    known: list[tuple[Float[np.ndarray, "..."], ...]] = []
    for axis, log in logs.items():
        taken = sample_times(log)
        same = [entry for entry in known if np.array_equal(entry[0], taken)]
        if not same:
            moved = np.zeros((3, len(log), len(names)))
            for other, (time, *motion) in motions.items():
                moved[:, :, place[other]] = [np.interp(taken, time, each) for each in motion]
            known.append((taken, moved[2], robot.effort(*moved), robot.mean_inertia(moved[0])))
            same = known[-1:]
        _, acceleration, effort, inertias = same[0]
        k = place[axis]
        inertia = float(inertias[k])
        model = effort[:, k] - inertia * acceleration[:, k]
        note = _note(log, robot, joint_of[axis], inertia, still)
        source = log.source
        if source is not None:
            source = replace(source, assumptions=(*source.assumptions, *note))
        found[axis] = replace(log, model_effort=model, source=source)
    return found


def _note(
    log: AxisLog, robot: RobotModel, joint: str, inertia: float, still: Sequence[str]
) -> list[str]:
    """Return notes on the effort of the model and on the meaning of the estimated inertia."""
    unit = unit_of("inertia", log.kind)
    notes = [
        f"joint {joint} of {robot.name}: gravity, the other joints and the changes of inertia act "
        f"as that model has them, with an upright base; the estimated inertia is that of the mean "
        f"posture, {inertia:.4g} {unit} of it in the model and the rest of the rotor"
    ]
    if still:
        notes.append(f"joints that the log does not hold are taken at zero: {', '.join(still)}")
    return notes
