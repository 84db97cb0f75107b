"""The motion of the driven mass with its friction as a free force: nothing is assumed of any law.

The known inertia ties position, velocity and force together; the friction may go wherever it likes
(a random walk). The Kalman smoother of that is the motion that the sensors show, with as little of
their noise as can be without knowing the friction.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from stickslip.compiled import compiled

__all__ = ["FreeMotion", "free_motion", "likeliest_rate", "roaming", "walk_covariance"]

_DECADES = (-7.0, 5.0)  # of the friction's rate of change, around that of the net force
_GRID = 9

Measured = tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"] | None, Float[np.ndarray, " n"]]
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


def walk_covariance(inertia: float, sampling_time: float) -> Float[np.ndarray, "3 3"]:
    """Return what a friction of unit white rate adds in a sample to the covariance of (x, v, f).

    The integral of exp(A s) b b' exp(A' s) over the sample, b the rate of f.

    Parameters
    ----------
    inertia
        [kg or kg m^2].
    sampling_time
        [s].
    """
    m, T = inertia, sampling_time
    xx, xv, xf = T**5 / (20 * m**2), T**4 / (8 * m**2), -(T**3) / (6 * m)
    vv, vf = T**3 / (3 * m**2), -(T**2) / (2 * m)
    return np.array([[xx, xv, xf], [xv, vv, vf], [xf, vf, T]])


@compiled()
def _forward(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"],
    force: Float[np.ndarray, " n"],
    m: float,
    T: float,
    noise: tuple[float, float],
    Q: Float[np.ndarray, "3 3"],
    first: tuple[float, float],
    states: Float[np.ndarray, "s 3"],
    spreads: Float[np.ndarray, "s 3 3"],
) -> float:
    """Run the Kalman filter of (x, v, f); keep its predictions where there is room for them.

    ``noise`` are the variances of position and velocity (negative: not measured), ``first`` those
    of the first velocity and friction. Returns the cost, twice the negative log likelihood.
    """
    n, kept = x.size, states.shape[0]
    P = np.zeros((3, 3))
    P[0, 0], P[1, 1], P[2, 2] = noise[0], first[0], first[1]
    z0, z1, z2 = x[0], v[0], 0.0
    a, b, c = 0.5 * T * T / m, T / m, T
    K = np.zeros(3)
    M = np.zeros((3, 3))
    cost = 0.0
    for k in range(n):
        if k < kept:
            states[k, 0], states[k, 1], states[k, 2] = z0, z1, z2
            for i in range(3):
                for j in range(3):
                    spreads[k, i, j] = P[i, j]
        if k > 0:
            for i in range(2):
                R = noise[i]
                if R < 0.0:
                    continue
                S = P[i, i] + R
                e = x[k] - z0 if i == 0 else v[k] - z1
                cost += np.log(S) + e * e / S
                for j in range(3):
                    K[j] = P[j, i] / S
                z0 += K[0] * e
                z1 += K[1] * e
                z2 += K[2] * e
                for j in range(3):
                    for h in range(j, 3):
                        P[j, h] -= K[j] * K[h] * S
                        P[h, j] = P[j, h]
        w = force[k] - z2
        z0 += c * z1 + a * w
        z1 += b * w
        for j in range(3):
            M[0, j] = P[0, j] + c * P[1, j] - a * P[2, j]
            M[1, j] = P[1, j] - b * P[2, j]
            M[2, j] = P[2, j]
        for i in range(3):
            P[i, 0] = M[i, 0] + c * M[i, 1] - a * M[i, 2] + Q[i, 0]
            P[i, 1] = M[i, 1] - b * M[i, 2] + Q[i, 1]
            P[i, 2] = M[i, 2] + Q[i, 2]
        for i in range(3):
            for j in range(i):
                P[i, j] = 0.5 * (P[i, j] + P[j, i])
                P[j, i] = P[i, j]
    return cost


@compiled()
def _backward(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"],
    m: float,
    T: float,
    noise: tuple[float, float],
    states: Float[np.ndarray, "n 3"],
    spreads: Float[np.ndarray, "n 3 3"],
) -> Float[np.ndarray, "n 4"]:
    """Return smoothed x, v, f and the standard deviation of v (modified Bryson-Frazier smoother).

    The adjoint l and its covariance L run backward through the updates that the filter made, so
    that no covariance is inverted (Bierman 1973).
    """
    n = x.size
    out = np.empty((n, 4))
    lam = np.zeros(3)
    L = np.zeros((3, 3))
    a, b, c = 0.5 * T * T / m, T / m, T
    z = np.empty(3)
    K = np.empty((2, 3))
    S, e = np.empty(2), np.empty(2)
    M, P = np.empty((3, 3)), np.empty((3, 3))
    g = np.empty(3)
    for k in range(n - 1, -1, -1):
        for j in range(3):
            z[j] = states[k, j]
            for h in range(3):
                P[j, h] = spreads[k, j, h]
        if k > 0:
            for i in range(2):  # the updates once more, forward
                if noise[i] < 0.0:
                    continue
                S[i] = P[i, i] + noise[i]
                e[i] = (x[k] if i == 0 else v[k]) - z[i]
                for j in range(3):
                    K[i, j] = P[j, i] / S[i]
                for j in range(3):
                    z[j] += K[i, j] * e[i]
                    for h in range(3):
                        P[j, h] -= K[i, j] * K[i, h] * S[i]
            for back in range(2):
                i = 1 - back
                if noise[i] < 0.0:
                    continue
                gain = 0.0
                for j in range(3):
                    gain += K[i, j] * lam[j]
                lam[i] -= gain + e[i] / S[i]
                # L <- (I - K H)' L (I - K H) + H' H / S
                total = 0.0
                for j in range(3):
                    g[j] = 0.0
                    for h in range(3):
                        g[j] += L[j, h] * K[i, h]
                    total += K[i, j] * g[j]
                for j in range(3):
                    L[i, j] -= g[j]
                for j in range(3):
                    L[j, i] -= g[j]
                L[i, i] += total + 1.0 / S[i]
        for j in range(3):
            out[k, j] = states[k, j]
            for h in range(3):
                out[k, j] -= spreads[k, j, h] * lam[h]
        drop = 0.0
        for j in range(3):
            for h in range(3):
                drop += spreads[k, 1, j] * L[j, h] * spreads[k, 1, h]
        out[k, 3] = np.sqrt(max(spreads[k, 1, 1] - drop, 0.0))
        # Back over the sample: l <- A' l, L <- A' L A
        l0, l1, l2 = lam[0], lam[1], lam[2]
        lam[1] = l1 + c * l0
        lam[2] = l2 - a * l0 - b * l1
        for j in range(3):
            M[0, j] = L[0, j]
            M[1, j] = L[1, j] + c * L[0, j]
            M[2, j] = L[2, j] - a * L[0, j] - b * L[1, j]
        for i in range(3):
            L[i, 0] = M[i, 0]
            L[i, 1] = M[i, 1] + c * M[i, 0]
            L[i, 2] = M[i, 2] - a * M[i, 0] - b * M[i, 1]
    return out


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
    runs = [_Run.of(*stretch, inertia, sampling_time, noise) for stretch in stretches]
    typical = sum(run.force_squared for run in runs) / sum(run.duration for run in runs) ** 2

    return likeliest_rate(typical, lambda rate: sum(run.cost(rate) for run in runs))


def likeliest_rate(typical: float, cost: Callable[[float], float]) -> float:
    """Return the rate at which a cost is least, some decades around a typical one.

    Parameters
    ----------
    typical
        Mean squared net force over the time [N^2/s or (N m)^2/s].
    cost
        Twice the negative log likelihood at a rate.
    """

    def at(decades: float) -> float:
        return cost(typical * 10.0**decades)

    low, high = _DECADES
    grid = np.linspace(low, high, _GRID)
    best = float(grid[int(np.argmin([at(float(decades)) for decades in grid]))])
    step = float(grid[1] - grid[0])
    found = minimize_scalar(
        at,
        bounds=(max(best - step, low), min(best + step, high)),
        method="bounded",
        options={"xatol": 0.1},
    )
    return typical * float(10.0**found.x)


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
    run = _Run.of(x, v, force, inertia, sampling_time, noise)
    smooth = run.smoothed(rate)
    return FreeMotion(
        position=smooth[:, 0],
        velocity=smooth[:, 1],
        friction=smooth[:, 2],
        velocity_spread=smooth[:, 3],
    )


@dataclass(frozen=True, kw_only=True)
class _Run:
    """One stretch of a log, ready for the kernels."""

    x: Float[np.ndarray, " n"]
    v: Float[np.ndarray, " n"]
    force: Float[np.ndarray, " n"]
    inertia: float
    sampling_time: float
    noise: tuple[float, float]
    first_velocity: float
    """Variance of the first velocity."""
    force_squared: float
    """Integral of the squared force, above what it takes to reach or lose the largest speed."""

    @classmethod
    def of(
        cls,
        x: Float[np.ndarray, " n"],
        v: Float[np.ndarray, " n"] | None,
        force: Float[np.ndarray, " n"],
        inertia: float,
        sampling_time: float,
        noise: tuple[float, float],
    ) -> "_Run":
        fastest = float(np.max(np.abs(np.diff(x)))) / sampling_time
        duration = x.size * sampling_time
        return cls(
            x=x,
            v=np.zeros_like(x) if v is None else v,
            force=force,
            inertia=inertia,
            sampling_time=sampling_time,
            noise=(noise[0] ** 2, -1.0 if v is None else noise[1] ** 2),
            first_velocity=fastest**2 if v is None else noise[1] ** 2,
            force_squared=sampling_time * float(np.sum(force**2))
            + (inertia * fastest) ** 2 / duration,
        )

    @property
    def duration(self) -> float:
        """How long the stretch is [s]."""
        return self.x.size * self.sampling_time

    def cost(self, rate: float) -> float:
        """Return twice the negative log likelihood."""
        none = np.empty((0, 3)), np.empty((0, 3, 3))
        return self._filtered(rate, *none)

    def smoothed(self, rate: float) -> Float[np.ndarray, "n 4"]:
        """Return position, velocity, friction and the velocity's standard deviation."""
        n = self.x.size
        states, spreads = np.empty((n, 3)), np.empty((n, 3, 3))
        self._filtered(rate, states, spreads)
        return _backward(
            self.x, self.v, self.inertia, self.sampling_time, self.noise, states, spreads
        )

    def _filtered(
        self,
        rate: float,
        states: Float[np.ndarray, "s 3"],
        spreads: Float[np.ndarray, "s 3 3"],
    ) -> float:
        return _forward(
            self.x,
            self.v,
            self.force,
            self.inertia,
            self.sampling_time,
            self.noise,
            rate * walk_covariance(self.inertia, self.sampling_time),
            (self.first_velocity, self.force_squared / self.duration + rate * self.duration),
            states,
            spreads,
        )
