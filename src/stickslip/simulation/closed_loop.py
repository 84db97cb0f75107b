"""A plant, its sensors and a controller in a sampled loop."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numba.extending import is_jitted
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.errors import check_controller
from stickslip.plants import Plant
from stickslip.records import AxisLog, InputError, SensorSample, unit_of, whole
from stickslip.simulation.plant_kernels import (
    EVENT_BUDGET,
    initial_kernel_state,
    kernel_model,
    kernels_of,
)
from stickslip.simulation.sensors import Noise, Sensors, measure_one
from stickslip.simulation.simulate import SimulatedMotion, simulate

ControllerState = TypeVar("ControllerState")
Vector = NDArray[np.float64]


class Controller(Protocol[ControllerState]):
    """Anything that steps in time: a sensor sample in, an effort out.

    One that was made for a sampling time states it as an attribute ``sampling_time`` [s], which is
    compared with that of the loop.
    """

    @property
    def step(
        self,
    ) -> Callable[[ControllerState, SensorSample], tuple[ControllerState, float]]:
        """The pure step ``step(state, sample) -> (state, effort)``."""
        ...

    def init(self) -> ControllerState:
        """Return the state before the first sample; its types must not change from step to step."""
        ...


@dataclass(frozen=True, kw_only=True)
class ClosedLoopRun(Generic[ControllerState]):
    """A finished run of a sampled loop."""

    motion: SimulatedMotion  #: The truth.
    log: AxisLog  #: Samples of the sensors, beside the efforts that the controller commanded.
    controller_state: ControllerState  #: The controller's state after the last sample.


_OK, _FAILED, _EFFORT = 0, 1, 2


def _loop(
    plant_step: Any,
    plant: Any,
    controller_step: Any,
    controller_state: Any,
    sensors: Any,
    effort: Vector,
    samples: Vector,
) -> Any:
    """Run the loop; the same function is compiled or interpreted, as the controller is.

    ``plant`` is its model, state and output; ``sensors`` are settings, delay and noise. ``effort``
    (n,) and ``samples`` (4, n+1), without the delay, are written. Returns the controller's state, a
    status, and the sample it arose at.
    """
    model, state, output = plant
    settings, delay, noise = sensors
    n = effort.size
    T = settings[4]
    for k in range(n + 1):
        last = max(k - 1, 0)
        samples[0, k], samples[1, k] = measure_one(
            settings, samples[0, last], output[0], output[1], noise[0][k], noise[1][k]
        )
        samples[2, k], samples[3, k] = measure_one(
            settings, samples[2, last], output[2], output[3], noise[2][k], noise[3][k]
        )
        if k == 0 and settings[3] > 0.0:
            samples[1, 0] = 0.0
            samples[3, 0] = 0.0 * samples[2, 0]  # NaN where there is no sensor
        if k == n:
            break
        j = max(k - delay, 0)
        sample = SensorSample(k * T, samples[0, j], samples[1, j], samples[2, j], samples[3, j])
        controller_state, u = controller_step(controller_state, sample)
        if not np.isfinite(u):
            return controller_state, _EFFORT, k
        effort[k] = u
        state, output = plant_step(model, state, u)
        if np.isnan(state[-1]):
            return controller_state, _FAILED, k
    return controller_state, _OK, n


_compiled_loop = compiled(cached=False)(_loop)


def simulate_closed_loop(
    plant: Plant,
    controller: Controller[ControllerState],
    *,
    sampling_time: float,
    samples: int,
    sensors: Sensors | None = None,
    generator: np.random.Generator | None = None,
    initial_state: tuple[float, ...] | None = None,
    name: str = "simulated axis",
    event_budget: int = EVENT_BUDGET,
) -> ClosedLoopRun[ControllerState]:
    """Run a controller on a plant, sample by sample.

    At each sample instant the sensors are read, the controller computes an effort, and the plant
    moves under it to the next instant. When ``controller.step`` is a compiled kernel the whole
    loop is compiled; otherwise it runs in Python, with the same result to the last bit.

    Parameters
    ----------
    plant
        `SingleMass` or `FlexibleArm`.
    controller
        Anything with ``init() -> state`` and a pure ``step(state, sample) -> (state, effort)``,
        where ``sample`` is a `SensorSample`. If it has a ``sampling_time`` [s], that must be the
        loop's.
    sampling_time, samples
        Of the loop [s], and how many to run.
    sensors, generator
        Ideal sensors if None; the source of their noise, may be None when there is none.
    initial_state
        ``(position, velocity)`` [m or rad, m/s or rad/s], of the arm ``(position, velocity,
        load_position, load_velocity)``; at rest at 0 if None.
    name, event_budget
        Name of the log; events allowed in one sample.

    Returns
    -------
    The truth and, apart from it, the log.

    Raises
    ------
    InputError
        If an argument is out of its range, the controller was made for another sampling time, or
        it commands an effort that is not finite.
    EventBudgetError
        If a sample holds more events than allowed.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> class Proportional:
    ...     def init(self):
    ...         return 0.0
    ...     def step(self, state, sample):
    ...         return state, 500.0 * (0.1 - sample.measured_position)
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=20.0)
    >>> run = simulate_closed_loop(SingleMass(mass=1.0, friction=law), Proportional(),
    ...                            sampling_time=0.001, samples=1000)
    >>> abs(0.1 - float(run.motion.position[-1])) <= 1.0 / 500.0
    True
    """
    whole("samples", samples, least=1)
    sensors = Sensors() if sensors is None else sensors
    model = kernel_model(plant, sampling_time, event_budget)
    state = initial_kernel_state(plant, initial_state)
    noise = sensors.draw(samples + 1, generator)
    rigid = not plant.flexible
    at_start = (state[0], state[1], *((np.nan, np.nan) if rigid else (state[4], state[3])))
    if not sensors.load:
        nothing = np.full(samples + 1, np.nan)
        noise = Noise(noise.position, noise.velocity, nothing, nothing)
    effort = np.empty(samples)
    seen = np.empty((4, samples + 1))
    check_controller(controller, sampling_time)
    step = controller.step
    loop: Any = _compiled_loop if is_jitted(step) else _loop
    controller_state, status, at = loop(
        kernels_of(plant).loop_step,
        (model, state, at_start),
        step,
        controller.init(),
        (sensors.settings(float(sampling_time)), sensors.delay, tuple(noise)),
        effort,
        seen,
    )
    if status == _EFFORT:
        raise InputError(
            "controller_effort_not_finite",
            time=at * sampling_time,
            sample=at,
            unit=unit_of("effort", plant.kind),
        )
    # The same efforts once more, for the events: to the last bit the motion of the loop, and the
    # error too, when its last sample could not be propagated
    motion = simulate(
        plant,
        effort[: at + 1],
        sampling_time=sampling_time,
        initial_state=initial_state,
        event_budget=event_budget,
    )
    delayed = seen[:, np.maximum(np.arange(samples + 1) - sensors.delay, 0)]
    load = None if rigid else (delayed[2], delayed[3])
    log = sensors.log(motion, name=name, samples=(delayed[0], delayed[1]), load=load)
    return ClosedLoopRun(motion=motion, log=log, controller_state=controller_state)
