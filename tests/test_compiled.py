"""A pause for compiling is told where a later process is spared it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """\
import sys

from stickslip.compiled import compiled


def add_one(x: float) -> float:
    return x + 1.0


add_one.__module__ = "stickslip.added"
sys.modules["stickslip.added"] = sys.modules["__main__"]
print(compiled(cached=sys.argv[1] == "cached")(add_one)(1.0))
"""


@pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="nothing is compiled")
def test_the_notice_is_about_kernels_that_are_kept(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    said = [
        subprocess.run(
            [sys.executable, str(script), how],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        )
        for how in ("not cached", "cached", "cached")
    ]
    assert [each.stdout for each in said] == ["2.0\n"] * 3
    assert ["compiling the kernels" in each.stderr for each in said] == [False, True, False]
