"""Test vectors of exported code: samples, and what the compiled Python kernels make of them."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import ExactPulseController
from stickslip.control.pulses.kernel import head
from stickslip.export.c.content import CodeContent
from stickslip.export.c.folder import Part, hexadecimal
from stickslip.export.c.kernels import deviations, friction
from stickslip.export.c.law import CodeLaw
from stickslip.friction import CoulombViscousFriction
from stickslip.numerics.named_fields import fields_at
from stickslip.plants import SingleMass
from stickslip.records import SensorSample
from stickslip.simulation.kernels.single_mass import mass_step
from stickslip.simulation.plant_kernels import initial_kernel_state, kernel_model

_SAMPLES = 420  # of a recorded motion
_LAW_POINTS = 41  # speeds at which the law is compared
_SEED = 20020611  # of the noise of that motion
_DRIVE = 2.5  # largest effort of the recorded motion over the breakaway
_PERIOD = 160  # of that effort [samples]
_DISTANCE = 100.0  # of the recorded axis from its target at first, over the tolerance
_WRONG = 1.15  # mass and friction of the recorded axis over what the controller begins with
_VELOCITY_NOISE, _POSITION_NOISE = 1e-3, 1e-6  # over the largest speed and the travel
_LOST = {57: 0, 143: 1, 144: 1, 260: 2, 401: 0, 402: 1, 403: 2}  # sample: column without a value
_GLITCH = 333  # sample with a wrong position


@dataclass(frozen=True, kw_only=True)
class TestVectors:
    """Inputs and outputs sample by sample, and the results at the end."""

    __test__ = False  # not a test, whatever its name

    inputs: Float[np.ndarray, "n i"]
    outputs: Float[np.ndarray, "n o"]
    final: Float[np.ndarray, " r"]

    @property
    def hexadecimal(self) -> dict[str, Any]:
        """The numbers as C writes them, to the last bit."""
        tables = {"inputs": self.inputs, "outputs": self.outputs}
        written = {
            name: [[hexadecimal(value) for value in row] for row in table.tolist()]
            for name, table in tables.items()
        }
        return {**written, "final": [hexadecimal(value) for value in self.final.tolist()]}


def vectors_of(part: Part, content: CodeContent) -> TestVectors:
    """Return the test vectors of a module."""
    if part.module.name == "law":
        return _law(part, content)
    if part.module.name == "pulses":
        assert content.controller is not None  # noqa: S101 - its module is a part
        return _pulses(content.controller, content.law)
    estimator = content.energy if part.module.name == "energy" else content.kalman
    return _online(estimator, part, content)


def _law(part: Part, content: CodeContent) -> TestVectors:
    law = fields_at(friction.LAW)(part.vector)
    # No speed is exactly that of the dead band, where float may decide otherwise
    fastest = 9.7 * (content.law.stribeck_velocity or 1.0)
    grid = fastest * np.linspace(-1.0, 1.0, _LAW_POINTS) ** 3
    speeds = np.concatenate([grid, [0.0, 1e-12, -1e-12, math.nan]])
    accelerations = np.linspace(-5.0, 5.0, speeds.size)
    outputs = [
        (friction.friction_force(law, v), friction.feedforward(law, v, a))
        if math.isfinite(v)
        else (math.nan, math.nan)
        for v, a in zip(speeds.tolist(), accelerations.tolist(), strict=True)
    ]
    return TestVectors(
        inputs=np.column_stack([speeds, accelerations]),
        outputs=np.array(outputs),
        final=np.zeros(1),
    )


def _recorded_axis(law: CodeLaw, mass: float) -> SingleMass:
    """Return an axis with the Coulomb and viscous friction of a law."""
    return SingleMass(mass=mass, friction=replace(law, static=law.coulomb).affine)


def _scaled(axis: SingleMass, factor: float) -> SingleMass:
    law = axis.friction
    values = {name: factor * getattr(law, name) for name in law.__dataclass_fields__}
    values["offset"] = law.offset
    return SingleMass(mass=factor * axis.mass, friction=CoulombViscousFriction(**values))


def _pulses(controller: ExactPulseController, law: CodeLaw) -> TestVectors:
    """Position an axis that is heavier and has more friction than the controller begins with."""
    mass = controller.mass or 1.0
    axis = _scaled(_recorded_axis(law, mass), _WRONG)
    T = controller.sampling_time
    start = controller.target - _DISTANCE * controller.tolerance
    model, moving = kernel_model(axis, T), initial_kernel_state(axis, (start, 0.0))
    state, effort = controller.init(), 0.0
    inputs: list[tuple[float, float, float]] = []
    outputs: list[tuple[float, float]] = []
    for k in range(_SAMPLES):
        x, v = moving[0], moving[1]
        lost = k in _LOST and _LOST[k] != 0
        sample = SensorSample(k * T, math.nan if lost else x, v, math.nan, math.nan)
        state, chosen = controller.step(state, sample)
        effort = 0.0 if math.isnan(chosen) else chosen
        inputs.append(sample[:3])
        outputs.append((chosen, float(head(state).outcome)))
        moving, _ = mass_step(model, moving, effort)
    estimates = controller.estimates(state)
    order = ("mass", *(
        f"{name}_friction_{side}"
        for name in ("coulomb", "viscous", "static")
        for side in ("positive", "negative")
    ))  # fmt: skip
    final = [*(estimates[name] for name in order), float(controller.pulse_count(state))]
    return TestVectors(inputs=np.array(inputs), outputs=np.array(outputs), final=np.array(final))


def recorded_motion(
    content: CodeContent, inertia: float, samples: int = _SAMPLES
) -> Float[np.ndarray, "n 3"]:
    """Return effort, position and velocity of an axis in motion, with noise and lost values."""
    axis = _recorded_axis(content.law, inertia)
    T = content.sampling_time
    law = axis.friction
    most = _DRIVE * max(*law.breakaway(), 1e-9) + abs(law.offset)
    rng = np.random.default_rng(_SEED)
    phase = 2.0 * np.pi * np.arange(samples) / _PERIOD
    effort = most * (np.sin(phase) + 0.3 * np.sin(2.7 * phase + 1.0)) + law.offset
    model, moving = kernel_model(axis, T), initial_kernel_state(axis, None)
    rows = np.empty((samples, 3))
    for k in range(samples):
        rows[k] = effort[k], moving[0], moving[1]
        moving, _ = mass_step(model, moving, float(effort[k]))
    travel, speed = np.ptp(rows[:, 1]), np.max(np.abs(rows[:, 2]))
    rows[:, 1] += _POSITION_NOISE * travel * rng.standard_normal(samples)
    rows[:, 2] += _VELOCITY_NOISE * speed * rng.standard_normal(samples)
    for k, column in _LOST.items():
        if k < samples:
            rows[k, column] = math.nan
    if samples > _GLITCH:
        rows[_GLITCH, 1] += 10.0 * travel
    return rows


def _online(estimator: Any, part: Part, content: CodeContent) -> TestVectors:
    rows = recorded_motion(content, estimator.inertia)
    state = estimator.init(
        sampling_time=content.sampling_time, velocity_measured=content.velocity_measured
    )
    names = estimator.parameter_names(content.kind)
    deviation = (
        deviations.energy_deviation if part.module.name == "energy" else deviations.kalman_deviation
    )
    velocity = content.velocity_measured
    outputs = np.empty((len(rows), len(names)))
    for k, (u, x, v) in enumerate(rows.tolist()):
        state, outputs[k] = estimator.step(state, (u, x, v if velocity else 0.0, 0.0, 0.0))
    health = estimator.health(state)
    final = [deviation(state, i) for i in range(len(names))]
    final += [health.samples, health.missing_samples, health.position_glitches]
    final += [health.force_events, health.resets]
    return TestVectors(inputs=rows, outputs=outputs, final=np.array(final, dtype=np.float64))
