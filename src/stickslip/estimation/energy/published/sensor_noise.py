"""Noise of a log's sensors, and what it takes from the dissipated energy.

A measured velocity is the true one plus white noise of standard deviation sigma (van de Wijdeven
2002, Eqs. 5.1-5.4).
"""

from dataclasses import dataclass

from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.observation import motion_noise
from stickslip.estimation.signals.sensor_noise import longest_in_motion
from stickslip.records import AxisLog, non_negative, positive


@dataclass(frozen=True, kw_only=True)
class SensorNoise:
    """Standard deviations of the white noise of an axis' sensors.

    Raises
    ------
    InputError
        If one is negative.
    """

    position: float  #: [m or rad].
    velocity: float  #: [m/s or rad/s].
    load_position: float  #: [m or rad].
    load_velocity: float  #: [m/s or rad/s].

    def __post_init__(self) -> None:
        for name, unit in (("position", "m or rad"), ("velocity", "m/s or rad/s")):
            for end, own in ((name, name), (f"load {name}", f"load_{name}")):
                non_negative(f"noise of the {end}", getattr(self, own), unit)

    def level_bias(self, inertia: float, load_inertia: float, stiffness: float) -> float:
        """Return what the noise takes from the measured dissipation in expectation [J] (Eq. 5.26).

        The stored energies come out too large by the bracket of Eq. 5.26, and the dissipation too
        small by it: it is to be added.

        Parameters
        ----------
        inertia, load_inertia
            [kg or kg m^2]; 0 for the load of a rigid axis.
        stiffness
            [N/m or N m/rad]; 0 for a rigid axis.
        """
        kinetic = inertia * self.velocity**2 + load_inertia * self.load_velocity**2  # Eq. 5.6
        potential = stiffness * (self.position**2 + self.load_position**2)  # Eq. 5.7
        return 0.5 * (kinetic + potential)


def sensor_noise_of(log: AxisLog, *, cutoff: float | None = None) -> SensorNoise:
    """Estimate the noise of a log's sensors from what is too fast to be motion.

    From sixth differences of every channel, bounded by how much positions and velocities disagree
    (`stickslip.estimation.signals.observation.motion_noise`). Rests need no special care, as no
    motion is in them. The longest stretch without gaps is used. Mere rounding is no noise.

    Parameters
    ----------
    log
        With measured velocities; otherwise their noise is that of smoothed, differentiated
        positions.
    cutoff
        Of the low-pass that smooths them [Hz]; None takes a tenth of the sampling rate and at most
        100 Hz.

    Raises
    ------
    InputError
        If the cutoff is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(0).normal(size=(2, 5000))
    >>> time = 0.01 * np.arange(5000)
    >>> log = AxisLog(name="stage", kind="linear", time=time, effort=np.ones(5000),
    ...               measured_position=np.sin(time) + 0.005 * noise[0],
    ...               measured_velocity=np.cos(time) + 0.05 * noise[1])
    >>> found = sensor_noise_of(log)
    >>> round(found.position, 4), round(found.velocity, 3)
    (0.005, 0.05)
    """
    part, T = longest_in_motion(log.segments()), log.sampling_time
    low_pass = LowPass.of(T, None if cutoff is None else positive("cutoff", cutoff, "Hz"))
    own = motion_noise(part.measured_position, part.measured_velocity, low_pass, T)
    load = None
    if part.measured_load_position is not None:
        load = motion_noise(part.measured_load_position, part.measured_load_velocity, low_pass, T)
    return SensorNoise(
        position=own.position,
        velocity=own.used_velocity,
        load_position=0.0 if load is None else load.position,
        load_velocity=0.0 if load is None else load.used_velocity,
    )
