"""The energy-based estimator of Coulomb and viscous friction (report part A chapters 3 and 4)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import sought_regression, work_regression
from stickslip.estimation.energy.known_inertia.layout import SEEN
from stickslip.estimation.energy.known_inertia.online import (
    first_work_state,
    work_covariance,
    work_health,
    work_intervals,
)
from stickslip.estimation.energy.known_inertia.recursion import work_run, work_step
from stickslip.estimation.energy.known_inertia.stretches import reconstructed
from stickslip.estimation.energy.level_regression import (
    block_size,
    level_regression,
    noise_of_longest,
)
from stickslip.estimation.energy.levels import AxisModel, EnergyLevels, energy_levels
from stickslip.estimation.energy.online import first_state, samples_of
from stickslip.estimation.energy.streaming import energy_run, energy_step
from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import (
    check_excited,
    long_stretches,
    provenance_of,
    solve,
)
from stickslip.estimation.online.health import OnlineHealth
from stickslip.estimation.online.recursion import VALUES, covariance_in
from stickslip.estimation.online_method import Kernel, OnlineMethod, State
from stickslip.estimation.settings import (
    check_arm,
    check_forgetting_factor,
    check_given,
    first_guesses,
    options_of,
)
from stickslip.estimation.signals.kinematics import LowPass, default_cutoff
from stickslip.estimation.signals.resampling import resampled
from stickslip.estimation.signals.sensor_noise import chosen_cutoff
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms, StribeckEffect
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


@dataclass(frozen=True, kw_only=True)
class EnergyEstimator(OnlineMethod):
    """Friction from the balance of energies: what goes in and is not stored was dissipated.

    With the inertia known (and the spring, of a flexible arm), the balance is taken as work along
    motions without noise: states are smoothed with friction as a free force, which tells where
    friction acts which way, and the balance is whitened by the Kalman filter of the known masses
    (see `stickslip.estimation.energy.known_inertia.balance`). Neither the noise nor how the effort
    depends on it has to be known.

    With the inertia sought, `fit` does the same with all force but friction as one more column. It
    begins with what the recursion does: the measured energies are regressed on the way travelled
    (Coulomb friction), the integral of the squared velocity (viscous friction), the displacement
    (offset) and the kinetic energy of a unit inertia. Sensor noise makes the level of the measured
    energy uncertain at every sample; a disturbing force adds up in it. Where the samples show what
    the model lacks, `fit` ends with that, too.

    Either way, how much disturbance there is beside the noise is found by maximum likelihood, and
    the rows are weighted accordingly (generalised least squares).

    Attributes
    ----------
    inertia
        Moving mass or inertia if it is known [kg or kg m^2], of a flexible arm that of the driven
        side; None estimates it.
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis. With the inertia
        known the log need not hold the load: its motion is then reconstructed from that of the
        driven mass, wherever it began. With the inertia sought it must hold its position.
    per_direction
        Whether Coulomb and viscous friction are estimated for each direction apart.
    offset
        Whether a constant offset is estimated; None does unless ``per_direction``.
    stribeck
        How the step from static to Coulomb friction fades with speed, to estimate static friction
        too; None does not. Several, of which each has a step of its own, are for
        `StribeckEstimator`, which finds the one that fits.
    cutoff
        Of the low-pass that smooths what is noisy [Hz]; None takes a tenth of the sampling rate and
        at most 100 Hz, and `fit` less where velocities from noisy positions need it.
    filter_order
        Of one pass of that low-pass.
    forgetting_factor
        Of the recursion and of one sample, in (0, 1] [-]; 1 forgets nothing. `fit` does not use it.
    initial_values
        First guesses of the recursion by parameter name [SI]; 0 for those not named.
    initial_variance
        Diagonal of P(0) of the recursion [squared unit of the parameters; over that of the level
        noise with the inertia sought]; None takes one that follows the size of the regressors and
        weighs nothing against them, whatever the units.
    level_noise
        For the recursion with the inertia sought: standard deviation of the energy level [J]. Its
        ratio to that of a disturbing force decides between levels and differences. Without a
        disturbing force it need not be given: 1 J is taken, on which no estimate depends unless
        there is an initial variance too.
    force_noise
        For the recursion only: standard deviation of a disturbance force [N or N m]. None
        estimates it from the innovations with the inertia known and nothing forgotten, and takes
        none otherwise.
    effort_delay
        For the recursion only: samples by which the effort acts after it is logged [-], also a
        fraction; negative if the effort is logged late. At most 30.
    position_noise, velocity_noise
        For the recursion only: standard deviation of the sensors' noise [m or rad, m/s or rad/s];
        None estimates it on the way. With the inertia known it is estimated on the way in any
        case, and this is its first guess.

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
    stribeck: StribeckEffect | tuple[StribeckEffect, ...] | None = None
    cutoff: float | None = None
    filter_order: int = 4
    forgetting_factor: float = 1.0
    initial_values: Mapping[str, float] | None = None
    initial_variance: float | None = None
    level_noise: float | None = None
    force_noise: float | None = None
    effort_delay: float = 0.0
    position_noise: float | None = None
    velocity_noise: float | None = None

    def __post_init__(self) -> None:
        check_given(
            self,
            positive,
            {
                "inertia": "kg or kg m^2",
                "load_inertia": "kg or kg m^2",
                "stiffness": "N/m or N m/rad",
                "cutoff": "Hz",
                "initial_variance": "(unit of the parameter)^2/J^2",
                "level_noise": "J",
            },
        )
        check_arm(self.load_inertia, self.stiffness)
        if not (self.filter_order >= 1 and float(self.filter_order).is_integer()):
            raise InputError(
                f"filter_order is {self.filter_order}, it must be a whole number, 1 or more",
                remedy="leave it at its default",
            )
        check_given(
            self,
            non_negative,
            {
                "force_noise": "N or N m",
                "position_noise": "m or rad",
                "velocity_noise": "m/s or rad/s",
            },
        )
        check_forgetting_factor(self.forgetting_factor)
        if self.inertia is None and self.force_noise and self.level_noise is None:
            raise InputError(
                f"force_noise is {self.force_noise:g} N or N m and no level_noise is given",
                remedy="give level_noise [J] as well: their ratio decides",
            )
        known = (*(() if self.inertia is not None else ("mass", "inertia")), *self.terms.names)
        guesses = first_guesses(self.initial_values, known)
        object.__setattr__(self, "initial_values", guesses)

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "energy"

    @property
    def options(self) -> dict[str, Any]:
        """Name and settings as plain values, for a result's provenance."""
        effects = [asdict(effect) for effect in self.terms.stribeck]
        return options_of(self) | {"stribeck": effects or None}

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(
            per_direction=self.per_direction, offset=self.offset, stribeck=self.stribeck
        )

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
            If the log is too short, nothing moves or pushes in it, or it lacks the load of a
            flexible arm whose inertia is sought.
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
        provenance = provenance_of(log, self.options)
        return self.fitted(solve(rows, estimator=self.name, provenance=provenance), rows)

    def fitted(self, estimate: FrictionEstimate, rows: Regression) -> Fit:
        """Return an estimate and its rows with what is known of the axis.

        Parameters
        ----------
        estimate
            Of the rows.
        rows
            From `regression`, whole or changed.
        """
        return Fit(
            estimate=estimate,
            rows=rows,
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
            stribeck=self.stribeck if isinstance(self.stribeck, StribeckEffect) else None,
            cutoff=self.cutoff,
            filter_order=self.filter_order,
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the balance.

        Raises
        ------
        InputError
            As `fit` does.
        """
        check_excited(log)
        settled, log, changes, lowered = self._settled(log)
        T = log.sampling_time
        least = settled._least_samples(T)
        parts = long_stretches(
            log,
            least,
            needed_by="",
            remedy="record a longer log, or raise the cutoff frequency",
        )
        low_pass = settled._low_pass(T)
        if self.inertia is not None:
            return work_regression(parts, self.model, low_pass, samples=len(log), notes=changes)
        levels = level_regression(
            parts,
            self.model,
            self.parameter_names(log.kind),
            low_pass,
            sampling_time=T,
            samples=len(log),
            notes=(*changes, *lowered),
        )
        return sought_regression(levels, parts, self.model, self._low_pass(T), notes=changes)

    def _settled(
        self, log: AxisLog
    ) -> tuple["EnergyEstimator", AxisLog, tuple[str, ...], tuple[str, ...]]:
        """Return the estimator with its cutoff chosen, the log as it is used, and notes on it.

        The last are on the cutoff, which matters to the energies only.
        """
        log, changes = resampled(log)
        arm = self.load_inertia is not None
        low_pass = self._low_pass(log.sampling_time)
        log, wrong = without_wrong_velocity(log, low_pass, load=arm)
        if self.cutoff is not None or self.inertia is not None:
            return self, log, (*changes, *wrong), ()
        cutoff, lowered = chosen_cutoff(log, low_pass, _LEAST_ROWS, load=arm)
        return replace(self, cutoff=cutoff), log, (*changes, *wrong), lowered

    def levels(self, log: AxisLog) -> list[tuple[EnergyLevels, AxisLog]]:
        """Return the energies of every stretch without gaps, beside that stretch of the log."""
        settled, log, *_ = self._settled(log)
        T = log.sampling_time
        low_pass = settled._low_pass(T)
        long = [part for part in log.segments() if len(part) >= settled._least_samples(T)]
        parts = reconstructed(long, self.model, low_pass)
        noise = noise_of_longest(parts, low_pass)
        return [(energy_levels(part, self.model, low_pass, noise, T), part) for part in parts]

    def _low_pass(self, sampling_time: float) -> LowPass:
        cutoff = default_cutoff(sampling_time) if self.cutoff is None else self.cutoff
        return LowPass(order=self.filter_order, cutoff=cutoff)

    def _least_samples(self, sampling_time: float) -> int:
        if self.inertia is not None:
            return _LEAST_ROWS
        return _LEAST_ROWS * block_size(self._low_pass(sampling_time), sampling_time)

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the online estimates.

        Viscous friction comes before Coulomb friction here; `values_at` has them the other way
        round.
        """
        mass = "mass" if kind == "linear" else "inertia"
        return (*(() if self.inertia is not None else (mass,)), *self.terms.names)

    def init(
        self, *, sampling_time: float, velocity_measured: bool = True, load_measured: bool = True
    ) -> State:
        """Return the state of the recursion before the first sample.

        Parameters
        ----------
        sampling_time
            [s].
        velocity_measured
            Whether the samples hold velocities. Without them give False: only the positions are
            read then, whatever stands in the place of a velocity. A state made for measured
            velocities takes samples whose velocities are all 0 without an error and learns nothing
            from them, ever.
        load_measured
            Whether the samples hold the motion of the load of a flexible arm. Without it give
            False: whatever stands in its place is not read, and the load is reconstructed from the
            motion of the driven mass, wherever it begins.

        Raises
        ------
        InputError
            If the sampling time is not positive, or the load is not measured and the inertia is
            sought.
        """
        T = positive("sampling time", sampling_time, "s")
        if self.inertia is not None:
            return first_work_state(
                model=self.model,
                inertia=self.inertia,
                sampling_time=T,
                velocity_measured=velocity_measured,
                load_measured=load_measured,
                forgetting_factor=self.forgetting_factor,
                initial_values=self._first_guesses(),
                initial_variance=self.initial_variance,
                force_noise=self.force_noise,
                effort_delay=self.effort_delay,
                position_noise=self.position_noise,
                velocity_noise=self.velocity_noise,
            )
        if self.load_inertia is not None and not load_measured:
            raise _load_needed()
        return first_state(
            model=self.model,
            sampling_time=T,
            velocity_measured=velocity_measured,
            cutoff=self._low_pass(T).cutoff,
            forgetting_factor=self.forgetting_factor,
            initial_values=self._first_guesses(),
            initial_variance=self.initial_variance,
            level_noise=self.level_noise,
            force_noise=self.force_noise or 0.0,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    @property
    def counts_missing(self) -> bool:
        """Whether a sample that is not finite is counted in the state instead of refused."""
        return self.inertia is not None

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`); the estimates stand at `values_at`."""
        return energy_step if self.inertia is None else work_step

    @property
    def values_at(self) -> slice:
        """Where Coulomb and viscous friction lie in a state, in that order.

        ``state[values_at]`` is ``(Coulomb, viscous)``, whereas `parameter_names`, the estimates
        of `step` and `run`, and `covariance` have viscous friction before Coulomb friction.

        Raises
        ------
        InputError
            If there are two of each.
        """
        if self.per_direction:
            raise InputError(
                "per_direction is asked for, so that there are two Coulomb frictions",
                remedy="estimate both directions together",
            )
        viscous = VALUES + self._names.index("viscous_friction")
        return slice(viscous + 1, viscous - 1, -1)

    @property
    def _places(self) -> list[int]:
        return list(range(VALUES, VALUES + len(self._names)))

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
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
        run = energy_run if self.inertia is None else work_run
        load = self.load_inertia is not None and (
            self.inertia is None or bool(state[SEEN + 2] > 0.0)
        )
        return run(state, samples_of(state, log, load=load))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P of the recursion, in the order of `parameter_names`.

        It is infinite for a parameter that nothing has told of yet.
        """
        return covariance_in(state) if self.inertia is None else work_covariance(state)

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals of the estimates, in the order of `parameter_names` [SI].

        They allow for correlated residuals (`stickslip.estimation.online.batches`), but not for
        forgetting, and are infinite until there are enough batches of samples in slip.

        Raises
        ------
        InputError
            If the inertia is sought.
        """
        self._check_supervised()
        return work_intervals(state)

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far.

        Raises
        ------
        InputError
            If the inertia is sought.
        """
        self._check_supervised()
        return work_health(state)

    def _check_supervised(self) -> None:
        """Raise unless the recursion is the one with the inertia known."""
        if self.inertia is None:
            raise InputError(
                "the inertia is sought, and the recursion has neither intervals nor counts then",
                remedy="give the inertia",
            )

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return self.parameter_names("linear")

    def _first_guesses(self) -> list[float]:
        guesses = self.initial_values or {}
        mass = guesses.get("mass", guesses.get("inertia", 0.0))
        return [
            mass if name in {"mass", "inertia"} else guesses.get(name, 0.0) for name in self._names
        ]


def _load_needed() -> InputError:
    return InputError(
        "the load of the arm is not measured, and its inertia is sought",
        remedy="give the inertia of the driven side: the load is then reconstructed",
    )
