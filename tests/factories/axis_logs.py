"""Logs of one axis from plain arrays."""

from typing import Any

from numpy.typing import NDArray

from stickslip.records import AxisKind, AxisLog


def axis_log(
    time: NDArray[Any],
    effort: NDArray[Any],
    position: NDArray[Any],
    velocity: NDArray[Any] | None = None,
    *,
    name: str = "axis",
    kind: AxisKind = "linear",
) -> AxisLog:
    """Return the log of an axis whose position, and maybe whose velocity, is measured [SI]."""
    return AxisLog(
        name=name,
        kind=kind,
        time=time,
        effort=effort,
        measured_position=position,
        measured_velocity=velocity,
    )
