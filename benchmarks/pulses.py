"""Time of pulse controllers: a sample of rest, and the sample in which a pulse is planned."""

from collections.abc import Callable
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
from rich.progress import Progress

from benchmarks.measuring import Comparison, Rows, Target
from stickslip.compiled import compiled
from stickslip.control import (
    ExactPulseController,
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
    RestDetection,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw
from stickslip.plants import SingleMass
from stickslip.records import SensorSample
from stickslip.simulation import Sensors, simulate_closed_loop

_MASS, _EFFORT, _T, _STEP = 150.0, 300.0, 0.001, 1e-6
_FRICTION = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
)
_SAMPLES = 20_000
_DRIVE = 250.0
"""Goal for the longest sample [us]: a quarter of the period of this loop."""


def _controllers() -> dict[str, PulseController]:
    rest = RestDetection.for_encoder(resolution=_STEP, noise=_STEP, samples=10)
    given: dict[str, Any] = {
        "mass": _MASS,
        "coulomb_friction": 80.0,
        "pulse_effort": _EFFORT,
        "sampling_time": _T,
        "target": 0.01,
        "tolerance": 2e-5,
        "rest": rest,
    }
    return {
        "exact law": ExactPulseController(
            sampling_time=_T,
            target=0.01,
            tolerance=2e-5,
            rest=rest,
            effort_limit=_EFFORT,
            mass=_MASS,
            friction=CoulombViscousFriction.symmetric(
                coulomb_friction=80.0, viscous_friction=400.0
            ),
            position_noise=_STEP * sqrt(13.0 / 12.0),
        ),
        "PAPWC": replace(
            PulseAmplitudeWidthController.from_friction(**given), max_idle_pulses=None
        ),
        "PWC": replace(PulseWidthController.from_friction(**given), max_idle_pulses=None),
    }


@compiled(cached=False)
def _compiled_steps(step: Any, state: Any, sample: Any, count: int) -> Any:
    for _ in range(count):
        state, _effort = step(state, sample)
    return state


def _python_steps(step: Any, state: Any, sample: Any, count: int) -> Any:
    for _ in range(count):
        state, _effort = step(state, sample)
    return state


def _planning_sample(controller: PulseController) -> tuple[Any, SensorSample]:
    """Return the state and the sample in which the first pulse is learned from and planned on."""
    run = simulate_closed_loop(
        SingleMass(mass=_MASS, friction=_FRICTION),
        controller,
        sampling_time=_T,
        samples=500,
        sensors=Sensors(position_noise=_STEP, encoder_step=_STEP, velocity="none"),
        generator=np.random.default_rng(1),
    )
    state, step = controller.init(), controller.step
    for time, position in zip(run.log.time, run.log.measured_position, strict=True):
        sample = SensorSample(float(time), float(position), np.nan, np.nan, np.nan)
        after, _ = step(state, sample)
        if controller.pulse_count(after) == 1:
            return state, sample
        state = after
    raise RuntimeError("no pulse has ended")


def compare(progress: Progress) -> list[Comparison]:
    """Time the steps of pulse controllers, and the law that they plan by."""
    controllers = _controllers()
    rows = Rows(progress, "pulse controllers", total=2 * len(controllers))
    for name, controller in controllers.items():
        state = controller.init()
        sample = SensorSample(0.0, 0.01, np.nan, np.nan, np.nan)  # at rest on the target
        loops: tuple[tuple[str, Callable[..., Any]], ...] = (
            ("compiled", _compiled_steps),
            ("from Python", _python_steps),
        )
        for how, loop in loops:
            rows.add(
                f"{name}, {how}",
                lambda loop=loop, c=controller, s=state, z=sample: loop(c.step, s, z, _SAMPLES),
                _SAMPLES,
                repetitions=5,
                ours=True,
            )
    planning = Rows(progress, "learning and planning", total=len(controllers) + 2)
    for name, controller in controllers.items():
        state, sample = _planning_sample(controller)
        planning.add(
            f"{name}, learns and plans",
            lambda c=controller, s=state, z=sample: c.step(s, z),
            1,
            repetitions=200,
            ours=True,
        )
    law = PulseLaw.of(SingleMass(mass=_MASS, friction=_FRICTION))
    displacements = np.linspace(1e-4, 1e-2, 1000)
    planning.add(
        "PulseLaw.width_for, an array of 1000",
        lambda: law.width_for(displacements, effort=_EFFORT),
        1000,
        repetitions=20,
        ours=True,
    )
    planning.add(
        "PulseLaw.effort_for, an array of 1000",
        lambda: law.effort_for(displacements, width=0.1),
        1000,
        repetitions=20,
        ours=True,
    )
    return [
        Comparison(
            title="A sample of a pulse controller at rest, encoder only",
            item="sample",
            error_name=None,
            rows=tuple(rows.rows),
        ),
        Comparison(
            title="The sample in which a pulse has ended, and the next begins",
            item="call",
            error_name=None,
            rows=tuple(planning.rows),
            targets=(
                Target(
                    text="longest sample of the exact controller [µs]",
                    measured=planning.rows[0].nanoseconds / 1e3,
                    limit=_DRIVE,
                ),
            ),
        ),
    ]
