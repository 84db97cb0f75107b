"""Schemas that come with the package, for logs of known tools, and columns by patterns."""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from importlib.resources import files

from stickslip.input_files import nearest
from stickslip.logs.schema import CHANNELS, AxisSchema, LogSchema, merged
from stickslip.logs.table import Table
from stickslip.records import InputError

AXIS, ANY = "{axis}", "{any}"
"""Places in a pattern: the name of an axis, and any text."""

_ALTERNATIVE = " | "
_BETWEEN = r"[\W_]{0,2}"  # what tools write where another writes an underscore, as in q[0] and q_0


@dataclass(frozen=True, kw_only=True)
class Preset:
    """Schema of the logs of a tool."""

    name: str
    title: str  # of the tool
    columns: tuple[str, ...]  # patterns of columns by which its logs are recognised
    schema: LogSchema  # its channels are patterns, its units hold where a header has none


@cache
def presets() -> Mapping[str, Preset]:
    """Return every preset by name."""
    found: dict[str, Preset] = {}
    for path in sorted(
        files("stickslip.logs").joinpath("presets").iterdir(), key=lambda path: path.name
    ):
        document = tomllib.loads(path.read_text(encoding="utf-8"))
        name = path.name.removesuffix(".toml")
        found[name] = Preset(
            name=name,
            title=document.pop("title"),
            columns=tuple(document.pop("columns")),
            schema=LogSchema(**document),
        )
    return found


def preset_for(table: Table, name: str | None) -> Preset | None:
    """Return the preset of a name, or for None one that recognises the columns of a log."""
    every = presets()
    if name == "none":
        return None
    if name is not None:
        if name not in every:
            raise InputError(
                "preset_unknown", preset=name, near=nearest(name, list(every)), presets=list(every)
            )
        return every[name]
    recognised = [
        each
        for each in every.values()
        if each.columns and all(_columns_like(table, pattern) for pattern in each.columns)
    ]
    return next((each for each in recognised if axes_by_preset(table, each)), None)


def axes_by_preset(table: Table, preset: Preset) -> dict[str, AxisSchema]:
    """Return the schema of each axis that a preset finds in a log, with position and effort."""
    return _expanded(table, preset.schema, optional=True)


def expanded(table: Table, schema: LogSchema) -> LogSchema:
    """Return a schema whose patterns are replaced by the columns that match them.

    A schema with ``{axis}`` in a pattern gets an axis for each text that stands there. The name of
    a column is no pattern.
    """
    texts = [getattr(schema, channel) or "" for channel in CHANNELS]
    texts = [text for text in texts if text not in table.headers]
    if not any(AXIS in text for text in texts):
        return schema
    axes = _expanded(table, schema, optional=False)
    if not axes:
        raise InputError(
            "pattern_without_column",
            where=table.label,
            pattern=next(text for text in texts if AXIS in text),
            columns=list(table.headers),
        )
    axes = {
        name: AxisSchema(**merged(each, schema.axes.get(name, AxisSchema())))
        for name, each in axes.items()
    }
    plain = {channel: None for channel in CHANNELS if AXIS in (getattr(schema, channel) or "")}
    return replace(schema, axes=axes, **plain)


def _expanded(table: Table, schema: LogSchema, *, optional: bool) -> dict[str, AxisSchema]:
    """Return the schema of each axis whose position and effort have columns.

    ``optional`` leaves out what has no column; otherwise texts without a place are taken as they
    are.
    """
    by_channel: dict[str, dict[str, str]] = {}
    for channel in CHANNELS:
        text = getattr(schema, channel)
        if text is not None and (optional or AXIS in text or ANY in text):
            by_channel[channel] = _columns_like(table, text)
    names = by_channel.get("position", {})
    if not names and not _is_pattern(schema.position or ""):
        names = by_channel.get("effort", {})
    base = {each.name: getattr(schema, each.name) for each in fields(AxisSchema)}
    axes: dict[str, AxisSchema] = {}
    for name in names:
        entries = dict(base)
        for channel, found in by_channel.items():
            column = found.get(name, found.get(""))
            if column is not None:
                entries[channel] = column
            elif optional:
                entries[channel] = None
            else:  # an expression over columns of the axis
                entries[channel] = str(base[channel]).replace(AXIS, name)
        if optional:
            stated = {
                channel: unit
                for channel, unit in schema.units.items()
                if (column := by_channel.get(channel, {}).get(name)) is not None
                and column not in table.units
            }
            if "time" in schema.units and not any(
                column in table.units for column in by_channel.get("time", {}).values()
            ):
                stated["time"] = schema.units["time"]
            entries["units"] = stated
        if entries["position"] is not None and entries["effort"] is not None:
            axes[name] = AxisSchema(**entries)
    return axes


def _is_pattern(text: str) -> bool:
    """Return whether a text is the pattern of a column, and no expression over columns."""
    return AXIS in text and set(text).isdisjoint("+*()'\"`")


def _columns_like(table: Table, text: str) -> dict[str, str]:
    """Return the columns that match a pattern, by the axis in it; the first alternative counts."""
    found: dict[str, str] = {}
    left = list(table.headers)
    for alternative in text.split(_ALTERNATIVE):
        expression = _compiled(alternative)
        matches = {name: match for name in left if (match := expression.fullmatch(name))}
        for name, match in matches.items():
            found.setdefault(match.groupdict().get("axis") or "", name)
        left = [name for name in left if name not in matches]
    return found


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    pieces = re.split(r"(\{axis\}|\{any\}|_)", pattern.strip().strip("'\""))
    meant = {AXIS: r"(?P<axis>[^/]+?)", ANY: ".*", "_": _BETWEEN}
    text = "".join(meant.get(piece, re.escape(piece)) for piece in pieces)
    return re.compile(rf"/?{text}[\W_]*", re.IGNORECASE)
