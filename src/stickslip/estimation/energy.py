"""The energy-based estimator of Coulomb and viscous friction (report part A chapters 3 and 4)."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy_levels import AxisModel, EnergyLevels, energy_levels
from stickslip.estimation.energy_online import first_state, take_log, take_sample
from stickslip.estimation.kinematics import LowPass, default_cutoff
from stickslip.estimation.level_weighting import (
    block_means,
    likeliest_ratio,
    quiet_block_size,
    velocity_noise_of_block,
    whitened,
)
from stickslip.estimation.observation import MotionNoise, motion_noise
from stickslip.estimation.printed_balance import printed_regression
from stickslip.estimation.recursion import VALUES, covariance_in
from stickslip.estimation.regression import Regression, summarise_motion
from stickslip.estimation.resampling import resampled
from stickslip.estimation.sensor_noise import chosen_cutoff
from stickslip.estimation.solution import check_excited, provenance_of, solve
from stickslip.estimation.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    InputError,
    non_negative,
    positive,
)

__all__ = ["EnergyEstimator"]

_LEAST_ROWS = 50
_EDGE_PERIODS = 2.0  # of the cutoff, at both ends
_VARIANTS = ("held_effort", "report")
_REPORT_VARIANCE = 1e3  # P(0) with which the report's figures are reproduced
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
        at most 100 Hz, and `fit` less where velocities from noisy positions need it.
    filter_order
        Of one pass of that low-pass.
    variant
        ``"held_effort"``: exact while the effort is held over each sample; ``"report"``: the sums
        and the recursion as printed, to reproduce the report.
    forgetting_factor
        Of the recursion, in (0, 1] [-]; 1 forgets nothing. `fit` uses it in the report's variant
        only.
    initial_values
        First guesses of the recursion by parameter name [SI]; 0 for those not named.
    initial_variance
        Diagonal of P(0) of the recursion [squared unit of the parameters over the level noise];
        None takes 1e3 in the report's variant, else one that follows the size of the regressors and
        weighs nothing against them, whatever the units.
    level_noise, force_noise
        For the recursion only: standard deviation of the energy level [J] and of a disturbing force
        [N or N m]; their ratio decides between levels and differences. Without a disturbing force
        the level noise need not be given: 1 J is taken, on which no estimate depends unless there
        is an initial variance too.
    position_noise, velocity_noise
        For the recursion only: standard deviation of the sensors' noise [m or rad, m/s or rad/s];
        None estimates it on the way.

    Raises
    ------
    InputError
        If a setting is out of range, offset and per_direction are both asked for, only one of load
        inertia and stiffness is given, or a first guess for what is not estimated.

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
    variant: Literal["held_effort", "report"] = "held_effort"
    forgetting_factor: float = 1.0
    initial_values: Mapping[str, float] | None = None
    initial_variance: float | None = None
    level_noise: float | None = None
    force_noise: float = 0.0
    position_noise: float | None = None
    velocity_noise: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (
            ("inertia", "kg or kg m^2"),
            ("load_inertia", "kg or kg m^2"),
            ("stiffness", "N/m or N m/rad"),
            ("cutoff", "Hz"),
            ("initial_variance", "(unit of the parameter)^2/J^2"),
            ("level_noise", "J"),
        ):
            value = getattr(self, name)
            if value is not None:
                positive(name.replace("_", " "), value, unit)
        if (self.load_inertia is None) != (self.stiffness is None):
            raise InputError(
                "a flexible arm needs both the load inertia and the stiffness of its spring",
                remedy="give both, or neither for a rigid axis",
            )
        if not (self.filter_order >= 1 and float(self.filter_order).is_integer()):
            raise InputError(
                f"filter_order is {self.filter_order}, it must be a whole number, 1 or more",
                remedy="leave it at its default",
            )
        for name, unit in (
            ("force_noise", "N or N m"),
            ("position_noise", "m or rad"),
            ("velocity_noise", "m/s or rad/s"),
        ):
            if getattr(self, name) is not None:
                non_negative(name.replace("_", " "), getattr(self, name), unit)
        if not 0 < self.forgetting_factor <= 1:
            raise InputError(
                f"the forgetting factor is {self.forgetting_factor:g}, it must be in (0, 1]",
                remedy="give 1 to forget nothing, or a value just below",
            )
        if self.force_noise > 0 and self.level_noise is None:
            raise InputError(
                f"force_noise is {self.force_noise:g} N or N m and no level_noise is given",
                remedy="give level_noise [J] as well: their ratio decides",
            )
        if self.variant not in _VARIANTS:
            raise InputError(
                f"variant is {self.variant!r}, there is no such one",
                remedy=f"use one of {', '.join(map(repr, _VARIANTS))}",
            )
        known = (*(() if self.inertia is not None else ("mass", "inertia")), *self.terms.names)
        guesses = dict(self.initial_values or {})
        for name, value in guesses.items():
            if name not in known:
                raise InputError(
                    f"a first guess is given for {name!r}, which is not estimated",
                    remedy=f"use {', '.join(known)}",
                )
            if not np.isfinite(value):
                raise InputError(
                    f"the first guess of {name!r} is {value}, it must be finite",
                    remedy="leave it out to begin at 0",
                )
        object.__setattr__(self, "initial_values", MappingProxyType(guesses))

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "energy"

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(per_direction=self.per_direction, offset=self.offset)

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
        options = {"estimator": self.name, **self._options()}
        return solve(regression, estimator=self.name, provenance=provenance_of(log, options))

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the energy balance.

        Raises
        ------
        InputError
            As `fit` does.
        """
        check_excited(log)
        settled, log, changes = self._settled(log)
        return settled._regression(log, changes)

    def _settled(self, log: AxisLog) -> tuple["EnergyEstimator", AxisLog, tuple[str, ...]]:
        """Return the estimator with its cutoff chosen, the log as it is used, and notes on both."""
        log, changes = resampled(log)
        if self.variant == "report":
            return self, log, changes
        arm = self.load_inertia is not None
        low_pass = self._low_pass(log.sampling_time)
        log, wrong = without_wrong_velocity(log, low_pass, load=arm)
        if self.cutoff is not None:
            return self, log, (*changes, *wrong)
        cutoff, lowered = chosen_cutoff(log, low_pass, _LEAST_ROWS, load=arm)
        return replace(self, cutoff=cutoff), log, (*changes, *wrong, *lowered)

    def _regression(self, log: AxisLog, changes: tuple[str, ...]) -> Regression:
        T = log.sampling_time
        size, least = self._block_size(T), self._least_samples(T)
        parts = [part for part in log.segments() if len(part) >= least]
        if not parts:
            raise InputError(
                f"the log has no stretch of {least} samples without a gap ({len(log)} samples in "
                f"all, one every {T:.4g} s)",
                where=log.name,
                remedy="record a longer log, or raise the cutoff frequency",
            )
        if self.variant == "report":
            return printed_regression(
                parts,
                self.model,
                self.parameter_names(log.kind),
                self._low_pass(T),
                forgetting_factor=self.forgetting_factor,
                initial_values=self._first_guesses(log.kind),
                initial_variance=self.initial_variance or _REPORT_VARIANCE,
            )
        noise = self._noise(parts, T)
        levels = [energy_levels(part, self.model, self._low_pass(T), noise, T) for part in parts]
        # A filter knows nothing beyond the ends, so velocities made by one are wrong there
        derived = log.measured_velocity is None or (
            self.load_inertia is not None and log.measured_load_velocity is None
        )
        edge = round(_EDGE_PERIODS / (self._low_pass(T).cutoff * T)) if derived else 0
        shortest = size
        if self.inertia is None:
            size = quiet_block_size(levels, shortest, noise, T)
        blocks = [block_means(level, size, edge) for level in levels]
        ratio = likeliest_ratio(blocks)
        white, variances, times = whitened(blocks, ratio)
        scale = float(np.sqrt(np.mean(variances)))
        names = self.parameter_names(log.kind)
        regressors = white[:, 1:] * scale
        speeds = [level.motion.smooth_velocity for level in levels]
        column_noise = np.zeros(len(names))
        if self.inertia is None:
            # Noise of the kinetic energy of a unit inertia, in the difference of two blocks
            squares = np.concatenate([b.speed_squared for b in blocks])
            block_noise = velocity_noise_of_block(noise, size, shortest, T)
            column_noise[0] = scale * block_noise * float(np.sqrt(np.mean(squares / variances)))
        return Regression(
            kind=log.kind,
            names=names,
            time=times,
            target=white[:, 0] * scale,
            regressors=regressors,
            regressor_noise=column_noise,
            quantity="energy",
            motion=summarise_motion(
                [part.measured_position for part in parts],
                speeds,
                T,
                (noise.position, noise.smooth_velocity),
            ),
            samples=len(log),
            notes=(
                f"energies averaged over {size} samples; noise of the energy level is taken as "
                f"{ratio:.2g} of what a disturbing force adds in a typical row (maximum "
                "likelihood)",
                *changes,
            ),
        )

    def levels(self, log: AxisLog) -> list[tuple[EnergyLevels, AxisLog]]:
        """Return the energies of every stretch without gaps, beside that stretch of the log."""
        settled, log, _ = self._settled(log)
        T = log.sampling_time
        parts = [part for part in log.segments() if len(part) >= settled._least_samples(T)]
        noise = settled._noise(parts, T)
        low_pass = settled._low_pass(T)
        return [(energy_levels(part, self.model, low_pass, noise, T), part) for part in parts]

    def _low_pass(self, sampling_time: float) -> LowPass:
        cutoff = default_cutoff(sampling_time) if self.cutoff is None else self.cutoff
        return LowPass(order=self.filter_order, cutoff=cutoff)

    def _block_size(self, sampling_time: float) -> int:
        cutoff = self._low_pass(sampling_time).cutoff
        return max(round(1.0 / (_ROWS_PER_PERIOD * cutoff * sampling_time)), 1)

    def _least_samples(self, sampling_time: float) -> int:
        return _LEAST_ROWS * self._block_size(sampling_time)

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the online estimates."""
        mass = "mass" if kind == "linear" else "inertia"
        return (*(() if self.inertia is not None else (mass,)), *self.terms.names)

    def init(
        self, *, sampling_time: float, velocity_measured: bool = True
    ) -> Float[np.ndarray, " s"]:
        """Return the state of the recursion before the first sample.

        Parameters
        ----------
        sampling_time
            [s].
        velocity_measured
            Whether the samples hold velocities; if not, effort and positions go through the same
            causal low-pass, and the positions are differentiated.
        """
        T = positive("sampling time", sampling_time, "s")
        return first_state(
            model=self.model,
            sampling_time=T,
            velocity_measured=velocity_measured,
            printed=self.variant == "report",
            cutoff=self._low_pass(T).cutoff,
            forgetting_factor=self.forgetting_factor,
            initial_values=self._first_guesses("linear"),
            initial_variance=self._first_variance(),
            level_noise=self.level_noise,
            force_noise=self.force_noise,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    def step(
        self, state: Float[np.ndarray, " s"], sample: tuple[float, float, float, float, float]
    ) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, " p"]]:
        """Take one sample; return the new state and the estimates.

        Parameters
        ----------
        state
            From `init` or an earlier step; it is left as it is.
        sample
            Effort, position, velocity, load position and load velocity [SI], with 0 for what the
            axis does not have or measure.

        Returns
        -------
        The state, and the estimates in the order of `parameter_names`.

        Raises
        ------
        InputError
            If the sample does not hold five finite numbers.
        """
        after = state.copy()
        take_sample(after, sample)
        return after, after[VALUES:]

    def run(
        self, state: Float[np.ndarray, " s"], log: AxisLog
    ) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates after each.

        Parameters
        ----------
        state
            From `init` or an earlier step.
        log
            The samples.

        Raises
        ------
        InputError
            If the log has a gap or another sampling time than the state, or lacks a signal that the
            state was made for.
        """
        return take_log(state, log)

    def covariance(self, state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
        """Return P of the recursion; infinite for a parameter that nothing has told about yet."""
        return covariance_in(state)

    def _first_variance(self) -> float | None:
        if self.initial_variance is None and self.variant == "report":
            return _REPORT_VARIANCE
        return self.initial_variance

    def _first_guesses(self, kind: AxisKind) -> list[float]:
        guesses = self.initial_values or {}
        mass = guesses.get("mass", guesses.get("inertia", 0.0))
        return [
            mass if name in {"mass", "inertia"} else guesses.get(name, 0.0)
            for name in self.parameter_names(kind)
        ]

    def _options(self) -> dict[str, Any]:
        options = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**options, "initial_values": dict(self.initial_values or {})}

    def _noise(self, parts: list[AxisLog], sampling_time: float) -> MotionNoise:
        longest = max(parts, key=len)
        return motion_noise(
            longest.measured_position,
            longest.measured_velocity,
            self._low_pass(sampling_time),
            sampling_time,
        )
