"""The stored 30-digit reference runs, as doubles."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from jaxtyping import Float, Int

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass

_FOLDER = Path(__file__).parents[1] / "tests" / "references"


@dataclass(frozen=True, kw_only=True)
class ReferenceRun:
    """A problem and what the reference found at some of its samples."""

    name: str  #: What the case is called.
    plant: SingleMass | FlexibleArm  #: The plant with its friction.
    sampling_time: float  #: [s].
    initial_state: tuple[float, ...]  #: (x, v) or (x1, v1, x2, v2).
    effort_runs: tuple[tuple[float, int], ...]  #: Pairs (effort [N], number of samples it is held).
    #: Indexes of the kept samples, shape (k,), and the states there, shape (k, 2 or 4).
    samples: Int[np.ndarray, " k"]
    states: Float[np.ndarray, "k s"]
    touches: int  #: How often the velocity touched zero without crossing it.

    @property
    def effort(self) -> Float[np.ndarray, " n"]:
        """Effort of each sample [N]."""
        values, counts = zip(*self.effort_runs, strict=True)
        return np.repeat(np.array(values, dtype=np.float64), counts)

    def position_error(self, states: Float[np.ndarray, "n+1 s"]) -> float:
        """Return the largest position error [m] of a run with all its states."""
        return float(np.abs(states[self.samples, ::2] - self.states[:, ::2]).max())


def reference_runs(name: str) -> list[ReferenceRun]:
    """Read one file of stored runs: ``design_case``, ``flexible_arm`` or ``single_mass``."""
    stored = json.loads((_FOLDER / f"{name}.json").read_text())
    return [_run(record) for record in stored["runs"]]


def _run(record: dict[str, Any]) -> ReferenceRun:
    case = record["case"]
    friction = CoulombViscousFriction(
        coulomb_friction_positive=case["coulomb"][0],
        coulomb_friction_negative=case["coulomb"][1],
        static_friction_positive=case["static"][0],
        static_friction_negative=case["static"][1],
        viscous_friction_positive=case["viscous"][0],
        viscous_friction_negative=case["viscous"][1],
        offset=case["offset"],
    )
    parts = cast("dict[str, float]", case["plant"])
    if "mass" in parts:
        plant = SingleMass(mass=parts["mass"], friction=friction)
    else:
        plant = FlexibleArm(
            mass_1=parts["mass_1"],
            mass_2=parts["mass_2"],
            stiffness=parts["stiffness"],
            friction=friction,
        )
    rows = cast("list[list[str]]", record["states"])
    return ReferenceRun(
        name=case["name"],
        plant=plant,
        sampling_time=case["sampling_time"],
        initial_state=tuple(case["initial_state"]),
        effort_runs=tuple((value, count) for value, count in case["effort_runs"]),
        samples=np.array([int(row[0]) for row in rows]),
        states=np.array([[float(value) for value in row[1:]] for row in rows]),
        touches=record["events"]["touch"],
    )
