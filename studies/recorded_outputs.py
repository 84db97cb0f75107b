"""Record the outputs of the commands, to compare two versions of the code.

    python -m studies.recorded_outputs record --out BEFORE.json
    python -m studies.recorded_outputs compare BEFORE.json AFTER.json --tolerance 1e-12

Recorded are the JSON of `identify` with every estimator on the log of `demo`, of `compare` on that
log and on the scenarios in examples/comparisons, and of `position` on those in examples/scenarios,
and the positions and velocities of a simulated mass and arm. Versions and computing times are left
out.
"""

import json
import math
import os
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

_EXAMPLES = Path(__file__).parents[1] / "examples"
_LEFT_OUT = frozenset({"version", "stickslip_version", "seconds_per_sample"})
_RUNS = "3"
_SHOWN = 20


def record() -> dict[str, Any]:
    """Return everything recorded, by the command that gives it."""
    found: dict[str, Any] = {}
    with TemporaryDirectory() as folder:
        out = Path(folder)
        _command("demo", "--out", str(out))
        log = str(out / "surrogate_arm.csv")
        found["demo"] = json.loads((out / "estimate.json").read_text())
        given = ("--inertia", "1", "--load-inertia", "1", "--stiffness", "1")
        for name in _estimators():
            found[f"identify --estimator {name}"] = _json("identify", log, "--estimator", name)
            found[f"identify --estimator {name}, axis given"] = _json(
                "identify", log, "--estimator", name, *given
            )
        found["compare"] = _json("compare", log)
        for scenario in sorted((_EXAMPLES / "comparisons").glob("*.toml")):
            found[f"compare {scenario.stem}"] = _json("compare", str(scenario), "--runs", _RUNS)
        for scenario in sorted((_EXAMPLES / "scenarios").glob("*.toml")):
            found[f"position {scenario.stem}"] = _json("position", str(scenario))
    found["simulate"] = _simulated()
    return found


def differences(before: Any, after: Any, tolerance: float, where: str = "") -> Iterator[str]:
    """Yield a line for every value that differs by more than a relative tolerance."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted(before.keys() | after.keys()):
            if key in _LEFT_OUT:
                continue
            if key not in before or key not in after:
                yield f"{where}/{key}: only {'after' if key in after else 'before'}"
            else:
                yield from differences(before[key], after[key], tolerance, f"{where}/{key}")
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            yield from differences(old, new, tolerance, f"{where}/{k}")
    elif isinstance(before, float) and isinstance(after, float):
        same = before == after or (math.isnan(before) and math.isnan(after))
        if not same and not math.isclose(before, after, rel_tol=tolerance):
            yield f"{where}: {before!r} -> {after!r}"
    elif before != after:
        yield f"{where}: {before!r} -> {after!r}"


def _command(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command of the package."""
    done = subprocess.run(  # noqa: S603 - the command is this module's own
        [sys.executable, "-m", "stickslip", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "COLUMNS": "100"},
    )
    if done.returncode in (70, 130, 143):
        raise RuntimeError(f"stickslip {' '.join(arguments)}: {done.stderr}")
    sys.stderr.write(f"stickslip {' '.join(arguments[:4])}\n")
    return done


def _json(*arguments: str) -> Any:
    """Return the JSON that a command prints, or its refusal."""
    done = _command(*arguments, "--json", "-")
    if done.returncode == 2:
        # The folder of the log is another one each time
        return {"refused": done.stderr.split(": ", 2)[-1]}
    return {"code": done.returncode, **json.loads(done.stdout)}


def _estimators() -> tuple[str, ...]:
    """Return the names of all estimators."""
    from stickslip import ESTIMATORS

    return tuple(ESTIMATORS)


def _simulated() -> dict[str, list[float]]:
    """Return positions and velocities of a mass and an arm under the same efforts."""
    from stickslip.friction import CoulombViscousFriction
    from stickslip.plants import FlexibleArm, SingleMass
    from stickslip.simulation import simulate

    law = CoulombViscousFriction.symmetric(
        coulomb_friction=1.0, static_friction=1.5, viscous_friction=0.4
    )
    effort = 3.0 * np.sin(0.05 * np.arange(2000)) * np.sin(0.003 * np.arange(2000))
    found: dict[str, list[float]] = {}
    for plant in (
        SingleMass(mass=1.3, friction=law),
        FlexibleArm(mass_1=1.0, mass_2=0.7, stiffness=80.0, friction=law),
    ):
        motion = simulate(plant, effort, sampling_time=0.01)
        name = type(plant).__name__
        found[f"{name} position"] = motion.position[::10].tolist()
        found[f"{name} velocity"] = motion.velocity[::10].tolist()
    return found


def main() -> int:
    """Record, or compare two records; the exit code is 1 where they differ."""
    parser = ArgumentParser(description=__doc__)
    tasks = parser.add_subparsers(dest="task", required=True)
    recording = tasks.add_parser("record")
    recording.add_argument("--out", type=Path, required=True)
    comparing = tasks.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    comparing.add_argument("--tolerance", type=float, default=0.0)
    given = parser.parse_args()
    if given.task == "record":
        given.out.write_text(json.dumps(record()))
        return 0
    before, after = (json.loads(path.read_text()) for path in (given.before, given.after))
    found = list(differences(before, after, given.tolerance))
    for line in found[:_SHOWN]:
        sys.stdout.write(f"{line}\n")
    sys.stdout.write(f"{len(found)} values differ by more than {given.tolerance:g}\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
