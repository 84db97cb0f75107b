"""Checks that exports into robot descriptions share."""

import math
from collections.abc import Mapping

from stickslip.export.base import ExportSettings, FileToEdit
from stickslip.export.parameters import ExportParameters
from stickslip.records import InputError, mass_name, non_negative

_SINGLE = 1e-7  # relative precision of single floats
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
    """Present values of the joints of a file that an export changes, for one error on all."""

    def __init__(self) -> None:
        self._changes: dict[str, list[str]] = {}

    def add(
        self, joint: str, present: Mapping[str, str | None], values: Mapping[str, str | None]
    ) -> None:
        """Add the present values of a joint that differ from the new ones; None is no value."""
        changes = [
            f"{key} {old} -> {'none' if value is None else value}"
            for key, value in values.items()
            if (old := present.get(key)) is not None and not _equal(old, value)
        ]
        if changes:
            self._changes.setdefault(joint, []).extend(changes)

    def check(self, *, overwrite: bool) -> None:
        """Check that no value is changed without ``overwrite``.

        Raises
        ------
        InputError
            If one is; it has the changes of all joints.
        """
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


def including_link(identified: float, unit: str) -> str:
    """Return the clause on an identified inertia of which no part is written."""
    return (
        f"the identified {identified:.4g} {unit} include the link's inertia, which the model has "
        "already; give it as link-inertia to write the rest"
    )


def armature(
    parameters: ExportParameters, settings: ExportSettings
) -> tuple[float | None, list[str]]:
    """Return the armature [kg m^2 or kg] and remarks on it; None if none is written.

    The identified inertia is that of rotor and link. A model has that of its links already.
    """
    identified, unit = parameters.inertia, parameters.unit("inertia")
    if settings.link_inertia is None:
        if identified is None:
            return None, []
        return None, [f"No armature is written: {including_link(identified, unit)}"]
    link = non_negative("link_inertia", settings.link_inertia, unit)
    if identified is None:
        identified = parameters.required(mass_name(parameters.kind), "armature")
    if link > identified:
        raise InputError("link_inertia_too_large", value=link, identified=identified, unit=unit)
    return identified - link, []
