"""An axis of known masses and spring over one sample, and its motion with friction as a free force.

The states z are position and velocity of the driven mass, then those of the load, if there is one.
With the effort u held over a sample, z(k+1) = A z(k) + B u(k).

Nothing is assumed of any law of friction: friction f is one more state, a random walk whose rate is
white,

    z(k+1) = A z(k) + B u(k) + w(k),    cov w = rate * integral of exp(F s) b b' exp(F' s) ds,

F being the rates of the states and b the direction of f. The Kalman smoother of that is the motion
that the sensors show, with as little of their noise as can be without knowing the friction.

A load whose position is not measured is estimated too: the path of the driven mass shows how the
load was pulled, and the pull on the driven mass shows where the load is and where it began.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import expm

from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.fit.least_cost import least_decades
from stickslip.numerics import kalman
from stickslip.records import AxisLog

_NODES = 6  # exact for polynomials of degree 11; the integrand is one of degree 4, nearly
_DECADES = (-7.0, 5.0)  # of the friction's rate of change, around that of the net force
_GRID = 9  # places on that range where the search begins [-]
_DECADE_TOLERANCE = 0.1  # of the search [decades]
_LOAD_VELOCITY = 3  # number of that state
_LARGER = 10.0
"""How many times what the log shows the load may be stretched, or as fast, when it begins."""


def _rates(model: AxisModel) -> Float[np.ndarray, "s s"]:
    """Return the rates of the states without effort and friction, z' = F z."""
    m, m2, k = model.driven, model.load_inertia, model.stiffness
    if m2 is None or k is None:
        return np.array([[0.0, 1.0], [0.0, 0.0]])
    F = np.zeros((4, 4))
    F[0, 1] = F[2, 3] = 1.0
    F[1, 0], F[1, 2] = -k / m, k / m
    F[3, 0], F[3, 2] = k / m2, -k / m2
    return F


@dataclass(frozen=True, kw_only=True)
class HeldAxis:
    """An axis without friction over one sample: ``z(k+1) = A z(k) + B force + C slope``."""

    transition: Float[np.ndarray, "s s"]  # A
    held: Float[np.ndarray, " s"]  # B, of a unit force on the driven mass held over the sample
    ramped: Float[np.ndarray, " s"]  # C, of a force of unit slope, 0 in the middle of the sample
    sampling_time: float  # [s]

    @classmethod
    def of(cls, model: AxisModel, sampling_time: float) -> "HeldAxis":
        """Return the axis of known masses and spring; rigid without a load."""
        T, F = sampling_time, _rates(model)
        s = F.shape[0]
        rate = np.zeros((s + 2, s + 2))
        rate[:s, :s] = F
        rate[1, s] = 1.0 / model.driven
        rate[s, s + 1] = 1.0  # the force grows by its slope
        over = np.asarray(expm(rate * T))
        return cls(
            transition=over[:s, :s].copy(),
            held=over[:s, s].copy(),
            ramped=over[:s, s + 1] - 0.5 * T * over[:s, s],
            sampling_time=T,
        )

    def whiten(
        self,
        sensors: "SensorData",
        effort: Float[np.ndarray, " n"],
        friction: Float[np.ndarray, "n p"],
        slope: Float[np.ndarray, "n p"],
        disturbance: Float[np.ndarray, " n"],
    ) -> tuple[Float[np.ndarray, "r p+1"], float]:
        """Return the whitened rows, and the sum of the logarithms of their variances.

        A filter is linear: run with the measurements, and beside them with each friction regressor
        as the only force, it turns ``measured = known motion + parameters * responses + noise``
        into rows whose noise is white: least squares on them is generalised least squares on the
        log. A row, one a sensor and sample from the second sample on, holds the measurement, then
        the response to each regressor, less what the filter predicts, over the standard deviation
        of that.

        ``friction`` and ``slope`` are the force of each regressor in the middle of each sample and
        its slope there, ``disturbance`` is the variance of the mean of an unknown force over each
        sample, within which it is as rough [N^2 or (N m)^2].
        """
        states = sensors.states
        n, p = friction.shape
        inputs = np.zeros((n - 1, 2, p + 1))
        inputs[:, 0, 0] = effort[:-1]
        inputs[:, 0, 1:], inputs[:, 1, 1:] = -friction[:-1], -slope[:-1]
        outputs = np.zeros((n - 1, states.size, p + 1))
        outputs[:, :, 0] = sensors.measured[1:]
        start = np.zeros((sensors.first.size, p + 1))
        start[states, 0] = sensors.measured[0]
        rough = 12.0 / self.sampling_time**2  # variance of the slope of a white force
        spread = np.outer(self.held, self.held) + np.outer(self.ramped, self.ramped) * rough
        model = kalman.LinearModel(
            A=self.transition,
            B=np.column_stack([self.held, self.ramped]),
            Q=spread,
            factors=disturbance[:-1],
            sensors=states,
            R=sensors.channels[:, 1].copy(),
        )
        rows, logs = kalman.whiten(model, inputs, outputs, start, np.diag(sensors.first))
        rows[:, :, 1:] *= -1.0  # measured less known motion = parameters times responses
        return rows.reshape(-1, p + 1), logs


@dataclass(frozen=True, kw_only=True)
class SensorData:
    """Measurements of a stretch without gaps, and the variance of its first state around them."""

    measured: Float[np.ndarray, "n m"]  # one column a sensor
    channels: Float[np.ndarray, "m 2"]  # number of the state it measures, variance of its noise
    first: Float[np.ndarray, " s"]  # variance of the first state, friction left out

    @property
    def states(self) -> Int[np.ndarray, " m"]:
        """Number of the state that each sensor measures."""
        return self.channels[:, 0].astype(np.int64)


def sensor_data(
    masses: Sequence[tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"] | None]],
    noises: Sequence[tuple[float, float]],
    sampling_time: float,
) -> SensorData:
    """Return the measured positions, and velocities if there are any, of each mass.

    ``noises`` are the standard deviations of both [SI].
    """
    measured: list[Float[np.ndarray, " n"]] = []
    channels: list[tuple[float, float]] = []
    first: list[float] = []
    for k, ((x, v), (position, velocity)) in enumerate(zip(masses, noises, strict=True)):
        measured.append(x)
        channels.append((2.0 * k, position**2))
        if v is not None:
            measured.append(v)
            channels.append((2.0 * k + 1.0, velocity**2))
        fastest = float(np.max(np.abs(np.diff(x)))) / sampling_time
        first += [position**2, fastest**2 if v is None else velocity**2]
    return SensorData(
        measured=np.column_stack(measured), channels=np.array(channels), first=np.array(first)
    )


@dataclass(frozen=True, kw_only=True)
class DrivenMotion(SensorData):
    """Measurements from which the motion of the driven mass is smoothed, and the force on it."""

    force: Float[np.ndarray, " n"]
    """On the driven mass, held over each sample, without friction and the forces that the states
    give [N or N m]."""
    force_squared: float
    """Integral of its square, above what it takes to reach or lose the largest speed."""
    duration: float  # [s]
    origin: float = 0.0  # position that the measured ones are counted from [m or rad]

    @classmethod
    def of(
        cls,
        x: Float[np.ndarray, " n"],
        v: Float[np.ndarray, " n"] | None,
        force: Float[np.ndarray, " n"],
        inertia: float,
        sampling_time: float,
        noise: tuple[float, float],
    ) -> "DrivenMotion":
        """Return what the sensors of the driven mass show; ``noise`` of position and velocity."""
        fastest = float(np.max(np.abs(np.diff(x)))) / sampling_time
        duration = x.size * sampling_time
        squared = sampling_time * float(np.sum(force**2)) + (inertia * fastest) ** 2 / duration
        return cls(
            **vars(sensor_data([(x, v)], [noise], sampling_time)),
            force=force,
            force_squared=squared,
            duration=duration,
        )

    @classmethod
    def of_arm(
        cls, part: AxisLog, model: AxisModel, noise: tuple[float, float], load_noise: float
    ) -> "DrivenMotion":
        """Return what the sensors of an arm show while nothing measures the load's position.

        The load begins anywhere, as fast as it likes. ``load_noise`` is that of the velocity of the
        load, if it is measured.
        """
        T, x, v2 = part.sampling_time, part.measured_position, part.measured_load_velocity
        k, m2 = model.stiffness or 0.0, model.load_inertia or 0.0
        own = cls.of(x - x[0], part.measured_velocity, part.effort, model.driven, T, noise)
        stretched = _LARGER * (float(np.ptp(x)) + float(np.max(np.abs(part.effort))) / k)
        fastest = float(np.max(np.abs(np.diff(x)))) / T
        swinging = np.sqrt(k / m2) * stretched + fastest
        measured, channels = own.measured, own.channels
        if v2 is not None:
            swinging = load_noise
            measured = np.column_stack([measured, v2])
            channels = np.vstack([channels, (float(_LOAD_VELOCITY), load_noise**2)])
        first = np.append(own.first, (stretched**2, swinging**2))
        return replace(own, measured=measured, channels=channels, first=first, origin=float(x[0]))


@dataclass(frozen=True, kw_only=True)
class HiddenLoad:
    """Smoothed motion of a load whose position is not measured."""

    position: Float[np.ndarray, " n"]  # [m or rad]
    velocity: Float[np.ndarray, " n"]  # [m/s or rad/s]
    spread: Float[np.ndarray, " n"]  # standard deviation of the position [m or rad]


@dataclass(frozen=True, kw_only=True)
class FreeMotion:
    """Smoothed motion of the driven mass, and the friction that it leaves."""

    position: Float[np.ndarray, " n"]  # [m or rad]
    velocity: Float[np.ndarray, " n"]  # [m/s or rad/s]
    friction: Float[np.ndarray, " n"]  # without the spring [N or N m]
    velocity_spread: Float[np.ndarray, " n"]  # standard deviation of the velocity [m/s or rad/s]
    load: HiddenLoad | None = None


@dataclass(frozen=True, kw_only=True)
class FreeAxis:
    """An axis over one sample, friction the last of its s states."""

    transition: Float[np.ndarray, "s s"]  # A
    held: Float[np.ndarray, " s"]  # B
    walk: Float[np.ndarray, "s s"]  # what friction of unit white rate adds to the covariance

    @classmethod
    def of(cls, model: AxisModel, sampling_time: float) -> "FreeAxis":
        """Return the axis of known masses and spring; rigid without a load."""
        body = HeldAxis.of(model, sampling_time)
        s = body.held.size
        transition = np.eye(s + 1)
        transition[:s, :s], transition[:s, s] = body.transition, -body.held
        return cls(
            transition=transition,
            held=np.append(body.held, 0.0),
            walk=walk_covariance(model, sampling_time),
        )

    def likeliest_rate(self, stretches: Sequence[DrivenMotion]) -> float:
        """Return the spectral density of friction's rate that makes a log likeliest.

        [N^2/s or (N m)^2/s], some decades around the mean squared net force over the time.
        """
        squared = sum(one.force_squared for one in stretches)
        typical = squared / sum(one.duration for one in stretches) ** 2
        return likeliest_rate(typical, lambda rate: sum(self.cost(one, rate) for one in stretches))

    def cost(self, measured: DrivenMotion, rate: float) -> float:
        """Return twice the negative log likelihood of a stretch, but for a constant."""
        return kalman.cost(*self._problem(measured, rate, np.ones(measured.force.size)))

    def motion(
        self,
        measured: DrivenMotion,
        rate: float,
        freedom: Float[np.ndarray, " n"] | None = None,
    ) -> FreeMotion:
        """Return the motion with a friction of the given spectral density of its rate.

        ``freedom`` is a factor of the rate in each sample.
        """
        s = self.held.size
        freedom = np.ones(measured.force.size) if freedom is None else freedom
        # Of the velocity of the driven mass and the position of the load
        spreads_of = np.arange(1, s // 2 + 1)
        smooth = kalman.smooth(*self._problem(measured, rate, freedom), spreads_of).T
        load = None
        if s > 3:
            load = HiddenLoad(
                position=measured.origin + smooth[2], velocity=smooth[3], spread=smooth[s + 1]
            )
        return FreeMotion(
            position=measured.origin + smooth[0],
            velocity=smooth[1],
            friction=smooth[s - 1],
            velocity_spread=smooth[s],
            load=load,
        )

    def _problem(
        self, shown: DrivenMotion, rate: float, freedom: Float[np.ndarray, " n"]
    ) -> tuple[
        kalman.LinearModel,
        Float[np.ndarray, "n-1 1"],
        Float[np.ndarray, "n-1 m"],
        Float[np.ndarray, " s"],
        Float[np.ndarray, "s s"],
    ]:
        """Return the arguments of the filter: the first sample is in the first state."""
        start = np.zeros(self.held.size)
        start[shown.states] = shown.measured[0]
        friction = shown.force_squared / shown.duration + rate * shown.duration
        model = kalman.LinearModel(
            A=self.transition,
            B=self.held[:, None],
            Q=rate * self.walk,
            factors=freedom[:-1],
            sensors=shown.states,
            R=shown.channels[:, 1].copy(),
        )
        return (
            model,
            shown.force[:-1, None],
            shown.measured[1:],
            start,
            np.diag(np.append(shown.first, friction)),
        )


def likeliest_rate(typical: float, cost: Callable[[float], float]) -> float:
    """Return the rate at which a cost is least, some decades around a typical one."""
    found = least_decades(
        lambda decades: cost(typical * 10.0**decades),
        _DECADES,
        grid=_GRID,
        tolerance=_DECADE_TOLERANCE,
    )
    return typical * 10.0**found


def walk_covariance(model: AxisModel, sampling_time: float) -> Float[np.ndarray, "s s"]:
    """Return what a friction of unit white rate adds in a sample to the covariance of the states.

    The integral of exp(F s) b b' exp(F' s) over the sample by Gauss' rule: every term keeps the
    digits of its small entries.
    """
    rates = _rates(model)
    s = rates.shape[0] + 1
    F = np.zeros((s, s))
    F[: s - 1, : s - 1], F[1, s - 1] = rates, -1.0 / model.driven
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    total = np.zeros((s, s))
    for node, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
        column = np.asarray(expm(F * (0.5 * sampling_time * (1.0 + node))))[:, s - 1]
        total += 0.5 * sampling_time * weight * np.outer(column, column)
    return total
