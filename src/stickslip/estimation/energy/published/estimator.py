"""The energy-based estimator as published by van de Wijdeven (2002), part A chapters 3 to 6."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.published import recursion as at
from stickslip.estimation.energy.published.recursion import (
    published_energy_run,
    published_energy_step,
)
from stickslip.estimation.energy.published.rows import (
    NOTEWORTHY_NOISE,
    filtered_samples,
    known_biases,
    noise_shares,
    weighted_rows,
    without_error_terms,
)
from stickslip.estimation.energy.published.sensor_noise import SensorNoise, sensor_noise_of
from stickslip.estimation.energy.samples import check_fits
from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.online.faults.admission import lay_admission, restart_admission
from stickslip.estimation.online.faults.guard import RESETS, lay_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.method import Kernel, OnlineMethod, State
from stickslip.estimation.online.recursion import (
    FIRST_SPREAD,
    FORGETTING,
    PARAMETERS,
    SPREAD,
    VALUES,
    covariance_in,
)
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import (
    check_arm,
    check_forgetting_factor,
    check_given,
    first_guesses,
    options_of,
)
from stickslip.estimation.signals.kinematics import LowPass, default_cutoff
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    InputError,
    non_negative,
    positive,
)

__all__ = ["PublishedEnergyEstimator"]

_FRICTION = ("coulomb_friction", "viscous_friction")
_ERROR_TERMS = ("level_bias", "slope")
_FRICTION_AT = slice(VALUES, VALUES + len(_FRICTION))
_COMPENSATIONS = ("none", "printed", "settled")
_FILTER_ORDER = 4  # of one pass of the low-pass before positions are differentiated


@dataclass(frozen=True, kw_only=True)
class PublishedEnergyEstimator(OnlineMethod):
    """Coulomb and viscous friction from the energy balance, as published.

    Input energy less stored energy is regressed on the way travelled and the integral of the
    squared velocity, level by level (Eqs. 4.3, 4.4), by recursive least squares (Eqs. 4.6-4.10).
    What sensor noise adds can be subtracted in expectation (chapter 5), and errors of that can be
    estimated beside the friction (Eqs. 6.1, 6.2). A run is taken to begin at rest with the spring
    relaxed, and the masses and the spring to be known.

    Attributes
    ----------
    inertia
        Of the (first) mass [kg or kg m^2].
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis.
    sums
        ``"printed"``: by backward Euler (Eqs. 3.6, 4.3), biased when the effort is held over each
        sample; ``"settled"``: exact work under a held effort, the way from positions and its sign
        from two velocities, squared velocities to second order, reversals inside a sample.
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
        Samples by which the effort acts after it is logged [-], also a fraction; negative if the
        effort is logged late. At most 30.

    Raises
    ------
    InputError
        If a setting is out of range, only one of load inertia and stiffness is given, the printed
        compensation is asked for with settled sums, or error terms without compensation.

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

    def __post_init__(self) -> None:
        check_given(
            self,
            positive,
            {
                "inertia": "kg or kg m^2",
                "load_inertia": "kg or kg m^2",
                "stiffness": "N/m or N m/rad",
                "initial_variance": "(unit of the parameter)^2/J^2",
                "cutoff": "Hz",
            },
        )
        check_given(
            self, non_negative, {"position_noise": "m or rad", "velocity_noise": "m/s or rad/s"}
        )
        check_arm(self.load_inertia, self.stiffness)
        check_forgetting_factor(self.forgetting_factor)
        self._check_choices()
        guesses = first_guesses(self.initial_values, self._names)
        object.__setattr__(self, "initial_values", guesses)

    def _check_choices(self) -> None:
        for name, known in (("sums", ("printed", "settled")), ("compensation", _COMPENSATIONS)):
            if getattr(self, name) not in known:
                raise InputError(
                    f"{name} is {getattr(self, name)!r}, there is no such one",
                    remedy=f"use one of {', '.join(map(repr, known))}",
                )
        if (self.position_noise is None) != (self.velocity_noise is None):
            raise InputError(
                "the noise of positions or of velocities is given alone",
                remedy="give both standard deviations, or neither to have them estimated",
            )
        if self.sums == "settled" and self.compensation == "printed":
            raise InputError(
                "the printed compensation is asked for with settled sums, but its polynomial "
                "corrects sums of abs(v)",
                remedy="use compensation='settled', or sums='printed'",
            )
        if self.error_terms and self.compensation == "none":
            raise InputError(
                "error terms are asked for without compensation: B and S are the errors of one",
                remedy="use compensation='printed' or 'settled'",
            )

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "published-energy"

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of the online estimates in their order, Coulomb friction first.

        `values_at` has the same order (that of `EnergyEstimator` differs in the two).

        Parameters
        ----------
        kind
            ``"linear"`` or ``"rotary"``; the names are the same for both.
        """
        del kind
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return (*_FRICTION, *(_ERROR_TERMS if self.error_terms else ()))

    @property
    def values_at(self) -> slice:
        """Places of Coulomb and viscous friction in a state."""
        return _FRICTION_AT

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`).

        It needs velocities: 0 in their place is taken for an axis at rest. It takes no sample while
        the noise is needed and not known.
        """
        return published_energy_step

    @property
    def _places(self) -> slice:
        return slice(VALUES, VALUES + len(self._names))

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far; no force noise is estimated.

        Parameters
        ----------
        state
            From `init` or a later step.
        """
        return health_of(at.admission(state), resets=state[at.GUARD + RESETS])

    def init(self, *, sampling_time: float) -> State:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling_time
            [s].
        """
        p = len(self._names)
        s = np.zeros(at.STATE_SIZE)
        s[PARAMETERS] = p
        s[FORGETTING] = self.forgetting_factor
        s[FIRST_SPREAD : FIRST_SPREAD + p] = self.initial_variance
        s[SPREAD : SPREAD + p * p] = (self.initial_variance * np.eye(p)).ravel()
        guesses = self.initial_values or {}
        s[VALUES : VALUES + p] = [guesses.get(name, 0.0) for name in self._names]
        s[at.SAMPLING_TIME] = positive("sampling time", sampling_time, "s")
        s[at.INERTIA], s[at.LOAD_INERTIA] = self.inertia, self.load_inertia or 0.0
        s[at.STIFFNESS] = self.stiffness or 0.0
        s[at.SETTLED_SUMS] = self.sums == "settled"
        s[at.COMPENSATION] = _COMPENSATIONS.index(self.compensation)
        arm = self.stiffness is not None
        lay_admission(
            at.admission(s),
            sampling_time=sampling_time,
            effort_delay=self.effort_delay,
            inertia=self.inertia,
            measured=(True, arm, arm),
        )
        self._lay_noise(s)
        lay_guard(s, at.GUARD, at.ADMISSION)
        return s

    def _lay_noise(self, s: State) -> None:
        """Lay the noise into a first state, in place, or that it is needed and not known."""
        if self.compensation == "none" and self.sums == "printed":
            return
        noise = self._assumed_noise()
        if noise is None:
            s[at.NOISE] = -1.0
        else:
            self._let_know(s, noise)

    def resume(self, state: State) -> State:
        """Return the state before another run: estimates and P as they are, all sums at zero.

        Parameters
        ----------
        state
            From an earlier run; it is left as it is.
        """
        after = state.copy()
        after[at.SUMS : at.SUMS_END] = 0.0
        restart_admission(at.admission(after))
        lay_guard(after, at.GUARD, at.ADMISSION)
        return after

    def step(
        self, state: State, sample: tuple[float, float, float, float, float]
    ) -> tuple[State, Float[np.ndarray, " p"]]:
        """Take one sample; return the new state and the estimates.

        Parameters
        ----------
        state
            From `init` or an earlier step; it is left as it is.
        sample
            Effort, position, velocity, load position and load velocity [SI], with 0 for the load of
            a rigid axis and NaN for a missing value. It needs velocities; only `run` and `fit`
            derive those that a log has not.

        Returns
        -------
        The state, and the estimates in the order of `parameter_names`.

        Raises
        ------
        InputError
            If the sample does not hold five numbers, or the noise is needed and not known.
        """
        if state[at.NOISE] < 0.0:
            raise InputError(
                "the noise of the sensors is needed and not known",
                remedy="give position_noise and velocity_noise, or run a log first",
            )
        return super().step(state, sample)

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps.

        Parameters
        ----------
        state
            From `init`, `resume` or an earlier step; it is left as it is.
        log
            The samples; where the noise is needed and not known yet, it is estimated from them.

        Returns
        -------
        The new state, and the estimates after each sample [SI].

        Raises
        ------
        InputError
            If the log has a gap or another sampling time than the state, or lacks the load of a
            flexible arm.
        """
        after, estimates, _ = self._run(state, log)
        return after, estimates

    def prediction_errors(self, state: State, log: AxisLog) -> Float[np.ndarray, " n"]:
        """Return the prediction error before each sample of a log without gaps [J] (Eq. 4.9).

        Parameters
        ----------
        state, log
            As of `run`.

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
        check_fits(log, float(state[at.SAMPLING_TIME]))
        after = state.copy()
        if after[at.NOISE] < 0.0:
            self._let_know(after, sensor_noise_of(log, cutoff=self.cutoff))
        return after, *published_energy_run(after, self._samples(log))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P (Eq. 4.7), whose scale is that of a level noise of 1 J."""
        return covariance_in(state)

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        The values are those at the end of the recursion. The notes state B and S.

        Raises
        ------
        InputError
            If the log lacks the load of a flexible arm, or nothing moves or pushes in it.
        """
        return self.details(log).estimate

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report.

        Raises
        ------
        InputError
            As `fit` does.
        """
        rows = self.regression(log)
        provenance = provenance_of(log, options_of(self))
        return Fit(
            estimate=solve(rows, estimator=self.name, provenance=provenance),
            rows=rows,
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
            cutoff=self.cutoff,
        )

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
        noise = self._assumed_noise() or sensor_noise_of(log, cutoff=self.cutoff)
        if state[at.NOISE] < 0.0:
            self._let_know(state, noise)
        target, columns = weighted_rows(state, samples)
        priors = columns.shape[1]
        shares = noise_shares(state, samples, noise.velocity)
        notes = (
            *known_biases(
                noise.velocity,
                shares,
                assumed=self.velocity_noise is not None,
                printed=self.sums == "printed",
                compensated=self.compensation != "none",
            ),
            *log.notes,
        )
        if self.error_terms:
            target, columns, (level_bias, slope) = without_error_terms(target, columns)
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
            biased=log.clipped or self.sums == "printed" or shares[0] >= NOTEWORTHY_NOISE,
        )

    def _assumed_noise(self) -> SensorNoise | None:
        if self.position_noise is None or self.velocity_noise is None:
            return None
        return SensorNoise(
            position=self.position_noise,
            velocity=self.velocity_noise,
            load_position=self.position_noise,
            load_velocity=self.velocity_noise,
        )

    def _let_know(self, state: State, noise: SensorNoise) -> None:
        """Write the noise into a state, in place."""
        state[at.NOISE] = noise.velocity
        state[at.LEVEL_BIAS] = noise.level_bias(
            self.inertia, self.load_inertia or 0.0, self.stiffness or 0.0
        )

    def _samples(self, part: AxisLog, *, effort_delay: float = 0.0) -> Float[np.ndarray, "n 5"]:
        cutoff = default_cutoff(part.sampling_time) if self.cutoff is None else self.cutoff
        low_pass = LowPass(order=_FILTER_ORDER, cutoff=cutoff)
        load = self.stiffness is not None
        return filtered_samples(part, low_pass, load=load, effort_delay=effort_delay)
