"""Prepared logs of a joint fit, and their common motion, excitation and provenance."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from stickslip.estimation.fit.rows import MotionSummary
from stickslip.estimation.fit.solve import provenance_of
from stickslip.estimation.joint.model import JointModel, JointMotions
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.model_rows import motion_summary
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.records import AxisLog, Provenance


@dataclass(frozen=True, kw_only=True)
class Member:
    """One log as prepared."""

    log: PreparedLog
    motions: SlipMotions  # with the time counted from the middle
    notes: tuple[str, ...]
    middle: float  # time of the log [s]

    @property
    def name(self) -> str:
        """Name of the log."""
        return self.log.log.name


def with_time_shift(motions: SlipMotions, shift: float) -> SlipMotions:
    """Return the motion with its time shifted [s]."""
    stretches = tuple(replace(m, time=m.time + shift) for m in motions.stretches)
    return replace(motions, stretches=stretches)


def joint_motions(every: Iterable[SlipMotions]) -> JointMotions:
    """Return the motion of several logs."""
    motions = list(every)
    return JointMotions(
        stretches=tuple(m for each in motions for m in each.stretches),
        slow=min(each.slow for each in motions),
        position_noise=max(each.position_noise for each in motions),
    )


def joint_excitation(members: Sequence[Member], model: JointModel) -> MotionSummary:
    """Return the excitation of all logs together."""
    every = [
        motion_summary(each.log, each.motions, part.weight)
        for each, part in zip(members, model.rows.parts, strict=True)
    ]
    widest = max(every, key=lambda motion: motion.position_range / motion.position_noise)
    return replace(
        widest,
        largest_speed=max(motion.largest_speed for motion in every),
        forward_travel=sum(motion.forward_travel for motion in every),
        backward_travel=sum(motion.backward_travel for motion in every),
        speed_variation=max(motion.speed_variation for motion in every),
    )


def joint_provenance(logs: Sequence[AxisLog], options: Mapping[str, Any]) -> Provenance:
    """Return the provenance, with assumptions that all logs share stated once."""
    every = [provenance_of(log, options) for log in logs]
    shared = [line for line in every[0].assumptions if all(line in p.assumptions for p in every)]
    own = [
        f"{log.name}: {line}"
        for log, p in zip(logs, every, strict=True)
        for line in p.assumptions
        if line not in shared
    ]
    hashes = [p.input_sha256 for p in every]
    return replace(
        every[0],
        files=tuple(file for p in every for file in p.files),
        input_sha256=(hashlib.sha256("".join(hashes).encode()).hexdigest() if all(hashes) else ""),
        assumptions=(*shared, *own),
    )
