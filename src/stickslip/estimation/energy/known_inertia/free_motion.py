"""The motion of an axis with its friction as a free force: nothing is assumed of any law.

The states are position and velocity of the driven mass, then those of the load, if there is one,
and last the friction f, a random walk: f' is white. With the effort u held over a sample, the known
masses and the spring give

    z(k+1) = A z(k) + B u(k) + w(k),    cov w = rate * integral of exp(F s) b b' exp(F' s) ds,

F being the rates of the states and b the direction of f. The Kalman smoother of that is the motion
that the sensors show, with as little of their noise as can be without knowing the friction.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from stickslip.estimation.energy.known_inertia.innovations import HeldAxis
from stickslip.estimation.fit.least_cost import least_decades
from stickslip.numerics import kalman

__all__ = [
    "FreeAxis",
    "FreeMotion",
    "Shown",
    "free_motion",
    "likeliest_rate",
    "roaming",
    "shown_by_mass",
    "walk_covariance",
]

_NODES = 6  # exact for polynomials of degree 11; the integrand is one of degree 4, nearly
_DECADES = (-7.0, 5.0)  # of the friction's rate of change, around that of the net force
_GRID = 9
_DECADE_TOLERANCE = 0.1

_Problem = tuple[
    kalman.LinearModel,
    Float[np.ndarray, "_ 1"],
    Float[np.ndarray, "_ _"],
    Float[np.ndarray, " _"],
    Float[np.ndarray, "_ _"],
]
"""Model, inputs, measurements and first state, as `stickslip.numerics.kalman.cost` takes them."""


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What the sensors of a stretch without gaps show.

    Attributes
    ----------
    measured
        One column a sensor, shape (n, m).
    channels
        Number of the state that each measures, and the variance of its noise, shape (m, 2).
    first
        Variance of the first state, friction left out, around what is measured of it.
    force
        On the driven mass but for friction and what its states say, held over each sample
        [N or N m], shape (n,).
    force_squared
        Integral of its square, above what it takes to reach or lose the largest speed.
    duration
        How long the stretch is [s].
    """

    measured: Float[np.ndarray, "n m"]
    channels: Float[np.ndarray, "m 2"]
    first: Float[np.ndarray, " s"]
    force: Float[np.ndarray, " n"]
    force_squared: float
    duration: float


@dataclass(frozen=True, kw_only=True)
class FreeAxis:
    """An axis over one sample, friction the last of its states.

    Attributes
    ----------
    transition, held
        A and B, shapes (s, s) and (s,).
    walk
        What friction of unit white rate adds to the covariance of the states, shape (s, s).
    """

    transition: Float[np.ndarray, "s s"]
    held: Float[np.ndarray, " s"]
    walk: Float[np.ndarray, "s s"]

    @classmethod
    def of(
        cls,
        *,
        inertia: float,
        load_inertia: float | None = None,
        stiffness: float | None = None,
        sampling_time: float,
    ) -> "FreeAxis":
        """Return the axis of known masses and spring; rigid without a load.

        Parameters
        ----------
        inertia, load_inertia
            [kg or kg m^2].
        stiffness
            [N/m or N m/rad].
        sampling_time
            [s].
        """
        body = HeldAxis.of(
            inertia=inertia,
            load_inertia=load_inertia,
            stiffness=stiffness,
            sampling_time=sampling_time,
        )
        s = body.held.size
        transition = np.eye(s + 1)
        transition[:s, :s], transition[:s, s] = body.transition, -body.held
        return cls(
            transition=transition,
            held=np.append(body.held, 0.0),
            walk=walk_covariance(
                inertia=inertia,
                load_inertia=load_inertia,
                stiffness=stiffness,
                sampling_time=sampling_time,
            ),
        )

    def cost(self, shown: Shown, rate: float) -> float:
        """Return twice the negative log likelihood of a stretch, but for a constant.

        Parameters
        ----------
        shown
            The stretch.
        rate
            Spectral density of the friction's rate of change [N^2/s or (N m)^2/s].
        """
        return kalman.cost(*self._problem(shown, rate, np.ones(shown.force.size)))

    def smoothed(
        self,
        shown: Shown,
        rate: float,
        freedom: Float[np.ndarray, " n"],
        spreads_of: tuple[int, ...],
    ) -> Float[np.ndarray, "n c"]:
        """Return the states that a stretch shows, then standard deviations of some of them.

        Parameters
        ----------
        shown
            The stretch.
        rate
            As of `cost`.
        freedom
            Factor of the rate in each sample.
        spreads_of
            Numbers of the states whose standard deviations follow.
        """
        return kalman.smooth(*self._problem(shown, rate, freedom), np.array(spreads_of))

    def _problem(self, shown: Shown, rate: float, freedom: Float[np.ndarray, " n"]) -> _Problem:
        """Return the arguments of the filter: the first sample is in the first state."""
        sensors = shown.channels[:, 0].astype(np.int64)
        start = np.zeros(self.held.size)
        start[sensors] = shown.measured[0]
        friction = shown.force_squared / shown.duration + rate * shown.duration
        return (
            kalman.LinearModel(
                A=self.transition,
                B=self.held[:, None],
                Q=rate * self.walk,
                factors=freedom[:-1],
                sensors=sensors,
                R=shown.channels[:, 1].copy(),
            ),
            shown.force[:-1, None],
            shown.measured[1:],
            start,
            np.diag(np.append(shown.first, friction)),
        )


def walk_covariance(
    *,
    inertia: float,
    load_inertia: float | None = None,
    stiffness: float | None = None,
    sampling_time: float,
) -> Float[np.ndarray, "s s"]:
    """Return what a friction of unit white rate adds in a sample to the covariance of the states.

    The integral of exp(F s) b b' exp(F' s) over the sample by Gauss' rule: every term keeps the
    digits of its small entries.

    Parameters
    ----------
    inertia, load_inertia, stiffness, sampling_time
        As `FreeAxis.of` takes them.
    """
    s = 3 if load_inertia is None else 5
    F = np.zeros((s, s))
    F[0, 1], F[1, s - 1] = 1.0, -1.0 / inertia
    if load_inertia is not None and stiffness is not None:
        F[2, 3] = 1.0
        F[1, 0], F[1, 2] = -stiffness / inertia, stiffness / inertia
        F[3, 0], F[3, 2] = stiffness / load_inertia, -stiffness / load_inertia
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    total = np.zeros((s, s))
    for node, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
        column = np.asarray(expm(F * (0.5 * sampling_time * (1.0 + node))))[:, s - 1]
        total += 0.5 * sampling_time * weight * np.outer(column, column)
    return total


def likeliest_rate(typical: float, cost: Callable[[float], float]) -> float:
    """Return the rate at which a cost is least, some decades around a typical one.

    Parameters
    ----------
    typical
        Mean squared net force over the time [N^2/s or (N m)^2/s].
    cost
        Twice the negative log likelihood at a rate.
    """
    found = least_decades(
        lambda decades: cost(typical * 10.0**decades),
        _DECADES,
        grid=_GRID,
        tolerance=_DECADE_TOLERANCE,
    )
    return typical * 10.0**found


Measured = tuple[Float[np.ndarray, " _"], Float[np.ndarray, " _"] | None, Float[np.ndarray, " _"]]
"""Position, velocity if it is measured, and force."""


@dataclass(frozen=True, kw_only=True)
class FreeMotion:
    """What `free_motion` finds.

    Attributes
    ----------
    position, velocity
        Of the driven mass [m or rad, m/s or rad/s], shape (n,).
    friction
        Force that the motion leaves to friction [N or N m], shape (n,).
    velocity_spread
        Standard deviation of the velocity [m/s or rad/s], shape (n,).
    """

    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    friction: Float[np.ndarray, " n"]
    velocity_spread: Float[np.ndarray, " n"]


def roaming(
    stretches: Sequence[Measured], inertia: float, sampling_time: float, noise: tuple[float, float]
) -> float:
    """Return the intensity of the friction's rate of change that makes a log likeliest.

    Parameters
    ----------
    stretches
        Position, velocity and force of each stretch of the log, as `free_motion` takes them.
    inertia
        [kg or kg m^2].
    sampling_time
        [s].
    noise
        Standard deviations of position and velocity [m or rad, m/s or rad/s].

    Returns
    -------
    Spectral density of the rate [N^2/s or (N m)^2/s].
    """
    shown = [shown_by_mass(*stretch, inertia, sampling_time, noise) for stretch in stretches]
    axis = FreeAxis.of(inertia=inertia, sampling_time=sampling_time)
    typical = sum(one.force_squared for one in shown) / sum(one.duration for one in shown) ** 2
    return likeliest_rate(typical, lambda rate: sum(axis.cost(one, rate) for one in shown))


def free_motion(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"] | None,
    force: Float[np.ndarray, " n"],
    inertia: float,
    sampling_time: float,
    noise: tuple[float, float],
    rate: float,
) -> FreeMotion:
    """Return the motion with a friction that roams at a given rate.

    Parameters
    ----------
    x, v
        Measured position and velocity [m or rad, m/s or rad/s]; v may be None.
    force
        On the driven mass but for friction, held over each sample [N or N m].
    inertia, sampling_time, noise
        As `roaming` takes them.
    rate
        What `roaming` returns.
    """
    shown = shown_by_mass(x, v, force, inertia, sampling_time, noise)
    axis = FreeAxis.of(inertia=inertia, sampling_time=sampling_time)
    smooth = axis.smoothed(shown, rate, np.ones(x.size), (1,))
    return FreeMotion(
        position=smooth[:, 0],
        velocity=smooth[:, 1],
        friction=smooth[:, 2],
        velocity_spread=smooth[:, 3],
    )


def shown_by_mass(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"] | None,
    force: Float[np.ndarray, " n"],
    inertia: float,
    sampling_time: float,
    noise: tuple[float, float],
) -> Shown:
    """Return what the sensors of the driven mass show.

    Parameters
    ----------
    x, v, force, inertia, sampling_time, noise
        As `free_motion` takes them.
    """
    variances = noise[0] ** 2, noise[1] ** 2
    fastest = float(np.max(np.abs(np.diff(x)))) / sampling_time
    duration = x.size * sampling_time
    measured = (x,) if v is None else (x, v)
    return Shown(
        measured=np.column_stack(measured),
        channels=np.array([(float(k), variances[k]) for k in range(len(measured))]),
        first=np.array([variances[0], fastest**2 if v is None else variances[1]]),
        force=force,
        force_squared=sampling_time * float(np.sum(force**2)) + (inertia * fastest) ** 2 / duration,
        duration=duration,
    )
