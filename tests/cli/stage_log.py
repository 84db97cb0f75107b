"""The log that the tests of the command line work on, and what a run of it gives."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from two_sines import Motion

MASS, COULOMB, VISCOUS, OFFSET = 3.0, 1.5, 4.0, 0.2


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Exit code and what was printed."""

    code: int
    out: str
    err: str

    def printed(self, code: int = 0) -> str:
        """Return the text on standard output, of a run that ended with this code."""
        assert self.code == code, self.err
        return self.out

    def line(self) -> str:
        """Return the one line of a refusal."""
        assert self.out == ""
        notice = "stickslip: compiling the kernels"  # once, on a machine without them
        lines = [line for line in self.err.splitlines() if not line.startswith(notice)]
        assert len(lines) == 1, self.err
        assert lines[0].startswith("stickslip: ")
        return lines[0]

    def refused(self, *words: str) -> str:
        """Check that the input was refused with these words; return the line."""
        assert self.code == 2, self.err
        line = self.line()
        for word in words:
            assert word in line, line
        return line


Run = Callable[..., Outcome]


def runner(main: Callable[[list[str]], int], capsys: pytest.CaptureFixture[str]) -> Run:
    """Return a function that runs a command line inside the test process."""

    def run_main(*arguments: object) -> Outcome:
        code = main([str(each) for each in arguments])
        captured = capsys.readouterr()
        return Outcome(code=code, out=captured.out, err=captured.err)

    return run_main


def table(samples: int = 4000) -> dict[str, np.ndarray]:
    """Return the columns of a log of a mass with friction on a motion of two sines."""
    motion = Motion(time=np.arange(samples) * 0.002)
    effort = motion.effort(mass=MASS, viscous=VISCOUS, coulomb=COULOMB, offset=OFFSET)
    noise = np.random.default_rng(5).normal(0.0, 0.02, samples)
    return {
        "time [s]": motion.time,
        "position [m]": motion.position,
        "force [N]": effort + noise,
    }


def csv_text(columns: dict[str, np.ndarray]) -> str:
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(f"{x:.9g}" for x in row) for row in rows)]
    return "\n".join(lines) + "\n"
