"""A reader that crashes, hangs or takes memory ends as an error of the file."""

import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest
from refusals import refuses

from stickslip.logs import isolation
from stickslip.logs.formats import registry
from stickslip.logs.formats.registry import FORMATS
from stickslip.logs.isolation import read_apart
from stickslip.records import InputError, MissingExtraError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")

READER = """
import os
import time
from dataclasses import replace
from stickslip.errors import InputError, MissingExtraError
from stickslip.logs.formats import registry
from stickslip.logs.table import Table

def read(path):
    kind = path.read_text()
    if kind == "crash":
        os.abort()
    if kind == "compute":
        while True:
            pass
    if kind == "slow":
        def load(names):
            end = time.process_time() + 0.9
            while time.process_time() < end:
                pass
            return {}
        return Table(label="log", headers={}, units={}, load=load, place=str)
    if kind == "memory":
        return bytearray(1 << 32)
    if kind == "recursion":
        return read(path) if path else None
    if kind == "library":
        raise MissingExtraError("reading it", extra="some")
    if kind == "own":
        raise InputError("empty_log", where=path.name)
    print("a library prints")
    raise KeyError("what\\nis that")

registry.ENTRIES = tuple(replace(each, read=read) for each in registry.ENTRIES)
"""


@pytest.fixture
def refusal(tmp_path, monkeypatch):
    """Return the error in which a reader of some conduct ends."""
    monkeypatch.setattr(
        isolation, "_CHILD", isolation._CHILD.replace("serve()", f"exec({READER!r}); serve()")
    )

    def ends(conduct, loads=0):
        path = tmp_path / "log.npz"
        path.write_text(conduct)
        with pytest.raises((InputError, MissingExtraError)) as caught:  # noqa: PT012 - all of it
            table = read_apart(FORMATS[".npz"], path)
            for _ in range(loads):
                table.load([])
        assert "\n" not in str(caught.value)
        return caught.value

    return ends


@pytest.mark.parametrize(
    ("conduct", "code"),
    [
        ("crash", "damaged_file"),
        ("memory", "reading_takes_memory"),
        ("recursion", "damaged_file"),
        ("library", "missing_extra"),
        ("own", "empty_log"),
        ("anything", "damaged_file"),
    ],
)
def test_conduct_of_a_reader(conduct, code, refusal):
    assert refusal(conduct).code == code


def test_a_reader_that_does_not_end(refusal, monkeypatch):
    monkeypatch.setattr(isolation, "_SECONDS", 1.0)
    begin = time.perf_counter()
    assert refusal("compute").code == "reading_takes_long"
    assert time.perf_counter() - begin < 60.0


def test_the_time_of_all_requests_is_limited(refusal, monkeypatch):
    monkeypatch.setattr(isolation, "_SECONDS", 1.0)
    assert refusal("slow", loads=5).code == "reading_takes_long"


ENDS = """
import os, sys
from pathlib import Path
from stickslip.logs.formats.registry import FORMATS
from stickslip.logs.isolation import read_apart

children = Path(f"/proc/self/task/{os.getpid()}/children")
table = read_apart(FORMATS[".npz"], Path(sys.argv[1]))
print(table.load(["x"])["x"].tolist(), table.place("x", 2), len(children.read_text().split()))
del table
print(len(children.read_text().split()))
"""


def test_the_other_process_ends_with_the_table(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, t=np.arange(3.0), x=np.arange(3.0) ** 2)
    done = subprocess.run(
        [sys.executable, "-c", ENDS, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == ["[0.0, 1.0, 4.0] log.npz, x at index 2 1", "0"]


def test_a_small_file_that_asks_for_much_memory(tmp_path):
    """An array of zeros in a compressed archive is a thousandth of its size."""
    path = tmp_path / "log.npz"
    header = {"descr": "<f8", "fortran_order": False, "shape": (120_000_000,)}
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("x.npy", "w") as file,
    ):
        np.lib.format.write_array_header_1_0(file, header)
        for _ in range(120):
            file.write(bytes(8_000_000))
    assert path.stat().st_size < 5_000_000
    with refuses("reading_takes_memory"):
        read_apart(FORMATS[".npz"], path)


def test_the_limits_grow_with_the_file():
    small, large = isolation.memory_limit(0), isolation.memory_limit(10**9)
    assert small < 1e9 < large
    assert isolation.time_limit(0) < 10.0 < isolation.time_limit(10**9)


def test_every_entry_is_found_by_its_name():
    for entry in FORMATS.values():
        assert registry.format_named(entry.name) is entry
