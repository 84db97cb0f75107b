"""The energy-based estimator of Coulomb and viscous friction (report part A chapters 3 and 4)."""

from dataclasses import asdict, dataclass

import numpy as np

from stickslip.estimation.energy_levels import AxisModel, EnergyLevels, energy_levels
from stickslip.estimation.kinematics import LowPass, default_cutoff
from stickslip.estimation.level_weighting import block_means, likeliest_ratio, whitened
from stickslip.estimation.observation import MotionNoise, motion_noise, slow_speed
from stickslip.estimation.regression import Regression, summarise_motion
from stickslip.estimation.solution import check_excited, provenance_of, solve
from stickslip.friction.regressors import FrictionTerms
from stickslip.records import AxisLog, FrictionEstimate, InputError, positive

__all__ = ["EnergyEstimator"]

_LEAST_ROWS = 10
_ROWS_PER_PERIOD = 2.0  # of the cutoff: the rate that a signal filtered there can be sampled at


@dataclass(frozen=True, kw_only=True)
class EnergyEstimator:
    """Friction from the balance of energies: what goes in and is not stored was dissipated.

    The measured energies are regressed on the way travelled (Coulomb friction), the integral of the
    squared velocity (viscous friction), the displacement (offset) and, if it is sought, the kinetic
    energy of a unit inertia.

    Sensor noise makes the level of the measured energy uncertain at every sample; a disturbing
    force adds up in it. How much there is of each is found by maximum likelihood, and the levels
    are weighted accordingly (generalised least squares).

    Attributes
    ----------
    inertia
        Moving mass or inertia if it is known [kg or kg m^2], of a flexible arm that of the driven
        side; None estimates it.
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis. The log must then
        hold the position of the load.
    per_direction
        Whether Coulomb and viscous friction are estimated for each direction apart.
    offset
        Whether a constant offset is estimated; None does unless ``per_direction``.
    cutoff
        Of the low-pass that smooths what is noisy [Hz]; None takes a tenth of the sampling rate and
        at most 100 Hz.
    filter_order
        Of one pass of that low-pass.

    Raises
    ------
    InputError
        If a setting is out of range, offset and per_direction are both asked for, or only one of
        load inertia and stiffness is given.

    Examples
    --------
    >>> EnergyEstimator(inertia=95.1, offset=False).terms.names
    ('viscous_friction', 'coulomb_friction')
    """

    inertia: float | None = None
    load_inertia: float | None = None
    stiffness: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    cutoff: float | None = None
    filter_order: int = 4

    def __post_init__(self) -> None:
        for name, unit in (
            ("inertia", "kg or kg m^2"),
            ("load_inertia", "kg or kg m^2"),
            ("stiffness", "N/m or N m/rad"),
            ("cutoff", "Hz"),
        ):
            value = getattr(self, name)
            if value is not None:
                positive(name.replace("_", " "), value, unit)
        if (self.load_inertia is None) != (self.stiffness is None):
            raise InputError(
                "a flexible arm needs both the load inertia and the stiffness of its spring",
                remedy="give both, or neither for a rigid axis",
            )
        if self.filter_order < 1:
            raise InputError(
                f"filter_order is {self.filter_order}, it must be at least 1",
                remedy="leave it at its default",
            )
        _ = self.terms

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "energy"

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        offset = not self.per_direction if self.offset is None else self.offset
        return FrictionTerms(per_direction=self.per_direction, offset=offset)

    @property
    def model(self) -> AxisModel:
        """What is known of the axis, and what is sought."""
        return AxisModel(
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
            terms=self.terms,
        )

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If the log is too short, lacks the load of a flexible arm, or nothing moves or pushes
            in it.
        """
        return self.solution(log, self.regression(log))

    def solution(self, log: AxisLog, regression: Regression) -> FrictionEstimate:
        """Return the estimate from rows that `regression` made of this log."""
        options = {"estimator": self.name, **asdict(self)}
        return solve(regression, estimator=self.name, provenance=provenance_of(log, options))

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the energy balance.

        Raises
        ------
        InputError
            As `fit` does.
        """
        check_excited(log)
        T = log.sampling_time
        size, least = self._block_size(T), self._least_samples(T)
        parts = [part for part in log.segments() if len(part) >= least]
        if not parts:
            raise InputError(
                f"the log has no stretch of {least} samples without a gap ({len(log)} samples in "
                "all)",
                where=log.name,
                remedy="record a longer log, or raise the cutoff frequency",
            )
        noise = self._noise(parts, T)
        levels = [energy_levels(part, self.model, self._low_pass(T), noise, T) for part in parts]
        blocks = [block_means(level, size) for level in levels]
        ratio = likeliest_ratio(blocks)
        white, variances, times = whitened(blocks, ratio)
        scale = float(np.sqrt(np.mean(variances)))
        names = self._names(log)
        regressors = white[:, 1:] * scale
        speeds = [level.motion.smooth_velocity for level in levels]
        slow = slow_speed(max(float(np.max(np.abs(v))) for v in speeds))
        column_noise = np.zeros(len(names))
        if self.inertia is None:
            # Noise of the kinetic energy of a unit inertia, beside how much that energy varies
            energy = np.concatenate([0.5 * v**2 for v in speeds])
            spread = float(np.std(energy))
            error = float(np.sqrt(np.mean(2.0 * energy))) * noise.smooth_velocity
            rms = float(np.sqrt(np.mean(regressors[:, 0] ** 2)))
            column_noise[0] = rms * error / spread if spread > 0 else np.inf
        return Regression(
            kind=log.kind,
            names=names,
            time=times,
            target=white[:, 0] * scale,
            regressors=regressors,
            nuisance=np.empty((times.size, 0)),
            regressor_noise=column_noise,
            quantity="energy",
            motion=summarise_motion(speeds, T, slow, noise.smooth_velocity, noise.position),
            samples=len(log),
            notes=(
                f"energies averaged over {size} samples; noise of the energy level is taken as "
                f"{ratio:.2g} of what a disturbing force adds in a typical row (maximum "
                "likelihood)",
            ),
        )

    def levels(self, log: AxisLog) -> list[tuple[EnergyLevels, AxisLog]]:
        """Return the energies of every stretch without gaps, beside that stretch of the log."""
        T = log.sampling_time
        parts = [part for part in log.segments() if len(part) >= self._least_samples(T)]
        noise = self._noise(parts, T)
        low_pass = self._low_pass(T)
        return [(energy_levels(part, self.model, low_pass, noise, T), part) for part in parts]

    def _low_pass(self, sampling_time: float) -> LowPass:
        cutoff = default_cutoff(sampling_time) if self.cutoff is None else self.cutoff
        return LowPass(order=self.filter_order, cutoff=cutoff)

    def _block_size(self, sampling_time: float) -> int:
        cutoff = self._low_pass(sampling_time).cutoff
        return max(round(1.0 / (_ROWS_PER_PERIOD * cutoff * sampling_time)), 1)

    def _least_samples(self, sampling_time: float) -> int:
        return _LEAST_ROWS * self._block_size(sampling_time)

    def _names(self, log: AxisLog) -> tuple[str, ...]:
        mass = "mass" if log.kind == "linear" else "inertia"
        return (*(() if self.inertia is not None else (mass,)), *self.terms.names)

    def _noise(self, parts: list[AxisLog], sampling_time: float) -> MotionNoise:
        longest = max(parts, key=len)
        return motion_noise(
            longest.measured_position,
            longest.measured_velocity,
            self._low_pass(sampling_time),
            sampling_time,
        )
