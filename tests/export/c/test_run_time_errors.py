"""Absence of run-time errors of exported C code, shown by Frama-C."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from eva_programs import program
from exported_code import CONTENTS

from stickslip.export.c.content import CodeContent
from stickslip.export.c.folder import Part, parts_of, sources

OPTIONS = [
    "-eva",
    "-eva-precision=3",
    "-eva-domains=octagon",
    "-eva-octagon-through-calls",
    "-eva-no-print",
    "-warn-special-float=none",  # NaN and infinity are values like others
    "-warn-signed-downcast",
]


def analysed(folder: Path, part: Part, content: CodeContent, entry: str, arithmetic: str) -> str:
    """Return what Frama-C prints of an entry of the program of a module."""
    if shutil.which("frama-c") is None:
        pytest.skip("frama-c is not found")
    for file, text in {**sources(content), "program.c": program(part)}.items():
        if not (folder / file).exists():
            (folder / file).write_text(text)
    name = part.module.name
    units = ["program.c", f"stickslip_{name}.c", f"stickslip_{name}_config.c"]
    paths = [str(folder / each) for each in units]  # relative ones would be to the shell's folder
    defined = f"-cpp-extra-args=-DSTICKSLIP_{arithmetic}"
    done = subprocess.run(
        ["frama-c", *OPTIONS, defined, "-main", entry, *paths],  # noqa: S607
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout


def module(name: str) -> tuple[Part, CodeContent]:
    content = CONTENTS["measured"]
    (part,) = [part for part in parts_of(content) if part.module.name == name]
    return part, content


def proved(out: str) -> bool:
    """Return whether there is no alarm and all assertions hold."""
    assert "done for function" in out
    return "  0 alarms generated" in out and not re.search(
        r"assertion got status|[1-9]\d* unknown", out
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [
        *((name, "DOUBLE") for name in ("law", "pulses", "kalman", "energy")),
        *((name, "FLOAT") for name in ("law", "pulses", "kalman")),  # energy computes in double
    ],
)
def test_no_call_has_a_run_time_error(name: str, arithmetic: str, tmp_path: Path) -> None:
    part, content = module(name)
    for entry in ("begin", "call") if part.module.layout is not None else ("call",):
        assert proved(analysed(tmp_path, part, content, entry, arithmetic)), entry


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pattern", "wrong"),
    [
        (r"memory\[192\]", "memory[191]"),  # an index beyond the end
        (r"stored = vector->own.stored \+ 1", "stored = vector->own.stored + 2"),  # no invariant
        (r"resets = s->resets \+ 1", "resets = s->resets * 4096"),  # an overflow
    ],
)
def test_defects_are_found(pattern: str, wrong: str, tmp_path: Path) -> None:
    part, content = module("kalman")
    for file, text in sources(content).items():
        (tmp_path / file).write_text(re.sub(pattern, wrong, text))
    assert not proved(analysed(tmp_path, part, content, "call", "DOUBLE"))
