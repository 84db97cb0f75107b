"""Sensors: the samples of a motion that a controller or a log has."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.records import AxisLog, InputError, non_negative, one_of, quantity_field, whole
from stickslip.simulation.simulate import SimulatedMotion

Vector = NDArray[np.float64]
Settings = tuple[float, float, float, float, float]
"""(sigma_w, sigma_v, encoder step, 1 for velocity from differences else 0, T)."""


@compiled()
def measure_one(
    settings: Settings, last: float, x: float, v: float, noise_x: float, noise_v: float
) -> tuple[float, float]:
    """Return the position and velocity sample of one instant.

    From the position sample before, the true position and velocity, and standard normal numbers.
    """
    sigma_w, sigma_v, step, differences, T = settings
    position = x + sigma_w * noise_x
    if step > 0.0:
        position = step * np.floor(position / step + 0.5)
    velocity = (position - last) / T if differences > 0.0 else v + sigma_v * noise_v
    return position, velocity


@compiled()
def measure_all(
    settings: Settings, delay: int, x: Vector, v: Vector, noise_x: Vector, noise_v: Vector
) -> tuple[Vector, Vector]:
    """Return the samples of a whole run, shape (n+1,) each, with a delay in samples.

    At time 0 a velocity from differences is 0: the axis is taken to have been there before.
    """
    n = x.size
    position, velocity = np.empty(n), np.empty(n)
    for k in range(n):
        last = position[k - 1] if k > 0 else 0.0
        position[k], velocity[k] = measure_one(settings, last, x[k], v[k], noise_x[k], noise_v[k])
        if k == 0 and settings[3] > 0.0:
            velocity[k] = 0.0
    if delay > 0:
        for k in range(n - 1, -1, -1):
            seen = max(k - delay, 0)
            position[k], velocity[k] = position[seen], velocity[seen]
    return position, velocity


class Noise(NamedTuple):
    """Standard normal numbers for each sample of every channel, drawn before a run."""

    position: Float[np.ndarray, " samples"]
    velocity: Float[np.ndarray, " samples"]
    load_position: Float[np.ndarray, " samples"]
    load_velocity: Float[np.ndarray, " samples"]


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """The sensors of an axis: noise, encoder steps, velocity and delay.

    A position sample is the true position plus Gaussian noise, rounded to the encoder's step. The
    velocity is either measured (with noise of its own) or the difference of the last two position
    samples over the sampling time. Every channel has a delay of whole samples; until its first
    sample is there it shows that of time 0.

    Raises
    ------
    InputError
        If a value is negative or not finite, or velocity noise is given where no velocity is
        measured.

    Examples
    --------
    >>> sensors = Sensors(position_noise=0.005, velocity_noise=0.05)
    >>> sensors.encoder_step, sensors.delay
    (0.0, 0)
    """

    #: Standard deviation of white Gaussian noise on every position [m or rad].
    position_noise: float = quantity_field("position", default=0.0)
    #: Standard deviation of white Gaussian noise on every measured velocity [m/s or rad/s].
    velocity_noise: float = quantity_field("velocity", default=0.0)
    #: Step of the position encoders [m or rad]; 0 for none.
    encoder_step: float = quantity_field("position", default=0.0)
    #: ``"measured"``, or ``"differences"`` of position samples, or ``"none"``.
    velocity: Literal["measured", "differences", "none"] = "measured"
    delay: int = 0  #: Delay of every channel in whole samples.
    load: bool = True  #: Whether the second mass of a flexible arm has sensors too.

    def __post_init__(self) -> None:
        for name in ("position_noise", "velocity_noise", "encoder_step"):
            quantity = self.__dataclass_fields__[name].metadata["quantity"]
            unit = f"{quantity.linear} or {quantity.rotary}"  # whichever the axis has
            object.__setattr__(self, name, non_negative(name, getattr(self, name), unit))
        one_of("velocity", self.velocity, ("measured", "differences", "none"))
        whole("delay", self.delay, unit="samples")
        if self.velocity_noise > 0 and self.velocity != "measured":
            raise InputError(
                "noise_without_velocity",
                name="velocity_noise",
                value=self.velocity_noise,
                unit="m/s or rad/s",
                velocity=self.velocity,
            )

    def draw(self, samples: int, generator: np.random.Generator | None) -> Noise:
        """Draw the noise of a run of n+1 samples, channel by channel.

        The generator may be None when there is no noise.
        """
        if generator is None:
            if self.position_noise > 0 or self.velocity_noise > 0:
                raise InputError("no_generator")
            return Noise(*(np.zeros(samples) for _ in Noise._fields))
        return Noise(*(generator.standard_normal(samples) for _ in Noise._fields))

    def settings(self, sampling_time: float) -> Settings:
        """Return the numbers that the sensor kernel works with."""
        return (
            self.position_noise,
            self.velocity_noise,
            self.encoder_step,
            float(self.velocity == "differences"),
            sampling_time,
        )

    def measure(
        self,
        motion: SimulatedMotion,
        generator: np.random.Generator | None = None,
        *,
        name: str = "simulated axis",
    ) -> AxisLog:
        """Return what these sensors record of a motion.

        The generator may be None when there is no noise. The log has n+1 samples; its last effort
        is the one held last, which the motion does not continue.

        Examples
        --------
        >>> from stickslip.friction import CoulombViscousFriction
        >>> from stickslip.plants import SingleMass
        >>> from stickslip.simulation import simulate
        >>> law = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.0)
        >>> motion = simulate(SingleMass(mass=1.0, friction=law), [3.0, 3.0], sampling_time=0.1)
        >>> Sensors(encoder_step=0.025).measure(motion).measured_position.round(3).tolist()
        [0.0, 0.0, 0.05]
        """
        noise = self.draw(motion.time.size, generator)
        settings = self.settings(motion.sampling_time)
        own = measure_all(
            settings, self.delay, motion.position, motion.velocity, noise.position, noise.velocity
        )
        load = None
        if self.load and motion.load_position is not None and motion.load_velocity is not None:
            load = measure_all(
                settings,
                self.delay,
                motion.load_position,
                motion.load_velocity,
                noise.load_position,
                noise.load_velocity,
            )
        return self.log(motion, name=name, samples=own, load=load)

    def log(
        self,
        motion: SimulatedMotion,
        *,
        name: str,
        samples: tuple[Vector, Vector],
        load: tuple[Vector, Vector] | None,
    ) -> AxisLog:
        """Return the log that holds these samples of a motion."""
        effort = motion.commanded_effort
        seen = self.velocity != "none"
        x2, v2 = load if self.load and load is not None else (None, None)
        return AxisLog(
            name=name,
            kind=motion.kind,
            time=motion.time,
            effort=np.concatenate((effort, effort[-1:])),
            measured_position=samples[0],
            measured_velocity=samples[1] if seen else None,
            measured_load_position=x2,
            measured_load_velocity=v2 if seen else None,
        )
