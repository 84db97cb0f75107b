"""Schemas of logs: which column is what; made in Python, from flags, or from a TOML file."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

from stickslip.input_files import read_toml, record_from, unknown_key
from stickslip.records import AxisKind, InputError, ReadOnlyMapping, non_negative, one_of, positive

CHANNELS = ("time", "position", "velocity", "effort", "load_position", "load_velocity")
"""Channels of a log; each is also the name of a quantity (without ``load_``)."""

Side = Literal["motor", "joint"]
"""Sides of a gear."""

_SAMPLING = ("time", "sampling_time", "sampling_frequency")
"""Keys that state when samples were taken, of which a log has one."""

_POSITIVE = {"torque_constant": "N m/A or N/A", "sampling_time": "s", "sampling_frequency": "Hz"}
"""Units of the keys whose values must be positive."""


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
    preset
        Name of a schema that comes with the package (`presets`), for what is not stated; ``"none"``
        for none. None takes one whose columns the log has.
    torque_constant
        Torque (or force) per ampere [N m/A or N/A], for an effort that is a current.
    gear_ratio
        Turns of the motor per turn of the joint [-], negative if they turn opposite ways; for an
        effort of the motor, beside the position of the joint.
    effort_side
        ``"motor"`` or ``"joint"``, of the gear at which the effort acts.
    start_time, end_time
        Part of the log that is read [s], counted from its first sample; None for its ends.
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
    preset: str | None = None
    torque_constant: float | None = None
    gear_ratio: float | None = None
    effort_side: Side | None = None
    start_time: float | None = None
    end_time: float | None = None
    units: Mapping[str, str] = field(default_factory=dict[str, str])

    # Unknown keys of a TOML file are refused.
    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", ReadOnlyMapping(self.units))
        for key in self.units:
            if key not in CHANNELS:
                raise unknown_key(key, CHANNELS).at("[units]")
        if self.kind is not None:
            one_of("kind", self.kind, get_args(AxisKind))
        given = [key for key in _SAMPLING if getattr(self, key) is not None]
        if len(given) > 1:
            raise InputError("both_given", names=given)
        for key, unit in _POSITIVE.items():
            if (value := getattr(self, key)) is not None:
                positive(key, value, unit)
        if self.start_time is not None:
            non_negative("start_time", self.start_time, "s")
        if self.effort_side not in {None, *get_args(Side)}:
            raise InputError("effort_side_unknown", value=self.effort_side, sides=get_args(Side))
        ratio = self.gear_ratio
        if ratio is not None and not (math.isfinite(ratio) and ratio != 0.0):
            raise InputError("gear_ratio_zero", name="gear_ratio", value=ratio)

    @property
    def stated(self) -> bool:
        """Whether a column of position or effort is stated."""
        return self.position is not None or self.effort is not None


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
        if axis is not None and not self.axes:
            raise InputError("axis_of_no_axes", axis=str(axis))
        chosen = next(iter(self.axes), None) if axis is None else str(axis)
        if axis is None and len(self.axes) > 1:
            raise InputError(
                "axis_not_chosen", count=len(self.axes), axes=list(self.axes), first=chosen
            )
        if chosen is not None and chosen not in self.axes:
            raise InputError("axis_unknown", axis=chosen, axes=list(self.axes))
        if chosen is None:
            return AxisSchema(**merged(self, AxisSchema()))
        own = self.axes[chosen]
        name = own.name or (f"{self.name} axis {chosen}" if self.name else f"axis {chosen}")
        return replace(AxisSchema(**merged(self, own)), name=name)

    def overridden(self, axis: str | int | None, columns: AxisSchema) -> "LogSchema":
        """Return the schema in which the entries of ``columns`` take precedence.

        Of a schema with axes it is that of the chosen one; of all, if none is chosen and no column
        is stated.
        """
        several = axis is None and len(self.axes) > 1
        if several and not any(getattr(columns, channel) for channel in CHANNELS):
            axes = {name: AxisSchema(**merged(own, columns)) for name, own in self.axes.items()}
            return LogSchema(**merged(self, columns), files=self.files, axes=axes)
        base = self.for_axis(axis) if self.axes else self
        return LogSchema(**merged(base, columns), files=self.files)


def merged(base: AxisSchema, own: AxisSchema) -> dict[str, Any]:
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
    return record_from(LogSchema, document, where=str(path), guide="docs/guide/logs.md")


def toml_text(axes: Mapping[str, AxisSchema], files: Mapping[str, str]) -> str:
    """Return a schema as TOML, with what all axes have in common outside of their tables."""
    own = {name: _entries(schema) for name, schema in axes.items()}
    every = list(own.values())
    shared = {
        key: value
        for key, value in (every[0].items() if every else ())
        if all(each.get(key) == value for each in every)
    }
    tables = {"units": shared.pop("units", {}), "files": files}
    lines = _lines(shared)
    for title, table in tables.items():
        if table:
            lines += ["", f"[{title}]", *_lines(table)]
    for name, entries in own.items() if len(own) > 1 else ():
        left = {
            key: value
            for key, value in entries.items()
            if key not in shared and not (key == "units" and value == tables["units"])
        }
        lines += ["", f"[axes.{_key(name)}]", *_lines(left)]
    return "\n".join(lines).lstrip("\n") + "\n"


def _entries(schema: AxisSchema) -> dict[str, Any]:
    """Return what a schema states, by its keys."""
    given = {each.name: getattr(schema, each.name) for each in fields(AxisSchema)}
    return {
        name: dict(value) if name == "units" else value
        for name, value in given.items()
        if value is not None and not (name == "units" and not value)
    }


def _lines(table: Mapping[str, Any]) -> list[str]:
    """Return the entries of a table; those within it are on one line."""
    return [f"{_key(key)} = {_toml(value)}" for key, value in table.items()]


def _toml(value: str | float | Mapping[str, Any]) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_lines(value))} }}"
    return json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _toml(name)
