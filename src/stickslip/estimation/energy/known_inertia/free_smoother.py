"""Kalman filter and smoother of a motion whose friction is a free force.

The states are position and velocity of the driven mass, then those of the load, if there is one,
and last the friction f, which may go wherever it likes: f' is white. With the effort u held over a
sample, the known masses and the spring give

    z(k+1) = A z(k) + B u(k) + w(k),    cov w = rate * integral of exp(F s) b b' exp(F' s) ds,

F being the rates of the states and b the direction of f. Nothing else is assumed of friction.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from stickslip.estimation.energy.known_inertia.free_kernels import filtered, smoothed
from stickslip.estimation.energy.known_inertia.innovations import HeldAxis
from stickslip.estimation.fit.least_cost import least_decades

__all__ = ["FreeAxis", "Shown", "likeliest_rate", "walk_covariance"]

_NODES = 6  # exact for polynomials of degree 11; the integrand is one of degree 4, nearly
_DECADES = (-7.0, 5.0)  # of the friction's rate of change, around that of the net force
_GRID = 9
_DECADE_TOLERANCE = 0.1


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
        s = self.held.size
        freedom = np.ones(shown.force.size)
        return self._filtered(shown, rate, freedom, np.empty((0, s)), np.empty((0, s, s)))

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
        n, s = shown.force.size, self.held.size
        states, spreads = np.empty((n, s)), np.empty((n, s, s))
        self._filtered(shown, rate, freedom, states, spreads)
        return smoothed(
            self.transition, shown.measured, shown.channels, states, spreads, np.array(spreads_of)
        )

    def _filtered(
        self,
        shown: Shown,
        rate: float,
        freedom: Float[np.ndarray, " n"],
        states: Float[np.ndarray, "k s"],
        spreads: Float[np.ndarray, "k s s"],
    ) -> float:
        friction = shown.force_squared / shown.duration + rate * shown.duration
        return filtered(
            self.transition,
            self.held,
            rate * self.walk,
            freedom,
            shown.force,
            shown.measured,
            shown.channels,
            np.append(shown.first, friction),
            states,
            spreads,
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
