"""Damaged files of every format are read or refused; ``benchmarks.fuzzing`` reads many more."""

import subprocess
import sys
from pathlib import Path

import pytest

MUTATIONS = 1000


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
@pytest.mark.slow
def test_damaged_files_are_refused():
    # In a process of its own: a child's memory counts from that of the process that forks it.
    # The command ends with 1 after a fault, a hang or a process of more than 1 GB.
    command = (sys.executable, "-m", "benchmarks.fuzzing", "--mutations", str(MUTATIONS))
    outcome = subprocess.run(
        (*command, "--seed", "3"),
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert outcome.returncode == 0, outcome.stdout
    assert f"{MUTATIONS} files of" in outcome.stdout
    assert "'read': " in outcome.stdout
