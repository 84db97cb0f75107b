"""The file of a functional mock-up unit: description, sources, binaries and documentation."""

import hashlib
import io
import re
import zipfile
from typing import Any, Literal

from stickslip import __version__
from stickslip.export.fmu.binaries import Platforms, binaries
from stickslip.export.fmu.model import FmuModel
from stickslip.export.templates import filled_in

Version = Literal["2.0", "3.0"]

_EPOCH = (1980, 1, 1, 0, 0, 0)  # of all files in the archive, which depends on its content alone
_BASES: dict[str, dict[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    **{name: {name: 1} for name in ("kg", "m", "s", "rad")},
    "1": {},
}


def archive(
    model: FmuModel, version: Version, platforms: Platforms, banner: str, lines: tuple[str, ...]
) -> bytes:
    """Return a unit as the bytes of its file.

    The banner is one sentence on the origin, ``lines`` are sentences for its documentation.
    Binaries need ziglang (MissingExtraError), and a machine that one can be built for.
    """
    names = [each.causality for each in model.variables]
    first = 1 if version == "2.0" else 0  # of the numbers of variables
    context: dict[str, Any] = {
        "title": _xml(model.title),
        "identifier": model.identifier,
        "banner": _xml(banner),
        "sampling_time": model.sampling_time,
        "variables": model.variables,
        "most_samples": model.most_samples,
        "version": version,
        "stickslip_version": __version__,
        "lines": [_xml(line) for line in lines],
        "units": [
            (unit, base_units(unit))
            for unit in dict.fromkeys(each.unit for each in model.variables)
        ],
        "known": [k + first for k, name in enumerate(names) if name == "parameter"],
    }
    hashed = [version, repr(model.variables), *(f"{k}\n{v}" for k, v in model.sources.items())]
    digest = hashlib.sha256("\n".join([model.title, banner, *hashed]).encode()).hexdigest()
    parts = (digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])
    context["token"] = f"{{{'-'.join(parts)}}}"

    def text(name: str) -> str:
        return filled_in("stickslip.export.fmu", f"{name}.j2", **context)

    code = {**model.sources, "fmi.c": text("fmi.c")}
    files = {f"sources/{name}": source.encode() for name, source in code.items()}
    files["modelDescription.xml"] = text("modelDescription.xml").encode()
    files["documentation/index.html"] = text("index.html").encode()
    if version == "3.0":
        files["sources/buildDescription.xml"] = text("buildDescription.xml").encode()
    files |= binaries(code, "fmi.c", model.identifier, version, platforms)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as out:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, _EPOCH)
            # What the entry says of permissions depends on the machine otherwise
            entry.create_system, entry.external_attr = 3, 0o644 << 16
            out.writestr(entry, files[name], zipfile.ZIP_DEFLATED, compresslevel=9)
    return buffer.getvalue()


def _xml(text: str) -> str:
    """Return a text without the characters that no XML document may have."""
    return "".join(each if each.isprintable() else " " for each in text)


def base_units(unit: str) -> dict[str, int]:
    """Return the exponents of the base units that a unit is a product of.

    >>> base_units("N m s/rad")
    {'kg': 1, 'm': 2, 's': -1, 'rad': -1}
    """
    found: dict[str, int] = {}
    over, _, under = unit.partition("/")
    for side, sign in ((over, 1), (under, -1)):
        for name, power in re.findall(r"(\w+)(?:\^(\d+))?", side):
            for base, exponent in _BASES[name].items():
                found[base] = found.get(base, 0) + sign * exponent * int(power or 1)
    return {base: exponent for base, exponent in found.items() if exponent}
