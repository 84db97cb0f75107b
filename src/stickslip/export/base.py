"""The base of the exports: their settings, and what is written."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from stickslip.export.parameters import ExportParameters
from stickslip.export.transmission import Side
from stickslip.input_files import nearest
from stickslip.records import InputError

Axes = Mapping[str, ExportParameters]
"""Parameters by the name of the axis or joint."""

Group = Literal["simulator", "drive", "code", "randomisation"]

DEFAULT_AXIS = "axis"
"""Name of an axis whose estimate has none."""

MEAN = "is replaced by the mean of both directions"
IN_A_JOINT = {"direction": MEAN, "offset": "is left out: a joint has no constant effort"}
"""Effects that joints of simulators do not represent."""


@dataclass(frozen=True, kw_only=True)
class ExportSettings:
    """Settings of an export; those a target does not use must be None."""

    overwrite: bool = False  #: Whether values that the edited file already has are replaced.
    points: int | None = None  #: Number of points of a table of effort over speed [-].
    #: Largest speed that a table covers [rad/s or m/s], on the side of the target.
    top_speed: float | None = None
    #: Part of the identified inertia that the model has already [kg m^2 or kg], on the side of the
    #: target; the rest is written as armature. None: no armature is written.
    link_inertia: float | None = None
    rated_current: float | None = None  #: Of the motor [A].
    torque_constant: float | None = None  #: Of the motor [N m/A or N/A].
    #: Arithmetic of generated code, ``"single"`` or ``"double"``.
    precision: Literal["single", "double"] | None = None
    fmi_version: Literal["2.0", "3.0"] | None = None  #: ``"2.0"`` or ``"3.0"``.
    #: Of a functional mock-up unit, for ``"all"`` platforms, the ``"host"``'s, or ``"none"``.
    binaries: Literal["all", "host", "none"] | None = None
    #: Part of the identified inertia that moves behind a spring [kg m^2 or kg].
    load_inertia: float | None = None
    stiffness: float | None = None  #: Of that spring [N m/rad or N/m].
    sampling_time: float | None = None  #: Of a sampled model or generated code [s].


@dataclass(frozen=True, kw_only=True)
class Rendered:
    """Content of the files of an export."""

    #: Content by relative path with ``/``; text is written as UTF-8. An exporter of one file uses
    #: the empty path.
    files: Mapping[str, str | bytes]
    #: Effects that the target does not represent, and other remarks, one sentence each;
    #: they also stand in the file where its format has comments.
    notes: tuple[str, ...] = field(default=())


@dataclass(frozen=True, kw_only=True)
class FileToEdit:
    """A file that an export is written into."""

    content: bytes  #: Its bytes.
    path: Path | None = None  #: Where it stands; None in memory.
    out: Path | None = None  #: Where the edited file will stand; None if it is not written.


@dataclass(frozen=True, kw_only=True)
class Exporter(ABC):
    """A target of exports."""

    name: str  #: As on the command line, such as ``"urdf"``.
    title: str  #: Name of the target in words.
    group: Group = "simulator"  #: Section of the overview.
    #: The side whose values the target holds; None for whichever side the parameters are of.
    side: Side | None = "joint"
    #: Quantities that the target holds, of `stickslip.records.QUANTITIES`.
    represents: tuple[str, ...]
    #: For other quantities that friction may have, what the target does instead, as the end of a
    #: sentence such as ``"static friction ..."``.
    cannot: Mapping[str, str] = field(default_factory=dict)
    ending: str  #: Of the file, such as ``".urdf"``; empty for a folder.
    #: Whether it edits an existing file, ``"never"`` or ``"always"``.
    edits: Literal["never", "always"] = "never"
    several: bool = True  #: Whether one file can hold several axes.
    options: tuple[str, ...] = ()  #: Fields of `ExportSettings` that it uses, beside ``overwrite``.

    @abstractmethod
    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return what is written.

        Parameters
        ----------
        axes
            Parameters on ``side``.
        settings
            See `ExportSettings`.
        into
            The file to edit; None if there is none.

        Raises
        ------
        InputError
            If the target cannot hold the parameters, or the file to edit is unsuitable.
        """


def quantities_used(exporter: Exporter) -> tuple[str, ...]:
    """Return the quantities that a target holds, and the inertia if it can be an armature."""
    armature = ("mass", "inertia") if "link_inertia" in exporter.options else ()
    return (*exporter.represents, *armature)


def axis_in_words(name: str) -> str:
    """Return an axis as it is named in a sentence."""
    return "the axis" if name == DEFAULT_AXIS else f"axis {name}"


def prefix(name: str, axes: Axes) -> str:
    """Return what precedes a sentence on one of the axes: its name if there are several."""
    return f"{name}: " if len(axes) > 1 else ""


def one_friction(owner: str) -> str:
    """Return what becomes of static friction where one friction value is all that there is."""
    return f"is left out: {owner} has one friction value, and it gets the Coulomb friction"


def only_axis(axes: Axes, title: str) -> tuple[str, ExportParameters]:
    """Return the only axis, with its name."""
    if len(axes) != 1:
        raise InputError("several_axes", title=title, count=len(axes), axes=tuple(axes))
    return next(iter(axes.items()))


def choices(name: str, known: Iterable[str]) -> tuple[str, ...]:
    """Return the known names that are similar to a given one; all if none is."""
    known = tuple(known)
    return tuple(nearest(name, known)) or known
