"""Compilation of kernels: the notice, and the cache on disk."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from stickslip.records import SensorSample

pytestmark = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")

SCRIPT = """\
import sys

import numba

from added import step
from stickslip.compiled import compiled


def add_one(x: float) -> float:
    return step(x) + 1.0


add_one.__module__ = "stickslip.added"
sys.modules["stickslip.added"] = sys.modules["__main__"]
print(compiled(cached=sys.argv[1:] != ["not cached"])(add_one)(1.0), numba.config.CACHE_DIR)
"""

CALLEE = """\
from stickslip.compiled import compiled


@compiled()
def step(x: float) -> float:
    return x * {factor}
"""

NOTICE = "stickslip: compiling the kernels"


@pytest.fixture
def script(tmp_path: Path) -> Path:
    """Return a script whose kernel calls another one, of another folder."""
    (tmp_path / "callee").mkdir()
    (tmp_path / "callee" / "added.py").write_text(CALLEE.format(factor=1.0))
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    return path


def run(script: Path, *arguments: str, cache: str = "cache") -> subprocess.CompletedProcess[str]:
    folder = script.parent
    return subprocess.run(
        [sys.executable, str(script), *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        env={
            **os.environ,
            "NUMBA_CACHE_DIR": str(folder / cache),
            "PYTHONPATH": os.pathsep.join([str(folder / "callee"), *sys.path]),
        },
    )


def _cut(whole: bytes) -> bytes:
    return whole[: len(whole) // 2].rstrip(b".")


def value(done: subprocess.CompletedProcess[str]) -> str:
    return done.stdout.split()[0]


def test_the_notice_is_about_kernels_that_are_kept(script: Path) -> None:
    done = [run(script, *how) for how in (["not cached"], [], [])]
    assert [value(each) for each in done] == ["2.0"] * 3
    assert [each.stderr.count(NOTICE) for each in done] == [0, 1, 0]


def test_the_setting_of_numba_is_left_as_it_was(script: Path) -> None:
    assert run(script).stdout.split()[1] == str(script.parent / "cache")


def test_a_change_of_a_kernel_that_is_called_is_noticed(script: Path) -> None:
    assert value(run(script)) == "2.0"
    (script.parent / "callee" / "added.py").write_text(CALLEE.format(factor=10.0))
    assert value(run(script)) == "11.0"


@pytest.mark.slow
def test_a_change_of_a_constant_of_another_folder_is_noticed(tmp_path: Path) -> None:
    """Machine code contains the constants that its module imports."""
    package = tmp_path / "callee" / "axis"
    (package / "deep").mkdir(parents=True)
    for folder in (package, package / "deep"):
        (folder / "__init__.py").write_text("")
    constants = package / "deep" / "constants.py"
    constants.write_text("FACTOR = 1.0\n")
    (package / "layout.py").write_text("from axis.deep.constants import FACTOR\n\nPLACE = FACTOR\n")
    (package / "kernel.py").write_text(
        "from axis.layout import PLACE\nfrom stickslip.compiled import compiled\n\n\n"
        "@compiled()\ndef step(x: float) -> float:\n    return x * PLACE\n"
    )
    path = tmp_path / "script.py"
    path.write_text("from axis.kernel import step\n\nprint(step(1.0))\n")
    assert value(run(path)) == "1.0"
    constants.write_text("FACTOR = 10.0\n")
    assert value(run(path)) == "10.0"


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        ("nbi", b""),
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                ("nbi", b"\0" * 4096),
                ("nbi", None),
                ("nbc", b""),
                ("nbc", b"\0" * 4096),
                ("nbc", None),
            )
        ),
    ],
)
def test_a_damaged_cache_is_compiled_anew(script: Path, suffix: str, content: bytes | None) -> None:
    """As after a power loss: emptied, blanked, or cut off in the middle."""
    run(script)
    files = list((script.parent / "cache").rglob(f"*.{suffix}"))
    assert files
    for path in files:
        whole = path.read_bytes()
        path.write_bytes(_cut(whole) if content is None else content)
    done = run(script)
    assert value(done) == "2.0"
    assert "is damaged; its kernels are compiled anew" in done.stderr
    assert not run(script).stderr


def test_without_a_folder_to_write_kernels_are_compiled_in_memory(script: Path) -> None:
    (script.parent / "file").write_text("")
    done = run(script, cache="file/cache")
    assert value(done) == "2.0"
    assert "set NUMBA_CACHE_DIR" in done.stderr


def test_kernels_that_were_not_used_for_thirty_days_are_removed(script: Path) -> None:
    """Of this package only; looked for whenever there are new sources."""
    ages = {"stickslip-older": 30.01, "stickslip-younger": 29.99, "other-older": 31.0}
    cache = script.parent / "cache"
    for name, days in ages.items():
        (cache / name).mkdir(parents=True)
        (cache / name / "kernel.nbi").write_bytes(b".")
        used = time.time() - days * 86400.0
        os.utime(cache / name, (used, used))
    script.write_text("import added\n")
    run(script)
    assert {path.name for path in cache.iterdir()} >= {"stickslip-younger", "other-older"}
    assert not (cache / "stickslip-older").exists()


def test_the_folder_of_an_argument_class_is_watched() -> None:
    """A cached kernel names the module of such a class, and cannot be loaded after it has moved."""
    from stickslip.control import PIDController

    controller = PIDController(
        sampling_time=0.01,
        target=0.0,
        position_gain=1.0,
        integral_gain=0.0,
        velocity_gain=0.0,
        effort_limit=1.0,
    )
    folder = Path(sys.modules[SensorSample.__module__].__file__ or "").parent
    kernel: Any = controller.step
    assert kernel.stickslip_sources > {folder}
