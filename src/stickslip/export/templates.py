"""Text of exported files: Jinja2 templates, numbers, and what stands at the head."""

import json
from functools import cache
from typing import Any

from stickslip.export.base import Axes, Exporter, prefix, quantities_used
from stickslip.export.parameters import ExportParameters


def number(value: float) -> str:
    """Return a number with all digits that it needs to be read back as it is.

    >>> number(0.1), number(20.0), number(1e-07)
    ('0.1', '20.0', '1e-07')
    """
    return repr(float(value))


def quoted(text: str) -> str:
    """Return a text as a string literal in double quotes, as Python and Modelica have them.

    >>> quoted("elbow"), quoted('a"b') == '"a' + chr(92) + '"b"'
    ('"elbow"', True)
    """
    return json.dumps(text)


def docstring_line(text: str) -> str:
    """Return a line that neither ends a docstring nor escapes anything in it."""
    return text.replace("\\", "/").replace('"', "'")


def filled_in(package: str, template: str, **context: Any) -> str:
    """Return a template of the folder ``templates`` of a package, filled in.

    Undefined names are errors; the filters are `number`, `quoted` and, as ``comment``,
    `docstring_line`.
    """
    return str(_environment(package).get_template(template).render(**context))


@cache
def _environment(package: str) -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(package, "templates"),
        undefined=StrictUndefined,
        autoescape=False,  # noqa: S701 - code and data, no HTML
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": number, "quoted": quoted, "comment": docstring_line}
    return environment


def notes_on(exporter: Exporter, axes: Axes, *extra: str) -> tuple[str, ...]:
    """Return what a target does not represent of some axes, one sentence each."""
    return (
        *(
            prefix(name, axes) + sentence
            for name, parameters in axes.items()
            for sentence in parameters.omissions(
                exporter.title, exporter.represents, exporter.cannot
            )
        ),
        *extra,
    )


def heading(
    exporter: Exporter,
    axes: Axes,
    notes: tuple[str, ...],
    units: str | None = None,
) -> tuple[str, ...]:
    """Return the lines at the head of a file.

    They are origin, side and units (SI, unless others are named), what was forced, what was
    withheld, and the notes.
    """
    lines: list[str] = []
    for name, parameters in axes.items():
        forced = parameters.warnings(quantities_used(exporter))
        own = (
            parameters.source.text,
            side_of(parameters, units),
            *(f"WARNING: {each}" for each in forced),
            *parameters.missing(exporter.represents),
        )
        lines += [prefix(name, axes) + each for each in own]
    return (*lines, *notes)


def side_of(parameters: ExportParameters, units: str | None = None) -> str:
    """Return one sentence on the side and the units of the values, SI if none are named."""
    ratio = parameters.transmission.ratio()
    si = "SI units, rad and N m" if parameters.kind == "rotary" else "SI units, m and N"
    units = si if units is None else units
    if ratio is None:
        return f"Values of the {parameters.side} side, {units}"
    if parameters.side == parameters.transmission.side:
        return f"Values of the {parameters.side} side, as identified, {units}"
    moved = {"rotary": "rad per rad", "linear": "m per m"}[parameters.kind]
    moved = moved if parameters.transmission.lead is None else "rad per m"
    return (
        f"Values of the {parameters.side} side, identified on the {parameters.transmission.side} "
        f"side, {units}; the motor moves {ratio:.9g} {moved} of the joint"
    )
