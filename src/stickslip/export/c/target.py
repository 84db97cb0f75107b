"""``stickslip export c``: a folder of C99 code for a drive."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stickslip.export.base import (
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Group,
    Rendered,
    axis_in_words,
    only_axis,
)
from stickslip.export.parameters import SLIDING
from stickslip.export.templates import heading, notes_on, number
from stickslip.export.transmission import Side

if TYPE_CHECKING:
    from stickslip.export.c.content import CodeContent

_WHAT = {
    "law": "friction force and feedforward; no state",
    "pulses": "exact pulse controller",
    "kalman": "extended Kalman filter of friction",
    "energy": "online energy estimator of friction",
}


@dataclass(frozen=True, kw_only=True)
class CodeExporter(Exporter):
    """C99 code: friction law, pulse controller, Kalman filter and energy estimator."""

    name: str = "c"
    title: str = "C99 code for a drive, with tests"
    group: Group = "code"
    side: Side | None = None
    represents: tuple[str, ...] = (
        *("mass", "inertia", *SLIDING, "offset", "quadratic_friction", "two_thirds_friction"),
        *("low_speed_friction", "low_speed_velocity"),
    )
    ending: str = ""
    several: bool = False
    options: tuple[str, ...] = ("precision", "sampling_time")

    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return the files of the folder; see `Exporter.render`."""
        from stickslip.export.c.content import derived_content

        del into
        name, parameters = only_axis(axes, self.title)
        derived = derived_content(
            name,
            parameters,
            sampling_time=settings.sampling_time,
            precision=settings.precision,
            banner=parameters.source.text,
        )
        notes = notes_on(self, axes, *(each[0].upper() + each[1:] for each in derived.notes))
        lines = heading(self, axes, notes)[1:]  # the origin is the first line of every file
        return Rendered(files=folder(derived.content, lines), notes=notes)


def folder(content: "CodeContent", notes: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the files of exported C code by relative path, with notes for the README."""
    from stickslip import __version__
    from stickslip.export.c.folder import context, parts_of, sources, template
    from stickslip.export.c.vectors import vectors_of

    parts = parts_of(content)
    names = [part.module.name for part in parts]
    files = {f"src/{name}": text for name, text in sources(content).items()}
    for part in parts:
        filled = context(part, content)
        vectors = vectors_of(part, content).hexadecimal
        name = part.module.name
        files[f"test/vectors_{name}.h"] = template("vectors.h", m=filled, v=vectors)
        files[f"test/test_{name}.c"] = template(f"test_{part.template}.c", m=filled)
    common = _common(content, parts, notes) | {"names": names, "version": __version__}
    files["test/check.h"] = template("check.h", **common)
    files["examples/example.c"] = template("example.c", **common)
    files["examples/feedforward/feedforward.ino"] = template("feedforward.ino", **common)
    for name in ("README.md", "Makefile", "CMakeLists.txt", "library.properties", "MISRA.md"):
        files[name] = template(name, **common)
    files["stickslip_law.st"] = template("law.st", **common)
    return files


def _common(content: "CodeContent", parts: Any, notes: tuple[str, ...]) -> dict[str, Any]:
    """Return what the files beside the modules are filled with."""
    from stickslip.export.c.folder import FLOAT_BOUNDS, LIBRARY_FUNCTIONS
    from stickslip.export.c.memory import state_bytes

    law = content.law
    names = {part.module.name for part in parts}
    return {
        "axis": axis_in_words(content.axis),
        "label": re.sub(r"\W", "_", content.axis),
        "banner": content.banner,
        "notes": notes,
        "precision": content.precision,
        "rotary": content.kind == "rotary",
        "velocity": content.velocity_measured,
        "sampling_time": content.sampling_time,
        "controller": content.controller,
        "has": {name: name in names for name in _WHAT},
        "functions": LIBRARY_FUNCTIONS,
        "exponent": law.exponent,
        "modules": [
            {
                "name": part.module.name,
                "what": _WHAT[part.module.name],
                "float_bound": FLOAT_BOUNDS.get(part.module.name),
                "config": [state_bytes(part.module, "config", real) for real in _reals(part)],
                "state": [state_bytes(part.module, "state", real) for real in _reals(part)],
            }
            for part in parts
        ],
        **_law_table(content),
    }


def _reals(part: Any) -> tuple[int, int]:
    """Return the bytes of a number in float and in double."""
    return (8, 8) if part.names.get("real") == "double" else (4, 8)


def _law_table(content: "CodeContent") -> dict[str, Any]:
    """Return the values of the law for the README and for structured text."""
    from stickslip.export.c.kernels import friction
    from stickslip.records import mass_name, unit_of

    law, kind = content.law, content.kind
    record = law.numbers(content.inertia, content.dead_band).view(friction.LAW)[0]
    effort, viscous = unit_of("effort", kind), unit_of("viscous_friction", kind)
    velocity = unit_of("velocity", kind)
    both = [
        ("Coulomb friction", "f_c", law.coulomb, effort),
        ("static friction", "f_s", law.static, effort),
        ("viscous friction", "c", law.viscous, viscous),
    ]
    single = [
        (mass_name(kind), "", content.inertia, unit_of(mass_name(kind), kind)),
        ("offset", "", law.offset, effort),
        ("Stribeck velocity", "v_s", law.stribeck_velocity, velocity),
        ("quadratic friction", "q", law.quadratic, unit_of("quadratic_friction", kind)),
        ("two-thirds friction", "p", law.two_thirds, unit_of("two_thirds_friction", kind)),
        ("friction of low speeds", "l", law.low_speed, effort),
        ("its velocity", "v_l", law.low_speed_velocity, velocity),
        ("dead band of the feedforward", "", content.dead_band, velocity),
    ]
    constants: list[tuple[str, float]] = []
    for name in friction.LAW.names or ():
        values = record[name]
        if values.shape:
            constants += [(f"{name}_positive", values[0]), (f"{name}_negative", values[1])]
        elif name != "exponent":
            constants.append((name, values))
    return {
        "both": [(n, s, (number(a), number(b)), u) for n, s, (a, b), u in both],
        "single": [(n, s, number(value), u) for n, s, value, u in single if value],
        "constants": [(name.upper(), _structured_text(value)) for name, value in constants],
    }


def _structured_text(value: float) -> str:
    """Return a number as IEC 61131-3 writes it: with a decimal point.

    >>> _structured_text(1e-07), _structured_text(20.0)
    ('1.0E-07', '20.0')
    """
    mantissa, _, exponent = repr(float(value)).partition("e")
    mantissa = mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{mantissa}E{exponent}" if exponent else mantissa
