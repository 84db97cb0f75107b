"""Checks that exports into robot descriptions share."""

from collections.abc import Mapping

from stickslip.export.parameters import ExportParameters
from stickslip.records import InputError

_JOINT = {"linear": "a prismatic (sliding)", "rotary": "a revolute (turning)"}


def content_bytes(into: str | bytes | None) -> bytes:
    """Return the content of the file to edit."""
    if into is None:
        raise InputError("there is no file to edit", remedy="give one with --into")
    return into.encode() if isinstance(into, str) else into


def check_kind(
    name: str, joint_type: str, kinds: Mapping[str, str], parameters: ExportParameters
) -> None:
    """Check that a joint moves as the axis of the estimate does.

    Parameters
    ----------
    name
        Of the joint.
    joint_type
        As the file has it.
    kinds
        ``"linear"`` or ``"rotary"`` by the type of joint; other types have no friction of one axis.
    parameters
        Of the axis.
    """
    kind = kinds.get(joint_type)
    if kind == parameters.kind:
        return
    if kind is None:
        raise InputError(
            f"joint {name!r} is {joint_type}, which has no friction of one axis",
            where="--into",
            remedy=f"name {_JOINT[parameters.kind]} joint",
        )
    raise InputError(
        f"the estimate is of a {parameters.kind} axis, and joint {name!r} is {joint_type}",
        where=parameters.source.file or "--into",
        remedy=f"name {_JOINT[parameters.kind]} joint, or identify the axis as {kind}; for a "
        "spindle between a rotary motor and a linear joint give --lead",
    )


def check_present(
    name: str, present: Mapping[str, str], values: Mapping[str, str], *, overwrite: bool
) -> None:
    """Check that no value that a joint has is changed, unless that is wanted.

    Raises
    ------
    InputError
        If there is another value, with old and new values.
    """
    changes = [
        f"{key} {present[key]} -> {value}"
        for key, value in values.items()
        if key in present and not _equal(present[key], value)
    ]
    if changes and not overwrite:
        raise InputError(
            f"joint {name!r} has values already: {', '.join(changes)}",
            where="--into",
            remedy="give --overwrite to replace them",
        )


def _equal(one: str, other: str) -> bool:
    """Return whether two texts are the same numbers."""
    try:
        return [float(each) for each in one.split()] == [float(each) for each in other.split()]
    except ValueError:
        return False
