"""Effects of noise on the energies and regressors of a run, by its truth."""

from dataclasses import dataclass

import numpy as np

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.runs import Run


@dataclass(frozen=True, kw_only=True)
class NoiseEffects:
    """Measured less true values of one run with the printed sums."""

    input_energy: float  #: Of the sum of Eq. 3.6 at the end [J].
    held_input_energy: float  #: Of the sum that is exact while the input is held, at the end [J].
    #: Mean over the run of Eqs. 3.8 and 3.7 [J].
    kinetic_energy: float
    potential_energy: float
    #: The part of the potential energy's that is quadratic in the noise [J]. The other is linear
    #: and without a mean, and in a few runs it is as large.
    potential_square: float
    coulomb_regressor: float  #: Of the sum of abs(v) of Eq. 4.3 at the end [m].
    viscous_regressor: float  #: Of the sum of v^2 at the end [m^2/s].
    #: Mean of abs(v) while the first mass rests, and while it is faster than three standard
    #: deviations of the noise [m/s]; NaN if it never is.
    speed_at_rest: float
    speed_in_motion: float


def noise_effects(run: Run) -> NoiseEffects:
    """Compare a run's log with its truth.

    Raises
    ------
    ValueError
        If the run is not one of an arm.
    """
    T, log, motion = surrogate.SAMPLING_TIME, run.log, run.motion
    x, v, x2, v2 = motion.position, motion.velocity, motion.load_position, motion.load_velocity
    seen = log.measured_velocity
    seen_x2, seen_v2 = log.measured_load_position, log.measured_load_velocity
    if x2 is None or v2 is None or seen is None or seen_x2 is None or seen_v2 is None:
        raise ValueError("the run has no load, or no velocities")
    kinetic = 0.5 * surrogate.MASS_1 * (seen**2 - v**2)
    kinetic += 0.5 * surrogate.MASS_2 * (seen_v2**2 - v2**2)
    stretch, true_stretch = log.measured_position - seen_x2, x - x2
    speed = np.abs(seen) - np.abs(v)
    error = log.measured_position - x
    fast = np.abs(v) > 3.0 * surrogate.VELOCITY_NOISE
    return NoiseEffects(
        input_energy=float(T * np.sum(log.effort * (seen - v))),
        held_input_energy=float(np.sum(log.effort[:-1] * np.diff(error))),
        kinetic_energy=float(np.mean(kinetic)),
        potential_energy=float(np.mean(0.5 * surrogate.STIFFNESS * (stretch**2 - true_stretch**2))),
        potential_square=float(np.mean(0.5 * surrogate.STIFFNESS * (stretch - true_stretch) ** 2)),
        coulomb_regressor=float(T * np.sum(speed)),
        viscous_regressor=float(T * np.sum(seen**2 - v**2)),
        speed_at_rest=float(np.mean(speed[motion.stuck])) if motion.stuck.any() else np.nan,
        speed_in_motion=float(np.mean(speed[fast])) if fast.any() else np.nan,
    )
