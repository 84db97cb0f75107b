"""The energy-based estimator of Coulomb and viscous friction.

Source: van de Wijdeven (2002), part A, chapters 3 and 4.
"""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.method import KnownInertiaMethod
from stickslip.estimation.energy.levels import EnergyLevels
from stickslip.estimation.energy.method import EnergySettings
from stickslip.estimation.energy.samples import samples_of
from stickslip.estimation.energy.unknown_inertia.method import UnknownInertiaMethod
from stickslip.estimation.fit.fitted import LeastSquaresEstimator
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import check_excited
from stickslip.estimation.online.faults.admission import set_admission
from stickslip.estimation.online.faults.guard import set_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.intervals.batches import clear_batches
from stickslip.estimation.online.intervals.contrasts import intervals_in
from stickslip.estimation.online.method import Kernel, OnlineMethod, State
from stickslip.estimation.online.recursion import VALUES, set_friction, set_information, set_prior
from stickslip.estimation.settings import options_of
from stickslip.records import AxisLog, InputError, positive


@dataclass(frozen=True, kw_only=True)
class EnergyEstimator(EnergySettings, OnlineMethod, LeastSquaresEstimator):
    """Friction from the balance of energies: what goes in and is not stored was dissipated.

    With the inertia known (and the spring, of a flexible arm), the balance is taken as work along
    motions without noise: states are smoothed with friction as a free force, which gives the
    direction of friction, and the balance is whitened by the Kalman filter of the known masses
    (see `stickslip.estimation.energy.known_inertia.balance`). Neither the noise nor how the effort
    depends on it has to be known.

    With the inertia unknown, `fit` does the same with all force but friction as one more column. It
    begins with what the recursion does: the measured energies are regressed on the distance
    travelled (Coulomb friction), the integral of the squared velocity (viscous friction), the
    displacement (offset) and the kinetic energy of a unit inertia. Sensor noise makes the level of
    the measured energy uncertain at every sample; a disturbance force adds up in it. Where the
    samples show model mismatch, `fit` ends with that, too.

    Either way, the disturbance beside the noise is estimated by maximum likelihood, and the rows
    are weighted accordingly (generalised least squares).

    Attributes
    ----------
    inertia
        Moving mass or inertia if it is known [kg or kg m^2], of a flexible arm that of the driven
        side; None estimates it.
    level_noise
        For the recursion with an unknown inertia: standard deviation of the energy level [J]. Its
        ratio to that of a disturbance force decides between levels and differences. It is needed
        with a given ``force_noise`` only: otherwise the ratio is estimated, and no estimate depends
        on the default of 1 J unless there is an initial variance too.
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis. With a known
        inertia the log need not hold the load: its motion is then reconstructed from that of the
        driven mass, wherever it began. With an unknown inertia it must hold its position.
    per_direction
        Whether Coulomb and viscous friction are estimated for each direction separately.
    offset
        Whether a constant offset is estimated; None estimates it unless ``per_direction``.
    stribeck
        How the step from static to Coulomb friction fades with speed, to estimate static friction
        too; None does not. Several, of which each has a step of its own, are for
        `StribeckEstimator`, which finds the one that fits.
    cutoff
        Cutoff frequency of the low-pass for noisy signals [Hz]; None for a tenth of the sampling
        rate and at most 100 Hz; a fit with unknown inertia lowers it where velocities from noisy
        positions need it.
    filter_order
        Order of one pass of that low-pass.
    forgetting_factor
        Forgetting factor of the recursion per sample, in (0, 1] [-]; 1 forgets nothing. `fit` does
        not use it.
    initial_values
        First guesses of the recursion by parameter name [SI]; 0 for those not named.
    initial_variance
        P(0) of the recursion [product of the units of two parameters; over the squared level noise
        with an unknown inertia]: its diagonal value, or the whole covariance of the first guesses
        as rows of numbers, in the order of `parameter_names`. None for one that follows the size of
        the regressors and has a negligible weight against them, whatever the units.
    force_noise
        For the recursion only: standard deviation of a disturbance force [N or N m]. None
        estimates it from the innovations if nothing is forgotten, and takes none otherwise.
    effort_delay
        For the recursion only: samples by which the effort acts after it is logged [-], also a
        fraction; negative if it acts before it is logged. At most 30.
    position_noise, velocity_noise
        For the recursion only: standard deviation of the sensors' noise [m or rad, m/s or rad/s];
        None estimates it from the samples. With a known inertia it is estimated in any case, and
        this is its first guess.

    Raises
    ------
    InputError
        If a setting is out of range, offset and per_direction are both requested, only one of load
        inertia and stiffness is given, or a first guess for what is not estimated.

    Examples
    --------
    >>> EnergyEstimator(inertia=95.1, offset=False).terms.names
    ('viscous_friction', 'coulomb_friction')
    """

    name: ClassVar[str] = "energy"

    @cached_property
    def method(self) -> KnownInertiaMethod | UnknownInertiaMethod:
        """The method for a known or for an unknown inertia."""
        known = self.inertia is not None
        return KnownInertiaMethod(self) if known else UnknownInertiaMethod(self)

    @property
    def options(self) -> dict[str, Any]:
        """Name and settings as plain values, for a result's provenance."""
        effects = [asdict(effect) for effect in self.terms.stribeck]
        return options_of(self) | {"stribeck": effects or None}

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the balance; raises as `fit`."""
        check_excited(log)
        return self.method.regression(log)

    def levels(self, log: AxisLog) -> list[tuple[EnergyLevels, AxisLog]]:
        """Return the energies of every stretch without gaps, beside that stretch of the log."""
        return self.method.levels(log)

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
        T = positive("sampling_time", sampling_time, "s")
        method, state = self.method, np.zeros(self.method.state_size)
        own = method.fields(state)
        self._set_recursion(own, T, velocity_measured=velocity_measured)
        load = self.load_inertia is not None and load_measured
        measured = (velocity_measured, load, load and velocity_measured)
        method.initialise(own, T, measured)
        set_admission(
            own.admission,
            sampling_time=T,
            effort_delay=self.effort_delay,
            inertia=self.inertia,
            measured=measured,
        )
        clear_batches(own.batches)
        set_guard(state, own.guard)
        return state

    def _set_recursion(self, own: Any, sampling_time: float, *, velocity_measured: bool) -> None:
        """Write settings, first guesses and P(0) of the recursion into the fields of a state."""
        s, variance = own.recursion, self.initial_variance
        guesses = dict(self.initial_values or {})
        guesses["mass"] = guesses.get("mass", guesses.get("inertia", 0.0))
        values = [guesses.get(name, 0.0) for name in self._names]
        s.sampling_time, s.forgetting = sampling_time, self.forgetting_factor
        s.load_inertia, s.stiffness = self.load_inertia or 0.0, self.stiffness or 0.0
        s.differentiates = not velocity_measured
        set_friction(s, self.terms)
        set_prior(s, values, variance)
        set_information(own.eta, own.information, values, variance)

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`); the estimates stand at `values_at`."""
        return self.method.kernel

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
            raise InputError("places_per_direction")
        viscous = VALUES + self._names.index("viscous_friction")
        return slice(viscous + 1, viscous - 1, -1)

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return self.parameter_names("linear")

    @property
    def _places(self) -> slice:
        return slice(VALUES, VALUES + len(self._names))

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates after each.

        Raises
        ------
        InputError
            If the log has a gap or another sampling time than the state, or lacks a signal that the
            state was made for.
        """
        load = bool(self.method.fields(state).admission.has_load)
        return self.method.run_kernel(state, samples_of(state, log, load=load))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return the covariance of the recursion, in the order of `parameter_names` [SI].

        It holds for white noise and friction as in the model, scaled by the mean squared
        innovation, and serves gates and planning. It is infinite for a parameter that no row
        depends on yet. The uncertainty of the estimates is that of `intervals`.
        """
        return self.method.covariance(state)

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals of the estimates, in the order of `parameter_names` [SI].

        They allow for correlated residuals (`stickslip.estimation.online.intervals.batches`) and
        for errors of the model at low speed or under acceleration
        (`stickslip.estimation.online.intervals.contrasts`), but not for forgetting. They
        are infinite until there are enough batches of samples in slip.
        """
        return intervals_in(self.method.fields(state))

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""
        own = self.method.fields(state)
        return health_of(
            own.admission,
            resets=int(own.guard.resets),
            force_events=own.force_events,
            force_noise=self.method.force_noise(own),
        )
