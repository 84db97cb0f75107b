"""Schemas of logs: which column is what; made in Python, from flags, or from a TOML file."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar, get_args

from stickslip.input_files import read_toml, record_from, unknown_key
from stickslip.records import AxisKind, InputError, ReadOnlyMapping, positive

CHANNELS = ("time", "position", "velocity", "effort", "load_position", "load_velocity")
"""Channels of a log; each is also the name of a quantity (without ``load_``)."""

_SAMPLING = ("time", "sampling_time", "sampling_frequency")
"""Keys that state when samples were taken, of which a log has one."""


@dataclass(frozen=True, kw_only=True)
class AxisSchema:
    """Which columns make one axis.

    Every channel is a column's name, or a linear expression over columns such as
    ``"35.15 * vir"`` or ``"'motor angle' / 32"``. A single number stored in the file, as MATLAB
    and NPZ files have them, can stand in an expression under its name.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``; None takes it from the units.
    name
        What to call the axis; None: the file's name.
    time
        Time stamps.
    sampling_time
        Sampling time [s] of a log without time stamps.
    sampling_frequency
        Sampling frequency [Hz] of a log without time stamps.
    position, velocity, effort
        Of the axis, or of the first mass of a flexible arm.
    load_position, load_velocity
        Of the second mass of a flexible arm.
    units
        By channel, the unit that its column or expression comes out in, such as ``"mm"``. A
        channel not named here has the unit in the column's header, or else the SI unit.

    Raises
    ------
    InputError
        If a key of ``units`` is no channel, or if the sampling is stated twice or is not positive.
    """

    kind: AxisKind | None = None
    name: str | None = None
    time: str | None = None
    sampling_time: float | None = None
    sampling_frequency: float | None = None
    position: str | None = None
    velocity: str | None = None
    effort: str | None = None
    load_position: str | None = None
    load_velocity: str | None = None
    units: Mapping[str, str] = field(default_factory=dict[str, str])

    # Unknown keys of a TOML file are refused.
    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", ReadOnlyMapping(self.units))
        for key in self.units:
            if key not in CHANNELS:
                raise unknown_key(key, CHANNELS).at("[units]")
        if self.kind not in {None, *get_args(AxisKind)}:
            raise InputError(
                f"the kind of axis is {self.kind!r}",
                remedy=f"state one of: {', '.join(get_args(AxisKind))}",
            )
        given = [key for key in _SAMPLING if getattr(self, key) is not None]
        if len(given) > 1:
            raise InputError(
                f"{' and '.join(given)} are both given",
                remedy="keep the one that says how the log was sampled",
            )
        if self.sampling_time is not None:
            positive("sampling_time", self.sampling_time, "s")
        if self.sampling_frequency is not None:
            positive("sampling frequency", self.sampling_frequency, "Hz")


@dataclass(frozen=True, kw_only=True)
class LogSchema(AxisSchema):
    """Which columns of a log make an axis, or which make each of several axes.

    Attributes
    ----------
    files
        For a log that is a folder: a short name for each of its files. The columns of a file are
        then written ``short:column``.
    axes
        For a log of several axes, what differs from axis to axis, by the axis' name. What is
        stated outside of them holds for all.

    Raises
    ------
    InputError
        As `AxisSchema` does.

    Examples
    --------
    >>> schema = LogSchema(kind="linear", position="encoder", effort="35.15 * drive",
    ...                    units={"position": "mm"})
    >>> schema.effort
    '35.15 * drive'
    """

    files: Mapping[str, str] = field(default_factory=dict[str, str])
    axes: Mapping[str, AxisSchema] = field(default_factory=dict[str, AxisSchema])

    def __post_init__(self) -> None:
        object.__setattr__(self, "files", ReadOnlyMapping(self.files))
        object.__setattr__(self, "axes", ReadOnlyMapping(self.axes))
        super().__post_init__()

    def for_axis(self, axis: str | int | None) -> AxisSchema:
        """Return the schema of one axis.

        Raises
        ------
        InputError
            If there is no such axis, or if there are several and none was chosen.
        """
        listed = ", ".join(self.axes)
        chosen = next(iter(self.axes), None) if axis is None else str(axis)
        if axis is None and len(self.axes) > 1:
            raise InputError(
                f"the log has {len(self.axes)} axes ({listed}) and none was chosen",
                remedy=f"choose one, as in --axis {chosen}",
            )
        if axis is not None and not self.axes:
            raise InputError(
                f"axis {chosen!r} was chosen and the schema has no axes",
                remedy=f"leave the choice out, or write a table [axes.{chosen}] in the schema",
            )
        if axis is not None and chosen not in self.axes:
            raise InputError(f"there is no axis {chosen!r}", remedy=f"choose one of: {listed}")
        if chosen is None:
            return AxisSchema(**_merged(self, AxisSchema()))
        own = self.axes[chosen]
        name = own.name or (f"{self.name} axis {chosen}" if self.name else f"axis {chosen}")
        return replace(AxisSchema(**_merged(self, own)), name=name)

    def overridden(self, axis: str | int | None, columns: AxisSchema) -> "LogSchema":
        """Return the schema of one axis, in which the entries of ``columns`` take precedence."""
        return LogSchema(**_merged(self.for_axis(axis), columns), files=self.files)


def _merged(base: AxisSchema, own: AxisSchema) -> dict[str, Any]:
    """Return the entries of two schemas; the second takes precedence."""
    names = [each.name for each in fields(AxisSchema)]
    merged: dict[str, Any] = {name: getattr(base, name) for name in names}
    merged |= {name: value for name in names if (value := getattr(own, name)) is not None}
    merged["units"] = {**base.units, **own.units}
    if any(getattr(own, key) is not None for key in _SAMPLING):
        merged |= {key: getattr(own, key) for key in _SAMPLING}
    return merged


def read_schema(path: str | Path) -> LogSchema:
    """Read a schema from a TOML file.

    Parameters
    ----------
    path
        The file; its keys are the attributes of `LogSchema`.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key (near names are suggested) or a
        value of the wrong kind.
    """
    path = Path(path)
    document = read_toml(path, what="schema", line='position = "encoder"')
    remedy = "see the examples of schemas in the documentation"
    return record_from(LogSchema, document, where=str(path), remedy=remedy)
