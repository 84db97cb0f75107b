"""The energy-based estimator of Coulomb and viscous friction (report part A chapters 3 and 4)."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import minimize_scalar

from stickslip.estimation.energy_balance import whiten_levels
from stickslip.estimation.kinematics import LowPass, central_difference, default_cutoff
from stickslip.estimation.observation import (
    MotionNoise,
    ObservedMotion,
    fuse,
    motion_noise,
    observe,
    slow_speed,
)
from stickslip.estimation.regression import Regression, summarise_motion
from stickslip.estimation.solution import check_excited, provenance_of, solve
from stickslip.friction.regressors import FrictionTerms
from stickslip.records import AxisLog, FrictionEstimate, InputError, positive

__all__ = ["EnergyEstimator"]

_LEAST_ROWS = 10
_ROWS_PER_PERIOD = 2.0  # of the cutoff: the rate that a signal filtered there can be sampled at
_RATIO_RANGE = (-6.0, 8.0)  # decades of level noise over force disturbance, in variance
_RATIO_GRID = 15


@dataclass(frozen=True, kw_only=True)
class EnergyLevels:
    """Energies of one stretch, one value a sample, and what explains them.

    Attributes
    ----------
    time
        [s], shape (n,).
    input, kinetic, potential
        Energies [J], shape (n,). Kinetic holds what is known of it: an inertia that is sought
        counts as a regressor.
    regressors
        Integrated from the start of the stretch, shape (n, p) [J per unit of each parameter].
    noise
        Variance that the sensors' noise gives each level of the balance, shape (n,) [J^2].
    walk
        Variance that it adds up to from sample to sample, shape (n-1,) [J^2].
    motion
        What they were made from.
    """

    time: Float[np.ndarray, " n"]
    input: Float[np.ndarray, " n"]
    kinetic: Float[np.ndarray, " n"]
    potential: Float[np.ndarray, " n"]
    regressors: Float[np.ndarray, "n p"]
    noise: Float[np.ndarray, " n"]
    walk: Float[np.ndarray, " n-1"]
    motion: ObservedMotion

    @property
    def dissipated(self) -> Float[np.ndarray, " n"]:
        """Measured dissipation, input less kinetic less potential energy [J] (Eq. 4.4)."""
        return self.input - self.kinetic - self.potential


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

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If the log is too short, lacks the load of a flexible arm, or nothing moves or pushes
            in it.
        """
        options = {"estimator": self.name, **asdict(self)}
        return solve(
            self.regression(log), estimator=self.name, provenance=provenance_of(log, options)
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the energy balance.

        Raises
        ------
        InputError
            As `fit` does.
        """
        check_excited(log)
        T = log.sampling_time
        low_pass = self._low_pass(T)
        size = max(round(1.0 / (_ROWS_PER_PERIOD * low_pass.cutoff * T)), 1)
        least = _LEAST_ROWS * size
        parts = [part for part in log.segments() if len(part) >= least]
        if not parts:
            raise InputError(
                f"the log has no stretch of {least} samples without a gap ({len(log)} samples in "
                "all)",
                where=log.name,
                remedy="record a longer log, or raise the cutoff frequency",
            )
        noise = self._noise(parts, low_pass, T)
        levels = [self._levels(part, low_pass, noise, T) for part in parts]
        blocks = [_block_means(level, size) for level in levels]
        ratio = _likeliest_ratio(blocks)
        white, variances, times = _whitened(blocks, ratio)
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

    def levels(self, log: AxisLog) -> list[EnergyLevels]:
        """Return the energies of every stretch without gaps, one value a sample."""
        T = log.sampling_time
        low_pass = self._low_pass(T)
        parts = [part for part in log.segments() if len(part) >= _LEAST_ROWS]
        noise = self._noise(parts, low_pass, T)
        return [self._levels(part, low_pass, noise, T) for part in parts]

    def _low_pass(self, sampling_time: float) -> LowPass:
        cutoff = default_cutoff(sampling_time) if self.cutoff is None else self.cutoff
        return LowPass(order=self.filter_order, cutoff=cutoff)

    def _names(self, log: AxisLog) -> tuple[str, ...]:
        mass = "mass" if log.kind == "linear" else "inertia"
        return (*(() if self.inertia is not None else (mass,)), *self.terms.names)

    def _noise(
        self, parts: Sequence[AxisLog], low_pass: LowPass, sampling_time: float
    ) -> MotionNoise:
        longest = max(parts, key=len)
        return motion_noise(
            longest.measured_position, longest.measured_velocity, low_pass, sampling_time
        )

    def _levels(
        self, part: AxisLog, low_pass: LowPass, noise: MotionNoise, sampling_time: float
    ) -> EnergyLevels:
        """Return the energies of one stretch (settled forms of Eqs. 3.6-4.4)."""
        T = sampling_time
        motion = observe(part, low_pass, noise, T)
        x, v = motion.position, motion.velocity
        work = _summed((part.effort[:-1] * np.diff(x))[:, None])[:, 0]
        friction = self.terms.energy_columns(
            motion.velocity_squared, motion.path, np.diff(x), motion.direction
        )
        regressors = _summed(friction)
        kinetic, potential = np.zeros(len(part)), np.zeros(len(part))
        load: tuple[float, Float[np.ndarray, " n"], MotionNoise] | None = None
        spring = np.zeros(len(part))
        if self.load_inertia is not None and self.stiffness is not None:
            x2, v2, load_noise = self._load(part, low_pass, T)
            kinetic = kinetic + 0.5 * self.load_inertia * v2**2
            potential = 0.5 * self.stiffness * (x - x2) ** 2
            spring = self.stiffness * (x - x2)
            smooth_v2 = v2 if load_noise.velocity == 0 else low_pass.apply(v2, T)
            load = (self.load_inertia, smooth_v2, load_noise)
        if self.inertia is None:
            unit = 0.5 * motion.smooth_velocity**2
            regressors = np.column_stack([unit - unit[0], regressors])
        else:
            kinetic = kinetic + 0.5 * self.inertia * v**2
        white, walk = self._sensor_noise(
            part, motion, regressors, work - kinetic - potential, spring, noise, load, low_pass
        )
        return EnergyLevels(
            time=part.time,
            input=work,
            kinetic=kinetic,
            potential=potential,
            regressors=regressors,
            noise=white,
            walk=walk,
            motion=motion,
        )

    def _sensor_noise(
        self,
        part: AxisLog,
        motion: ObservedMotion,
        regressors: Float[np.ndarray, "n p"],
        dissipated: Float[np.ndarray, " n"],
        spring: Float[np.ndarray, " n"],
        noise: MotionNoise,
        load: tuple[float, Float[np.ndarray, " n"], MotionNoise] | None,
        low_pass: LowPass,
    ) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n-1"]]:
        """Return the variances that sensor noise gives the energy balance [J^2].

        White in the level: that of the kinetic energies, and position noise times the force that
        acts. Adding up from sample to sample: position noise times the change of that force
        (summation by parts of sum u dx), and velocity noise in the viscous regressor. The friction
        needed for this comes from a rough fit of the levels.
        """
        T = part.sampling_time
        columns = np.column_stack([regressors, np.ones(len(part))])
        rough, *_ = np.linalg.lstsq(columns, dissipated, rcond=None)
        names = self._names(part)

        def magnitude(term: str) -> float:
            found = [abs(float(a)) for name, a in zip(names, rough, strict=False) if term in name]
            return float(np.mean(found)) if found else 0.0

        inertia = magnitude(names[0]) if self.inertia is None else self.inertia
        offset = float(rough[names.index("offset")]) if "offset" in names else 0.0
        speed = motion.smooth_velocity
        shift = max(round(1.0 / (low_pass.cutoff * T)), 1)
        white = _kinetic_noise(inertia, speed, noise.used_velocity, shift)
        net = part.effort[:-1] - offset - magnitude("coulomb") * motion.direction
        force = np.concatenate([net, net[-1:]]) - spring
        white += (force * noise.smooth_position) ** 2
        if load is not None:
            load_inertia, load_speed, load_noise = load
            white += _kinetic_noise(load_inertia, load_speed, load_noise.used_velocity, shift)
            white += (spring * load_noise.smooth_position) ** 2
        walk = (np.diff(net, prepend=net[:1]) * noise.smooth_position) ** 2
        walk += (2.0 * magnitude("viscous") * T * speed[:-1] * noise.velocity) ** 2
        return white, walk

    def _load(
        self, part: AxisLog, low_pass: LowPass, sampling_time: float
    ) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], MotionNoise]:
        """Return position and velocity of the load, and their noise."""
        T = sampling_time
        if part.measured_load_position is None:
            raise InputError(
                "the log holds no position of the load, which a flexible arm needs",
                where=part.name,
                remedy="map the load's position, or leave out load inertia and stiffness",
            )
        noise = motion_noise(part.measured_load_position, part.measured_load_velocity, low_pass, T)
        if part.measured_load_velocity is None:
            x2 = low_pass.apply(part.measured_load_position, T)
            return x2, central_difference(x2, T), noise
        x2 = fuse(
            part.measured_load_position,
            part.measured_load_velocity,
            noise.position,
            noise.velocity,
            T,
        )
        return x2, part.measured_load_velocity, noise


@dataclass(frozen=True, kw_only=True)
class _Blocks:
    """Means of the levels over blocks of samples: measured energy, then its regressors."""

    time: Float[np.ndarray, " b"]
    values: Float[np.ndarray, "b c"]
    noise: Float[np.ndarray, " b"]
    walk: Float[np.ndarray, " b-1"]
    disturbance: Float[np.ndarray, " b-1"]
    resting: Bool[np.ndarray, " b-1"]


def _kinetic_noise(
    inertia: float, velocity: Float[np.ndarray, " n"], noise: float, shift: int
) -> Float[np.ndarray, " n"]:
    """Return the variance of a kinetic energy [J^2] from noise of its velocity.

    The velocity is taken some samples earlier and later: a weight that knew the error of its own
    sample would favour errors of one sign.
    """
    padded = np.pad(velocity**2, shift, mode="edge")
    square = 0.5 * (padded[: velocity.size] + padded[2 * shift :])
    return (inertia * noise) ** 2 * (square + 0.5 * noise**2)


def _summed(increments: Float[np.ndarray, "m p"]) -> Float[np.ndarray, "n p"]:
    """Return running sums that begin with zero."""
    return np.concatenate([np.zeros((1, increments.shape[1])), np.cumsum(increments, axis=0)])


def _block_means(levels: EnergyLevels, size: int) -> _Blocks:
    """Average over blocks: white noise shrinks, and the balance stays exact as it is linear."""
    count = levels.time.size // size
    used = count * size

    def mean(values: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "b c"]:
        return values[:used].reshape(count, size, -1).mean(axis=1)

    path = _summed(levels.motion.path[:, None])
    columns = np.column_stack([levels.dissipated, levels.regressors])
    rest = levels.motion.resting[:used].reshape(count, size).mean(axis=1)
    return _Blocks(
        time=mean(levels.time[:, None])[:, 0],
        values=mean(columns),
        noise=mean(levels.noise[:, None])[:, 0] / size,
        walk=np.diff(mean(_summed(levels.walk[:, None]))[:, 0]),
        disturbance=np.diff(mean(path)[:, 0]) ** 2,
        resting=rest[1:] + rest[:-1] >= 1.0,
    )


def _whitened(
    blocks: Sequence[_Blocks], ratio: float
) -> tuple[Float[np.ndarray, "n c"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return whitened rows, their variances and times.

    A disturbing force of unit variance adds the squared way to the level's variance. At rest the
    friction force is unknown whatever the disturbance, so that a rest counts as a typical row.
    """
    typical = float(np.mean(np.concatenate([b.disturbance for b in blocks])))
    level = float(np.mean(np.concatenate([b.noise for b in blocks])))
    rows: list[Float[np.ndarray, "n c"]] = []
    variances: list[Float[np.ndarray, " n"]] = []
    for b in blocks:
        steps = np.where(b.resting, np.maximum(b.disturbance, typical), b.disturbance)
        noise = ratio * (b.noise / level if level > 0 else np.ones(b.noise.size))
        walk = ratio * (b.walk / level if level > 0 else np.zeros(b.walk.size))
        white, variance = whiten_levels(b.values, steps / typical + walk, noise)
        rows.append(white)
        variances.append(variance)
    return (
        np.concatenate(rows),
        np.concatenate(variances),
        np.concatenate([b.time[1:] for b in blocks]),
    )


def _likeliest_ratio(blocks: Sequence[_Blocks]) -> float:
    """Return the variance ratio of level noise to disturbance that makes the levels likeliest."""

    def cost(decades: float) -> float:
        white, variances, _ = _whitened(blocks, 10.0**decades)
        values, *_ = np.linalg.lstsq(white[:, 1:], white[:, 0], rcond=None)
        squares = float(np.sum((white[:, 0] - white[:, 1:] @ values) ** 2))
        floor = np.finfo(float).eps ** 2 * float(np.sum(white[:, 0] ** 2))
        n = white.shape[0]
        return n * float(np.log(max(squares, floor) / n)) + float(np.sum(np.log(variances)))

    grid = np.linspace(*_RATIO_RANGE, _RATIO_GRID)
    best = float(grid[int(np.argmin([cost(decades) for decades in grid]))])
    step = float(grid[1] - grid[0])
    found = minimize_scalar(cost, bounds=(best - step, best + step), method="bounded")
    return float(10.0**found.x)
