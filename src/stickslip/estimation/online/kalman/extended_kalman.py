"""An extended Kalman filter with the friction parameters among its states.

R. G. Brown and P. Y. C. Hwang (1997), "Introduction to Random Signals and Applied Kalman
Filtering", third edition. Only the covariance is linearised: the mean follows the exact motion with
its exact derivatives, through stops and breakaways too as soon as their instants are known (see
`stickslip.estimation.online.kalman.kernels`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.published.sensor_noise import sensor_noise_of
from stickslip.estimation.energy.samples import check_fits
from stickslip.estimation.fit.solve import check_excited, provenance_of
from stickslip.estimation.online.faults.admission import set_admission
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.intervals.batches import clear_batches, intervals_of
from stickslip.estimation.online.intervals.contrasts import widened
from stickslip.estimation.online.kalman import state as at
from stickslip.estimation.online.kalman.kernels import RESOLUTION, ekf_run, ekf_step, forget_motion
from stickslip.estimation.online.method import Kernel, OnlineMethod, State
from stickslip.estimation.online.observers.least_squares_observer import LeastSquaresObserver
from stickslip.estimation.point_estimate import NORMAL_95, estimate_of
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_given, first_guesses, options_of
from stickslip.estimation.signals.kinematics import slow_speed
from stickslip.estimation.signals.sensor_noise import longest_in_motion, position_noise
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    InputError,
    non_negative,
    positive,
    whole,
)

_FRICTION = ("viscous_friction", "coulomb_friction", "offset")
_FIRST_FORCE = 0.1
"""Force noise at the start of its estimation, over the force at rest. Too large a value costs some
information from the first samples; too small a value makes them count too much."""
_ROUNDING = 1e-7  # noise that is taken for none, over the range of what is measured
_LEAST_DISTURBANCE = 1e-6  # of the rms effort
_BISECTIONS = 12  # of 14 in the logarithm: the force noise to 0.3 %
_CHANNELS = 3  # effort, position and velocity of each sample that is kept
_INCONSISTENT = 1.5
"""Mean squared innovation over its variance beyond which the filter is too sure of itself."""


@dataclass(frozen=True, kw_only=True)
class ExtendedKalmanFilter(OnlineMethod):
    """Coulomb and viscous friction of a rigid axis as states of an extended Kalman filter.

    Attributes
    ----------
    inertia
        Moving mass or inertia [kg or kg m^2].
    offset
        Whether a constant offset is estimated.
    position_noise, velocity_noise
        Standard deviations of the sensors' white noise [m or rad, m/s or rad/s]; None estimates
        them from the log that `fit` gets; on line they must be given.
    rest_speed
        Speed below which the axis may be at rest, and nothing is learned while friction is not
        known well [m/s or rad/s]; None takes what the log suggests. 0 is the plain filter, which
        from the start takes every sample as one of motion or of rest according to its own states.
    rest_force
        Standard deviation of the force that acts there [N or N m]; None takes the rms effort of the
        log.
    force_noise
        Standard deviation of a disturbance force, white from sample to sample [N or N m]. None
        estimates it: online from the innovations as they come, in `fit` the least one that makes
        the innovations of the whole log as large as expected.
    effort_delay
        Samples by which the effort acts after it is logged [-], also a fraction; negative if it
        acts before it is logged. At most 30.
    drift
        By parameter name, how far each wanders in a second [unit of the parameter / s^(1/2)];
        0 for those not named.
    initial_values
        First guesses by parameter name [SI]; 0 for those not named.
    initial_deviations
        Standard deviations of the first guesses by parameter name [SI]; where one is not named,
        `fit` takes what the largest effort and speed of the log allow.
    exact_events
        Whether stops, rests and breakaways are used once friction is known so well that
        their samples follow from it; not where a force disturbs. Friction at rest is then taken for
        Coulomb friction, until the motion shows that it is more. False for an axis of which that
        is known: a difference of a few per cent is detected only after some time, and biases the
        estimate until then.
    memory
        Number of the first samples that are kept, to go through their stops and rests again when
        friction is known; if they are not enough, the information in those is lost.

    Raises
    ------
    InputError
        If a setting is out of range, or given for what is not estimated.

    Examples
    --------
    >>> ExtendedKalmanFilter(inertia=95.1).parameter_names("linear")
    ('viscous_friction', 'coulomb_friction')
    """

    inertia: float
    offset: bool = False
    position_noise: float | None = None
    velocity_noise: float | None = None
    rest_speed: float | None = None
    rest_force: float | None = None
    force_noise: float | None = None
    effort_delay: float = 0.0
    drift: Mapping[str, float] | None = None
    initial_values: Mapping[str, float] | None = None
    initial_deviations: Mapping[str, float] | None = None
    exact_events: bool = True
    memory: int = 2048
    name: ClassVar[str] = "ekf"

    def __post_init__(self) -> None:
        positive("inertia", self.inertia, "kg or kg m^2")
        units = {
            "position_noise": "m or rad",
            "velocity_noise": "m/s or rad/s",
            "rest_speed": "m/s or rad/s",
            "rest_force": "N or N m",
            "force_noise": "N or N m",
        }
        check_given(self, non_negative, units)
        for name in ("drift", "initial_values", "initial_deviations"):
            given = first_guesses(getattr(self, name), self.parameter_names("linear"))
            if name != "initial_values":
                for key, value in given.items():
                    non_negative(f"{name.replace('_', ' ')} of {key}", value, "SI")
            object.__setattr__(self, name, given)
        whole("memory", self.memory, unit="samples")

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the online estimates."""
        del kind
        return _FRICTION if self.offset else _FRICTION[:2]

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`); it does not read the load."""
        return ekf_step

    @property
    def values_at(self) -> slice:
        """Where Coulomb and viscous friction lie in a state, in that order."""
        return slice(at.VALUES + 1, at.VALUES - 1, -1)

    def init(self, *, sampling_time: float, velocity_measured: bool = True) -> State:
        """Return the state before the first sample.

        Parameters
        ----------
        sampling_time
            [s].
        velocity_measured
            Whether the samples hold velocities; if not, what stands in their place is not read.

        Raises
        ------
        InputError
            If the noise, the speed and force of rest, or a deviation of a first guess is not given.
        """
        needed = ["position_noise", "rest_speed"]
        needed += ["velocity_noise"] if velocity_measured else []
        needed += ["rest_force"] if self.rest_speed != 0 else []
        spreads = {name: (self.initial_deviations or {}).get(name) for name in self._names}
        missing = [name for name in needed if getattr(self, name) is None]
        missing += [f"the deviation of {name}" for name in spreads if spreads[name] is None]
        if missing:
            raise InputError("filter_needs", names=missing)
        T = positive("sampling_time", sampling_time, "s")
        vector = np.zeros(at.MEMORY + _CHANNELS * self.memory)
        s = at.fields(vector)
        s.period = T
        s.mass, s.parameters, s.gate_scale = self.inertia, len(self._names), 1.0
        s.replayed = 1  # the sharp filter begins at the first sample
        force = self.force_noise
        if force is None:
            force = _FIRST_FORCE * (self.rest_force or spreads["coulomb_friction"] or 0.0)
            s.adapted = 1
        s.force_variance = force**2
        set_admission(
            s.admission,
            sampling_time=T,
            effort_delay=self.effort_delay,
            inertia=self.inertia,
            measured=(velocity_measured, False, False),
        )
        clear_batches(s.batches)
        clear_batches(s.sharp_batches)
        s.position_variance = (self.position_noise or 0.0) ** 2
        s.velocity_variance = (self.velocity_noise or 0.0) ** 2 if velocity_measured else np.inf
        s.rest_speed, s.rest_variance = self.rest_speed or 0.0, (self.rest_force or 0.0) ** 2
        sharpens = self.exact_events and self.rest_speed and not self.force_noise
        s.stage = at.LEARNING if sharpens else at.LEFT
        variances = np.zeros(at.FRICTION)
        for k, name in enumerate(self._names):
            s.values[k] = (self.initial_values or {}).get(name, 0.0)
            s.drift[k] = T * (self.drift or {}).get(name, 0.0) ** 2
            variances[k] = (spreads[name] or 0.0) ** 2
        s.careful.z[2:] = s.good = s.values
        s.careful.walk = s.drift + RESOLUTION * variances
        s.careful.P[2:, 2:] = s.good_covariance = np.diag(variances)
        forget_motion(vector)
        return vector

    @property
    def _names(self) -> tuple[str, ...]:
        return self.parameter_names("linear")

    @property
    def _places(self) -> slice:
        return slice(at.VALUES, at.VALUES + len(self._names))

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates after each.

        The log must have the sampling time of the state, and a velocity where it was made for one.
        """
        return self._run(state, log)[:2]

    def normalised_innovations(self, state: State, log: AxisLog) -> Float[np.ndarray, " n"]:
        """Return the squared innovations of a run over their variances, sums of a sample [-]."""
        return self._run(state, log)[2]

    def _run(
        self, state: State, log: AxisLog
    ) -> tuple[State, Float[np.ndarray, "n p"], Float[np.ndarray, " n"]]:
        """Return the new state, the estimates and the squared innovations over their variances."""
        check_fits(log, float(at.fields(state).period))
        measured = log.measured_velocity
        if measured is None and np.isfinite(at.fields(state).velocity_variance):
            raise InputError("state_needs_velocity", where=log.name, of="")
        after = state.copy()
        zeros = np.zeros(len(log))
        velocity = zeros if measured is None else measured
        samples = np.column_stack([log.effort, log.measured_position, velocity, zeros, zeros])
        history, innovations = ekf_run(after, samples)
        return after, history[:, : len(self._names)], innovations

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return the covariance of the filter's model, in the order of `parameter_names` [SI].

        It holds for white innovations and friction as in the model, and serves gates and planning.
        The uncertainty of the estimates is that of `intervals`, which need neither.
        """
        p, s = len(self._names), at.fields(state)
        used = s.sharp if s.stage == at.TRUSTED else s.careful
        return used.P[2 : 2 + p, 2 : 2 + p].copy()

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals of the estimates, in the order of `parameter_names` [SI].

        They allow for correlated innovations (`stickslip.estimation.online.intervals.batches`) and
        for errors of the model at low speed or under acceleration
        (`stickslip.estimation.online.intervals.contrasts`). They are infinite until there
        are enough batches of samples in slip.
        """
        p, s = len(self._names), at.fields(state)
        information = np.zeros((at.FRICTION, at.FRICTION))
        information[:p, :p] = np.linalg.inv(self.covariance(state))
        if s.stage == at.TRUSTED:
            return intervals_of(s.sharp_batches, s.values[:p], information)
        intervals = intervals_of(s.batches, s.values[:p], information)
        return widened(s.contrasts, intervals, information)

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""
        s = at.fields(state)
        return health_of(
            s.admission,
            force_events=float(s.force_events),
            resets=int(s.resets),
            force_noise=float(np.sqrt(s.force_variance)),
        )

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Return what the filter ends at, with intervals.

        They are the filter's own, unless a disturbing force had to be found. The filter takes that
        for white; a slow one makes its intervals too narrow, and so they are then no narrower than
        those of least squares on the same log, which allow for correlation.

        Raises
        ------
        InputError
            If nothing moves or pushes in the log.
        """
        check_excited(log)
        log = repaired(log)
        settled = replace(self._settled(log), force_noise=self.force_noise or 0.0)
        state, surprise = settled._filtered(log)
        if self.force_noise is None and surprise > _INCONSISTENT:
            settled, state, surprise = settled._disturbed(log)
        measured = log.measured_velocity is not None
        rows = LeastSquaresObserver(inertia=self.inertia, offset=self.offset)
        regression = rows.regression(log, quiet=True)
        covariance = self.covariance(state)
        deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        notes = (
            f"sensor noise {settled.position_noise:.3g} {log.unit('position')}"
            + (f" and {settled.velocity_noise:.3g} {log.unit('velocity')}" if measured else ""),
            f"squared innovations are {surprise:.3g} times what the filter expects",
        )
        if settled.force_noise:
            force = f"{settled.force_noise:.3g} {log.unit('effort')}"
            notes = (*notes, f"a disturbing force, white from sample to sample, of {force}")
            widened = np.maximum(deviations, _half_widths(rows.fit(log)) / NORMAL_95)
            scale = widened / deviations
            deviations, covariance = widened, covariance * np.outer(scale, scale)
        return estimate_of(
            replace(regression, biased=log.clipped or surprise > _INCONSISTENT),
            state[self._places].tolist(),
            estimator=self.name,
            provenance=provenance_of(log, options_of(settled)),
            deviations=deviations.tolist(),
            covariance=covariance,
            notes=(*log.notes, *notes),
        )

    def _filtered(self, log: AxisLog) -> tuple[State, float]:
        """Return the state after a log, and the mean squared innovation over its variance [-]."""
        measured = log.measured_velocity is not None
        state = self.init(sampling_time=log.sampling_time, velocity_measured=measured)
        innovations: list[Float[np.ndarray, " n"]] = []
        for part in log.segments():
            forget_motion(state)
            state, _, squared = self._run(state, part)
            innovations.append(squared[1:])
        return state, float(np.mean(np.concatenate(innovations))) / (1 + measured)

    def _disturbed(self, log: AxisLog) -> tuple["ExtendedKalmanFilter", State, float]:
        """Return the filter with the force noise that its innovations ask for, and what it found.

        Bisection of its logarithm, below the rms effort.
        """
        most = float(np.sqrt(np.mean(log.effort**2)))
        low, high = np.log(_LEAST_DISTURBANCE * most), np.log(most)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            _, surprise = replace(self, force_noise=float(np.exp(middle)))._filtered(log)
            low, high = (middle, high) if surprise > 1.0 else (low, middle)
        found = replace(self, force_noise=float(np.exp(high)))
        return found, *found._filtered(log)

    def _settled(self, log: AxisLog) -> "ExtendedKalmanFilter":
        """Return the filter with the noise and the first deviations that a log suggests."""
        longest = longest_in_motion(log.segments())
        x, v = longest.measured_position, longest.measured_velocity
        found = sensor_noise_of(log) if v is not None else None
        own = position_noise(x) if found is None else found.position
        least = _ROUNDING * float(np.ptp(log.measured_position))
        # The longest stretch may be one at rest
        speeds = [
            np.diff(part.measured_position) / log.sampling_time
            if part.measured_velocity is None
            else part.measured_velocity
            for part in log.segments()
        ]
        speed = np.concatenate(speeds)
        quick = _ROUNDING * float(np.max(np.abs(speed)))
        effort = float(np.sqrt(np.mean(log.effort**2)))
        usual = float(np.sqrt(np.mean(speed**2)))
        spreads = {
            "viscous_friction": effort / usual,
            "coulomb_friction": effort,
            "offset": effort,
        }
        given = dict(self.initial_deviations or {})
        velocity_noise = 0.0 if found is None else max(found.velocity, quick)
        # Faster than this, no sample holds a reversal: effort and friction together stop it slower
        sudden = 2.0 * float(np.max(np.abs(log.effort))) / self.inertia * log.sampling_time
        slow = max(sudden, slow_speed(float(np.max(np.abs(speed))), velocity_noise))

        def chosen(value: float | None, suggested: float) -> float:
            return suggested if value is None else value

        return replace(
            self,
            position_noise=chosen(self.position_noise, max(own, least)),
            velocity_noise=chosen(self.velocity_noise, velocity_noise),
            rest_speed=chosen(self.rest_speed, slow),
            rest_force=chosen(self.rest_force, effort),
            initial_deviations={name: given.get(name, spreads[name]) for name in self._names},
        )


def _half_widths(estimate: FrictionEstimate) -> Float[np.ndarray, " p"]:
    """Return half of each 95 % interval [SI]; 0 where there is none."""
    widths = [
        0.0 if p.ci95 is None else 0.5 * (p.ci95[1] - p.ci95[0])
        for p in estimate.parameters.values()
    ]
    return np.array(widths)
