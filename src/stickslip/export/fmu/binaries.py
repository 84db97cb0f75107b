"""Binaries of a functional mock-up unit for several platforms, by the C compiler of ziglang."""

import platform
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from stickslip.records import InputError, MissingExtraError

Platforms = Literal["all", "host", "none"]


@dataclass(frozen=True)
class Platform:
    """A platform: its system and machine, what ziglang calls it, and its folder by version."""

    system: str  # as `platform.system` has it
    machines: tuple[str, ...]  # as `platform.machine` has it
    target: str
    folders: Mapping[str, str]
    ending: str


_INTEL, _ARM = ("x86_64", "AMD64"), ("arm64", "aarch64")
PLATFORMS = (
    Platform(
        "Linux", _INTEL, "x86_64-linux-gnu.2.17", {"2.0": "linux64", "3.0": "x86_64-linux"}, ".so"
    ),
    Platform(
        "Windows", _INTEL, "x86_64-windows-gnu", {"2.0": "win64", "3.0": "x86_64-windows"}, ".dll"
    ),
    Platform(
        "Darwin", _INTEL, "x86_64-macos", {"2.0": "darwin64", "3.0": "x86_64-darwin"}, ".dylib"
    ),
    # Version 2.0 has no folder for these
    Platform("Darwin", _ARM, "aarch64-macos", {"3.0": "aarch64-darwin"}, ".dylib"),
    Platform("Linux", _ARM, "aarch64-linux-gnu.2.17", {"3.0": "aarch64-linux"}, ".so"),
)
_OPTIONS = (
    *("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-fPIC"),
    *("-g0", "-s", "-DFMI3_OVERRIDE_FUNCTION_PREFIX"),
)


def binaries(
    sources: Mapping[str, str], unit: str, identifier: str, version: str, platforms: Platforms
) -> dict[str, bytes]:
    """Return the shared libraries of platforms, by their path in the file.

    ``unit`` is the source to compile, ``identifier`` the name of the library; the version of the
    interface names the folders. They need ziglang (MissingExtraError).
    """
    if platforms == "none":
        return {}
    chosen = [each for each in PLATFORMS if version in each.folders]
    if platforms == "host":
        here = (platform.system(), platform.machine())
        chosen = [each for each in chosen if here[0] == each.system and here[1] in each.machines]
        if not chosen:
            raise InputError("fmu_host_unknown", machine=" ".join(here), version=version)
    if find_spec("ziglang") is None:
        raise MissingExtraError(
            "building the binaries of a functional mock-up unit (its sources need none: "
            "--binaries none)",
            extra="fmu",
        )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for source, text in sources.items():
            (folder / source).write_text(text, encoding="utf-8")
        return {
            f"binaries/{each.folders[version]}/{identifier}{each.ending}": _built(
                each, folder, unit, identifier
            )
            for each in chosen
        }


def _built(chosen: Platform, folder: Path, unit: str, identifier: str) -> bytes:
    """Return the library of a platform."""
    out = f"{identifier}{chosen.ending}"  # a library of macOS contains this path
    command = [sys.executable, "-m", "ziglang", "cc", "-target", chosen.target, *_OPTIONS]
    command += ["-o", out, unit, *([] if chosen.system == "Windows" else ["-lm"])]
    subprocess.run(command, check=True, cwd=folder, capture_output=True)  # noqa: S603
    return (folder / out).read_bytes()
