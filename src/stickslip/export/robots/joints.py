"""Checks that exports into robot descriptions share."""

import math
from collections.abc import Mapping

from stickslip.export.base import ExportSettings, FileToEdit
from stickslip.export.parameters import ExportParameters
from stickslip.records import InputError, mass_name, non_negative

_SINGLE = 1e-7
_JOINT = {"linear": "a prismatic (sliding)", "rotary": "a revolute (turning)"}


def edited_file(into: FileToEdit | None, title: str) -> FileToEdit:
    """Return the file to edit, which must be there."""
    if into is None:
        raise InputError("file_to_edit_missing", title=title)
    return into


def check_kind(
    name: str, joint_type: str, kinds: Mapping[str, str], parameters: ExportParameters
) -> None:
    """Check that a joint moves as the axis of the estimate does.

    ``kinds`` has the kind of axis by the type of joint; other types have no friction of one axis.
    """
    kind = kinds.get(joint_type)
    if kind == parameters.kind:
        return
    code = "joint_of_no_axis" if kind is None else "joint_of_other_kind"
    raise InputError(
        code,
        joint=name,
        type=joint_type,
        kind=parameters.kind,
        other=kind,
        wanted=_JOINT[parameters.kind],
    )


class PresentValues:
    """Values that joints of a file have and an export changes, for one message on all of them."""

    def __init__(self) -> None:
        self._changes: dict[str, list[str]] = {}

    def add(
        self, joint: str, present: Mapping[str, str | None], values: Mapping[str, str | None]
    ) -> None:
        """Add what of the present values of a joint is changed; None is no value."""
        changes = [
            f"{key} {old} -> {'none' if value is None else value}"
            for key, value in values.items()
            if (old := present.get(key)) is not None and not _equal(old, value)
        ]
        if changes:
            self._changes.setdefault(joint, []).extend(changes)

    def check(self, *, overwrite: bool) -> None:
        """Check that nothing is changed, unless that is wanted."""
        if not self._changes or overwrite:
            return
        (joint, changes), *others = self._changes.items()
        more = "".join(f"; joint {name!r}: {', '.join(rest)}" for name, rest in others)
        raise InputError("values_present", joint=joint, changes=changes, more=more)


def _equal(one: str, other: str | None) -> bool:
    """Return whether two texts are the same numbers, in single precision."""
    if other is None:
        return False
    try:
        ours, theirs = ([float(each) for each in text.split()] for text in (one, other))
    except ValueError:
        return False
    return len(ours) == len(theirs) and all(
        math.isclose(a, b, rel_tol=_SINGLE) for a, b in zip(ours, theirs, strict=True)
    )


def armature(
    parameters: ExportParameters, settings: ExportSettings
) -> tuple[float | None, list[str]]:
    """Return the armature [kg m^2 or kg] and what to say of it; None if none is written.

    The identified inertia is that of rotor and link. A model has that of its links already.
    """
    identified, unit = parameters.inertia, parameters.unit("inertia")
    if settings.link_inertia is None:
        if identified is None:
            return None, []
        return None, [
            f"No armature is written: the identified {identified:.4g} {unit} contain the link's; "
            "link-inertia is the option for the part that the model has already"
        ]
    link = non_negative("link_inertia", settings.link_inertia, unit)
    if identified is None:
        identified = parameters.required(mass_name(parameters.kind), "armature")
    if link > identified:
        raise InputError("link_inertia_too_large", value=link, identified=identified, unit=unit)
    return identified - link, []
