"""The energy-based estimator as published by van de Wijdeven (2002), part A chapters 3 to 6."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.published import kernels
from stickslip.estimation.energy.published.kernels import (
    published_energy_rows,
    published_energy_run,
    published_energy_step,
)
from stickslip.estimation.energy.published.sensor_noise import SensorNoise, sensor_noise_of
from stickslip.estimation.energy.samples import check_fits, filtered_samples
from stickslip.estimation.fit.fitted import LeastSquaresEstimator
from stickslip.estimation.fit.rows import Regression, least_squares, summarise_motion
from stickslip.estimation.fit.solve import check_excited
from stickslip.estimation.online.faults.admission import restart_admission, set_admission
from stickslip.estimation.online.faults.guard import set_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.method import Kernel, OnlineMethod, State
from stickslip.estimation.online.recursion import VALUES, covariance_in, set_prior
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import (
    check_arm,
    check_forgetting_factor,
    check_given,
    first_guesses,
)
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import (
    AxisKind,
    AxisLog,
    InputError,
    non_negative,
    one_of,
    positive,
    share_text,
)

_FRICTION = ("coulomb_friction", "viscous_friction")
_ERROR_TERMS = ("level_bias", "slope")
_SUMS = ("printed", "settled")
_COMPENSATIONS = ("none", "printed", "settled")

_NOTEWORTHY_NOISE = 0.001
"""Share of noise in a regressor [-] above which a note states it and the status is `biased`."""


@dataclass(frozen=True, kw_only=True)
class PublishedEnergyEstimator(OnlineMethod, LeastSquaresEstimator):
    """Coulomb and viscous friction from the energy balance, as published.

    Input energy less stored energy is regressed on the distance travelled and the integral of the
    squared velocity, level by level (Eqs. 4.3, 4.4), by recursive least squares (Eqs. 4.6-4.10).
    What sensor noise adds can be subtracted in expectation (chapter 5), and errors of that can be
    estimated beside the friction (Eqs. 6.1, 6.2). A run is taken to begin at rest with the spring
    relaxed, and the masses and the spring to be known. `fit` returns the values at the end of the
    recursion; its notes state B and S.

    Attributes
    ----------
    inertia
        Of the (first) mass [kg or kg m^2].
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis.
    sums
        ``"printed"``: by backward Euler (Eqs. 3.6, 4.3), biased when the effort is held over each
        sample; ``"settled"``: exact work under a held effort, the travel from positions and its
        sign from two velocities, squared velocities to second order, reversals inside a sample.
    compensation
        Of sensor noise. ``"none"``; ``"printed"``: by the polynomials (Eqs. 5.21-5.27), for printed
        sums only; ``"settled"``: the same expectations exactly.
    position_noise, velocity_noise
        Assumed standard deviations of the noise on both masses [m or rad, m/s or rad/s]; None
        estimates them, for each mass, from the log that `fit` or `run` gets.
    error_terms
        Whether the errors of a compensation are estimated too: B of the level [J] and S of the
        slope in time [N or N m] (Eqs. 6.1, 6.2), ``level_bias`` and ``slope``.
    forgetting_factor
        In (0, 1] [-]; 1 forgets nothing.
    initial_values
        First guesses by parameter name [SI]; 0 for those not named.
    initial_variance
        Diagonal of P(0) [squared unit of the parameters over J^2].
    cutoff
        Of the low-pass before positions are differentiated, in a log without velocities [Hz]; None
        takes a tenth of the sampling rate and at most 100 Hz.
    effort_delay
        Samples by which the effort acts after it is logged [-], also a fraction; negative if it
        acts before it is logged. At most 30.

    Raises
    ------
    InputError
        If a setting is out of range, only one of load inertia and stiffness is given, the printed
        compensation is requested with settled sums, or error terms without compensation.

    Examples
    --------
    >>> arm = PublishedEnergyEstimator(
    ...     inertia=1.0, load_inertia=1.0, stiffness=1.0, error_terms=True, compensation="printed",
    ...     position_noise=0.005, velocity_noise=0.05)
    >>> arm.parameter_names("rotary")
    ('coulomb_friction', 'viscous_friction', 'level_bias', 'slope')
    >>> state = arm.init(sampling_time=0.01)
    >>> state, estimates = arm.step(state, (1.0, 0.0, 0.01, 0.0, 0.0))
    >>> estimates.shape
    (4,)
    """

    inertia: float
    load_inertia: float | None = None
    stiffness: float | None = None
    sums: Literal["printed", "settled"] = "printed"
    compensation: Literal["none", "printed", "settled"] = "none"
    position_noise: float | None = None
    velocity_noise: float | None = None
    error_terms: bool = False
    forgetting_factor: float = 1.0
    initial_values: Mapping[str, float] | None = None
    initial_variance: float = 1e3
    cutoff: float | None = None
    effort_delay: float = 0.0
    name: ClassVar[str] = "published-energy"

    def __post_init__(self) -> None:
        units = {
            "inertia": "kg or kg m^2",
            "load_inertia": "kg or kg m^2",
            "stiffness": "N/m or N m/rad",
            "initial_variance": "(unit of the parameter)^2/J^2",
            "cutoff": "Hz",
        }
        check_given(self, positive, units)
        noises = {"position_noise": "m or rad", "velocity_noise": "m/s or rad/s"}
        check_given(self, non_negative, noises)
        check_arm(self.load_inertia, self.stiffness)
        check_forgetting_factor(self.forgetting_factor)
        self._check_choices()
        guesses = first_guesses(self.initial_values, self._names)
        object.__setattr__(self, "initial_values", guesses)

    def _check_choices(self) -> None:
        for name, known in (("sums", _SUMS), ("compensation", _COMPENSATIONS)):
            one_of(name, getattr(self, name), known)
        if (self.position_noise is None) != (self.velocity_noise is None):
            raise InputError("half_the_noise")
        if self.sums == "settled" and self.compensation == "printed":
            raise InputError("printed_compensation_of_settled_sums")
        if self.error_terms and self.compensation == "none":
            raise InputError("error_terms_uncompensated")

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:  # noqa: ARG002
        """Return the names of the online estimates in their order, Coulomb friction first.

        They are the same for linear and rotary axes. `values_at` has the same order (that of
        `EnergyEstimator` differs in the two).
        """
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return (*_FRICTION, *(_ERROR_TERMS if self.error_terms else ()))

    @property
    def values_at(self) -> slice:
        """Places of Coulomb and viscous friction in a state."""
        return slice(VALUES, VALUES + len(_FRICTION))

    @property
    def _places(self) -> slice:
        return slice(VALUES, VALUES + len(self._names))

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`).

        It needs velocities: 0 in their place is taken for an axis at rest. It takes no sample while
        the noise is needed and not known.
        """
        return published_energy_step

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far; no force noise is estimated."""
        own = kernels.fields(state)
        return health_of(own.admission, resets=int(own.guard.resets))

    def init(self, *, sampling_time: float) -> State:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling_time
            [s].
        """
        s = np.zeros(kernels.STATE_SIZE)
        own = kernels.fields(s)
        own.recursion.sampling_time = positive("sampling_time", sampling_time, "s")
        own.recursion.forgetting = self.forgetting_factor
        own.recursion.load_inertia = self.load_inertia or 0.0
        own.recursion.stiffness = self.stiffness or 0.0
        guesses = self.initial_values or {}
        first = [guesses.get(name, 0.0) for name in self._names]
        set_prior(own.recursion, first, self.initial_variance)
        own.inertia = self.inertia
        own.settled_sums = self.sums == "settled"
        own.compensation = _COMPENSATIONS.index(self.compensation)
        arm = self.stiffness is not None
        set_admission(
            own.admission,
            sampling_time=sampling_time,
            effort_delay=self.effort_delay,
            inertia=self.inertia,
            measured=(True, arm, arm),
        )
        if self.compensation != "none" or self.sums == "settled":
            self._write_noise(s, self._assumed_noise)
        set_guard(s, own.guard)
        return s

    def resume(self, state: State) -> State:
        """Return the state before another run: estimates and P as they are, all sums at zero."""
        after = state.copy()
        own = kernels.fields(after)
        own["sums"] = np.zeros((), kernels.SUMS)
        restart_admission(own.admission)
        set_guard(after, own.guard)
        return after

    def step(
        self, state: State, sample: tuple[float, float, float, float, float]
    ) -> tuple[State, Float[np.ndarray, " p"]]:
        """Take one sample; return the new state and the estimates (see `OnlineMethod.step`).

        It needs velocities; only `run` and `fit` derive those that a log has not.

        Raises
        ------
        InputError
            If the sample does not hold five numbers, or the noise is needed and not known.
        """
        if state[kernels.NOISE] < 0.0:
            raise InputError("noise_unknown")
        return super().step(state, sample)

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates after each.

        The state is from `init`, `resume` or an earlier step. Where the noise is needed and not
        known yet, it is estimated from the log.

        Raises
        ------
        InputError
            If the log has a gap or another sampling time than the state, or lacks the load of a
            flexible arm.
        """
        return self._run(state, log)[:2]

    def prediction_errors(self, state: State, log: AxisLog) -> Float[np.ndarray, " n"]:
        """Return the prediction error before each sample of a log without gaps [J] (Eq. 4.9).

        Raises
        ------
        InputError
            As `run` does.
        """
        return self._run(state, log)[2]

    def _run(
        self, state: State, log: AxisLog
    ) -> tuple[State, Float[np.ndarray, "n p"], Float[np.ndarray, " n"]]:
        """Return the new state, the estimates and the prediction errors."""
        after = state.copy()
        own = kernels.fields(after)
        check_fits(log, float(own.recursion.sampling_time))
        if own.noise < 0.0:
            self._write_noise(after, sensor_noise_of(log, cutoff=self.cutoff))
        return after, *published_energy_run(after, self._samples(log))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P (Eq. 4.7), whose scale is that of a level noise of 1 J."""
        return covariance_in(state)

    def regression(self, log: AxisLog) -> Regression:
        """Return rows whose least-squares solution is what the recursion ends at.

        B and S are projected out.

        Raises
        ------
        InputError
            As `fit` does.
        """
        check_excited(log)
        log = repaired(log)
        parts = list(log.segments())
        samples = [self._samples(part, effort_delay=self.effort_delay) for part in parts]
        state = self.init(sampling_time=log.sampling_time)
        noise = self._assumed_noise or sensor_noise_of(log, cutoff=self.cutoff)
        if kernels.fields(state).noise < 0.0:
            self._write_noise(state, noise)
        target, columns = weighted_rows(state, samples)
        priors = columns.shape[1]
        shares = noise_shares(state, samples, noise.velocity)
        notes = (*self._known_biases(noise.velocity, shares), *log.notes)
        if self.error_terms:
            target, columns, (level_bias, slope) = _without_error_terms(target, columns)
            errors = f"B {level_bias:.4g} J, S {slope:.4g} {log.unit('effort')}"
            notes = (*notes, f"errors of the compensation: {errors}")
        time = np.concatenate([part.time for part in parts])
        return Regression(
            kind=log.kind,
            names=_FRICTION,
            time=np.concatenate([np.full(priors, time[0]), time]),
            target=target,
            regressors=columns,
            regressor_noise=np.zeros(len(_FRICTION)),
            quantity="energy",
            motion=summarise_motion(
                [part.measured_position for part in parts],
                [part[:, 2] for part in samples],
                log.sampling_time,
                (noise.position, noise.velocity),
            ),
            samples=time.size,
            notes=notes,
            biased=log.clipped or self.sums == "printed" or shares[0] >= _NOTEWORTHY_NOISE,
        )

    @property
    def _assumed_noise(self) -> SensorNoise | None:
        if self.position_noise is None or self.velocity_noise is None:
            return None
        return SensorNoise(
            position=self.position_noise,
            velocity=self.velocity_noise,
            load_position=self.position_noise,
            load_velocity=self.velocity_noise,
        )

    def _write_noise(self, state: State, noise: SensorNoise | None) -> None:
        """Write the noise into a state, in place, or that it is needed and not known."""
        own = kernels.fields(state)
        if noise is None:
            own.noise = -1.0
            return
        own.noise = noise.velocity
        own.level_bias = noise.level_bias(
            self.inertia, self.load_inertia or 0.0, self.stiffness or 0.0
        )

    def _samples(self, part: AxisLog, *, effort_delay: float = 0.0) -> Float[np.ndarray, "n 5"]:
        low_pass = LowPass.of(part.sampling_time, self.cutoff)
        load = self.stiffness is not None
        return filtered_samples(part, low_pass, load=load, effort_delay=effort_delay)

    def _known_biases(self, velocity_noise: float, shares: tuple[float, float]) -> tuple[str, ...]:
        """Return the known biases of the rows, one sentence each, from `noise_shares`."""
        first = (
            "sums by backward Euler as printed: biased when the effort is held over each sample"
            if self.sums == "printed"
            else "sums that are exact while the effort is held over each sample"
        )
        if shares[0] < _NOTEWORTHY_NOISE:
            return (first,)
        source = "estimated from the log" if self.velocity_noise is None else "assumed"
        size = (
            f"velocity noise ({source}) of "
            f"{velocity_noise:.3g} in SI makes about {share_text(shares[0])} of the sum of "
            f"absolute velocities and {share_text(shares[1])} of the sum of squares"
        )
        if self.compensation == "none":
            return first, f"{size}; nothing is compensated, and no interval allows for that bias"
        return first, (
            f"{size}; its expectation is compensated, which is biased itself, and the regressors "
            "stay noisy: no interval allows for either"
        )


def weighted_rows(
    state: State, samples: Sequence[Float[np.ndarray, "_ 5"]]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m p"]]:
    """Return targets and rows whose least-squares solution is what the recursion ends at.

    The state is that before the first sample; each stretch of samples begins with energies of zero.
    Row k of n weighs lambda^((n - k) / 2), and P(0) and the first guesses enter as one more row a
    parameter, the first ones, of weight lambda^(n / 2).
    """
    stretches = [published_energy_rows(state.copy(), part) for part in samples]
    target = np.concatenate([part[0] for part in stretches])
    columns = np.concatenate([part[1] for part in stretches])
    recursion = kernels.fields(state).recursion
    n, p = target.size, int(recursion.parameters)
    root = np.sqrt(recursion.forgetting)
    weight = root ** np.arange(n - 1, -1, -1)
    prior = root**n / np.sqrt(recursion.first_spread[:p])
    return (
        np.concatenate([prior * recursion.values[:p], weight * target]),
        np.concatenate([np.diag(prior), weight[:, None] * columns]),
    )


def _without_error_terms(
    target: Float[np.ndarray, " m"], columns: Float[np.ndarray, "m 4"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m 2"], tuple[float, float]]:
    """Return `weighted_rows` with B and S projected out, and the values of both (Eq. 6.2).

    Least squares on what remains gives the same friction as on all four columns.
    """
    level_bias, slope = least_squares(columns, target)[2:].tolist()
    basis, _ = np.linalg.qr(columns[:, 2:])
    friction = columns[:, :2]
    return (
        target - basis @ (basis.T @ target),
        friction - basis @ (basis.T @ friction),
        (level_bias, slope),
    )


def noise_shares(
    state: State, samples: Sequence[Float[np.ndarray, "_ 5"]], velocity_noise: float
) -> tuple[float, float]:
    """Return which part of the sums of abs(v) and of v^2 is noise, in expectation [-].

    The state is that before the first sample, the noise a standard deviation [m/s or rad/s].
    """

    def sums(compensation: int) -> Float[np.ndarray, " 2"]:
        s = state.copy()
        own = kernels.fields(s)
        own.settled_sums, own.compensation, own.noise = 0, compensation, velocity_noise
        ends = [published_energy_rows(s.copy(), part)[1][-1, :2] for part in samples]
        return np.sum(ends, axis=0)

    noisy, clean = sums(0), sums(2)
    shares = np.divide(noisy - clean, noisy, out=np.zeros(2), where=noisy > 0)
    return float(shares[0]), float(shares[1])
