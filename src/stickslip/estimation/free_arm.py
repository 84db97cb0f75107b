"""The motion of a flexible arm whose load's position is not measured, friction being a free force.

As in `stickslip.estimation.free_friction` the friction may go wherever it likes. The load has only
the spring to go by, so that where the driven mass went says how the load was pulled, and how the
driven mass was pulled says where the load is: the Kalman smoother of the known masses and spring
finds both, and where the load began.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from stickslip.compiled import compiled
from stickslip.estimation.free_friction import FreeMotion, likeliest_rate
from stickslip.estimation.innovations import HeldAxis
from stickslip.records import AxisLog

__all__ = ["ArmMotion", "ArmSensors", "arm_motions", "smoothed_arm", "walk_of"]

_STATES = 5  # position and velocity of the driven mass, of the load, and friction
_NODES = 6  # exact for polynomials of degree 11; the integrand is one of degree 4, nearly
_ANYTHING = 1e4  # times faster than elsewhere, where friction may be anything
_LARGER = 10.0
"""How many times what the log shows the load may be stretched, or as fast, when it begins."""


@dataclass(frozen=True, kw_only=True)
class ArmMotion(FreeMotion):
    """What `arm_motions` finds; `friction` is without the spring.

    Attributes
    ----------
    load_position, load_velocity
        Of the load [m or rad, m/s or rad/s], shape (n,).
    load_spread
        Standard deviation of the load's position [m or rad], shape (n,).
    """

    load_position: Float[np.ndarray, " n"]
    load_velocity: Float[np.ndarray, " n"]
    load_spread: Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class ArmSensors:
    """What the sensors of an arm show while nothing measures the load's position.

    Attributes
    ----------
    origin
        First measured position of the driven mass [m or rad].
    measured
        Positions less the origin, and velocities, shape (n, m).
    channels
        Number of the state that each measures (of position and velocity of the driven mass, then
        of the load), and the variance of its noise, shape (m, 2).
    first
        Variance of the first state, shape (4,): the load begins anywhere, as fast as it likes.
    effort
        Held over each sample [N or N m], shape (n,).
    force_squared
        Integral of the squared effort, above what it takes to reach or lose the largest speed.
    """

    origin: float
    measured: Float[np.ndarray, "n m"]
    channels: Float[np.ndarray, "m 2"]
    first: Float[np.ndarray, " 4"]
    effort: Float[np.ndarray, " n"]
    force_squared: float

    @classmethod
    def of(
        cls,
        part: AxisLog,
        *,
        inertia: float,
        load_inertia: float,
        stiffness: float,
        noise: tuple[float, float],
        load_velocity_noise: float,
    ) -> "ArmSensors":
        """Return what the sensors show in a stretch of a log.

        Parameters
        ----------
        part
            Without gaps.
        inertia, load_inertia, stiffness
            Of the arm [SI].
        noise
            Standard deviations of position and velocity of the driven mass.
        load_velocity_noise
            That of the velocity of the load, if it is measured.
        """
        T = part.sampling_time
        x, v, v2 = part.measured_position, part.measured_velocity, part.measured_load_velocity
        measured = [x - x[0]]
        channels = [(0.0, noise[0] ** 2)]
        if v is not None:
            measured.append(v)
            channels.append((1.0, noise[1] ** 2))
        if v2 is not None:
            measured.append(v2)
            channels.append((3.0, load_velocity_noise**2))
        fastest = float(np.max(np.abs(np.diff(x)))) / T
        stretched = float(np.ptp(x)) + float(np.max(np.abs(part.effort))) / stiffness
        stretched *= _LARGER
        swinging = np.sqrt(stiffness / load_inertia) * stretched + fastest
        duration = x.size * T
        return cls(
            origin=float(x[0]),
            measured=np.column_stack(measured),
            channels=np.array(channels),
            first=np.array(
                [
                    noise[0] ** 2,
                    fastest**2 if v is None else noise[1] ** 2,
                    stretched**2,
                    swinging**2 if v2 is None else load_velocity_noise**2,
                ]
            ),
            effort=part.effort,
            force_squared=T * float(np.sum(part.effort**2)) + (inertia * fastest) ** 2 / duration,
        )


@compiled()
def _forward(
    A: Float[np.ndarray, "5 5"],
    B: Float[np.ndarray, " 5"],
    Q: Float[np.ndarray, "5 5"],
    freedom: Float[np.ndarray, " n"],
    u: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    first: Float[np.ndarray, " 5"],
    states: Float[np.ndarray, "s 5"],
    spreads: Float[np.ndarray, "s 5 5"],
) -> float:
    """Run the Kalman filter; keep its predictions where there is room for them.

    ``Q`` times its freedom is what a sample adds to the covariance. Returns the cost, twice the
    negative log likelihood.
    """
    n, m = measured.shape
    kept = states.shape[0]
    z, w, K = np.zeros(_STATES), np.zeros(_STATES), np.zeros(_STATES)
    P, M = np.zeros((_STATES, _STATES)), np.zeros((_STATES, _STATES))
    for i in range(_STATES):
        P[i, i] = first[i]
    for c in range(m):
        z[int(channels[c, 0])] = measured[0, c]
    cost = 0.0
    for k in range(n):
        if k < kept:
            for i in range(_STATES):
                states[k, i] = z[i]
                for j in range(_STATES):
                    spreads[k, i, j] = P[i, j]
        if k > 0:
            for c in range(m):
                i = int(channels[c, 0])
                S = P[i, i] + channels[c, 1]
                e = measured[k, c] - z[i]
                cost += np.log(S) + e * e / S
                for j in range(_STATES):
                    K[j] = P[j, i] / S
                for j in range(_STATES):
                    z[j] += K[j] * e
                    for h in range(j, _STATES):
                        P[j, h] -= K[j] * K[h] * S
                        P[h, j] = P[j, h]
        for i in range(_STATES):
            total = B[i] * u[k]
            for h in range(_STATES):
                total += A[i, h] * z[h]
            w[i] = total
            for j in range(_STATES):
                total = 0.0
                for h in range(_STATES):
                    total += A[i, h] * P[h, j]
                M[i, j] = total
        for i in range(_STATES):
            z[i] = w[i]
            for j in range(i, _STATES):
                total = Q[i, j] * freedom[k]
                for h in range(_STATES):
                    total += M[i, h] * A[j, h]
                P[i, j] = total
                P[j, i] = total
    return cost


@compiled()
def _backward(
    A: Float[np.ndarray, "5 5"],
    measured: Float[np.ndarray, "n m"],
    channels: Float[np.ndarray, "m 2"],
    states: Float[np.ndarray, "n 5"],
    spreads: Float[np.ndarray, "n 5 5"],
) -> Float[np.ndarray, "n 7"]:
    """Return the smoothed states and the standard deviations of v_1 and x_2.

    The adjoint l and its covariance L run backward through the updates that the filter made, so
    that no covariance is inverted (modified Bryson-Frazier smoother, Bierman 1973).
    """
    n, m = measured.shape
    out = np.empty((n, _STATES + 2))
    lam, g, z = np.zeros(_STATES), np.zeros(_STATES), np.zeros(_STATES)
    L, P, M = (
        np.zeros((_STATES, _STATES)),
        np.zeros((_STATES, _STATES)),
        np.zeros((_STATES, _STATES)),
    )
    K, S, e = np.zeros((m, _STATES)), np.ones(m), np.zeros(m)
    for k in range(n - 1, -1, -1):
        if k > 0:
            for j in range(_STATES):
                z[j] = states[k, j]
                for h in range(_STATES):
                    P[j, h] = spreads[k, j, h]
            for c in range(m):  # the updates once more, forward
                i = int(channels[c, 0])
                S[c] = P[i, i] + channels[c, 1]
                e[c] = measured[k, c] - z[i]
                for j in range(_STATES):
                    K[c, j] = P[j, i] / S[c]
                for j in range(_STATES):
                    z[j] += K[c, j] * e[c]
                    for h in range(_STATES):
                        P[j, h] -= K[c, j] * K[c, h] * S[c]
            for back in range(m):
                c = m - 1 - back
                i = int(channels[c, 0])
                gain, total = 0.0, 0.0
                for j in range(_STATES):
                    gain += K[c, j] * lam[j]
                    g[j] = 0.0
                    for h in range(_STATES):
                        g[j] += L[j, h] * K[c, h]
                    total += K[c, j] * g[j]
                lam[i] -= gain + e[c] / S[c]
                # L <- (I - K H)' L (I - K H) + H' H / S
                for j in range(_STATES):
                    L[i, j] -= g[j]
                for j in range(_STATES):
                    L[j, i] -= g[j]
                L[i, i] += total + 1.0 / S[c]
        for j in range(_STATES):
            out[k, j] = states[k, j]
            for h in range(_STATES):
                out[k, j] -= spreads[k, j, h] * lam[h]
        for which in range(2):
            i = 1 + which
            drop = 0.0
            for j in range(_STATES):
                for h in range(_STATES):
                    drop += spreads[k, i, j] * L[j, h] * spreads[k, i, h]
            out[k, _STATES + which] = np.sqrt(max(spreads[k, i, i] - drop, 0.0))
        # Back over the sample: l <- A' l, L <- A' L A
        for i in range(_STATES):
            g[i] = 0.0
            for h in range(_STATES):
                g[i] += A[h, i] * lam[h]
        for i in range(_STATES):
            lam[i] = g[i]
            for j in range(_STATES):
                M[i, j] = 0.0
                for h in range(_STATES):
                    M[i, j] += L[i, h] * A[h, j]
        for i in range(_STATES):
            for j in range(_STATES):
                total = 0.0
                for h in range(_STATES):
                    total += A[h, i] * M[h, j]
                L[i, j] = total
    return out


def arm_motions(
    stretches: Sequence[ArmSensors],
    *,
    inertia: float,
    load_inertia: float,
    stiffness: float,
    sampling_time: float,
    direction: Callable[[ArmMotion], Float[np.ndarray, " n"]],
) -> list[ArmMotion]:
    """Return the motion of every stretch, with one rate at which friction roams for all.

    A mass that sticks is held by whatever force the spring has, which no walk is likely to follow:
    where the first look leaves the direction of friction uncertain, the second lets friction be
    anything, so that the load is found from the rest alone.

    Parameters
    ----------
    stretches
        What the sensors show.
    inertia, load_inertia, stiffness
        Of the arm [SI].
    sampling_time
        [s].
    direction
        Returns 1 where the direction of friction is uncertain and 0 elsewhere.
    """
    T = sampling_time
    axis = HeldAxis.of(
        inertia=inertia, load_inertia=load_inertia, stiffness=stiffness, sampling_time=T
    )
    A = np.eye(_STATES)
    A[:4, :4], A[:4, 4] = axis.transition, -axis.held
    B = np.append(axis.held, 0.0)
    walk = walk_of(inertia, load_inertia, stiffness, T)

    def first(s: ArmSensors, rate: float) -> Float[np.ndarray, " 5"]:
        duration = s.effort.size * T
        return np.append(s.first, s.force_squared / duration + rate * duration)

    def cost(rate: float) -> float:
        none = np.empty((0, _STATES)), np.empty((0, _STATES, _STATES))
        Q = rate * walk
        return sum(
            _forward(
                A,
                B,
                Q,
                np.ones(s.effort.size),
                s.effort,
                s.measured,
                s.channels,
                first(s, rate),
                *none,
            )
            for s in stretches
        )

    whole = sum(s.effort.size for s in stretches) * T
    rate = likeliest_rate(sum(s.force_squared for s in stretches) / whole**2, cost)
    motions: list[ArmMotion] = []
    for s in stretches:
        begin = first(s, rate)
        look = smoothed_arm(s, A, B, rate * walk, np.ones(s.effort.size), begin)
        freedom = 1.0 + _ANYTHING * direction(look)
        second = smoothed_arm(s, A, B, rate * walk, freedom, begin)
        motions.append(
            replace(
                look,
                load_position=second.load_position,
                load_velocity=second.load_velocity,
                load_spread=second.load_spread,
            )
        )
    return motions


def smoothed_arm(
    sensors: ArmSensors,
    A: Float[np.ndarray, "5 5"],
    B: Float[np.ndarray, " 5"],
    Q: Float[np.ndarray, "5 5"],
    freedom: Float[np.ndarray, " n"],
    first: Float[np.ndarray, " 5"],
) -> ArmMotion:
    """Return the motion of one stretch.

    Parameters
    ----------
    sensors
        What they show.
    A, B
        States, friction the last of them, and their response to the effort, over a sample.
    Q
        What the friction's walk adds to their covariance in a sample.
    freedom
        Factor of that in each sample.
    first
        Variance of the first state.
    """
    n = sensors.effort.size
    states, spreads = np.empty((n, _STATES)), np.empty((n, _STATES, _STATES))
    measured, channels = sensors.measured, sensors.channels
    _forward(A, B, Q, freedom, sensors.effort, measured, channels, first, states, spreads)
    x, v, x2, v2, f, v_spread, x2_spread = _backward(A, measured, channels, states, spreads).T
    return ArmMotion(
        position=sensors.origin + x,
        velocity=v,
        friction=f,
        velocity_spread=v_spread,
        load_position=sensors.origin + x2,
        load_velocity=v2,
        load_spread=x2_spread,
    )


def walk_of(
    inertia: float, load_inertia: float, stiffness: float, sampling_time: float
) -> Float[np.ndarray, "5 5"]:
    """Return what a friction of unit white rate adds in a sample to the covariance of the states.

    The integral of exp(F s) b b' exp(F' s) over the sample, b the rate of the friction, by Gauss'
    rule: every term keeps the digits of its small entries.

    Parameters
    ----------
    inertia, load_inertia, stiffness
        Of the arm [SI].
    sampling_time
        [s].
    """
    F = np.zeros((_STATES, _STATES))
    F[0, 1] = F[2, 3] = 1.0
    F[1, 0], F[1, 2] = -stiffness / inertia, stiffness / inertia
    F[3, 0], F[3, 2] = stiffness / load_inertia, -stiffness / load_inertia
    F[1, 4] = -1.0 / inertia
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    total = np.zeros((_STATES, _STATES))
    for node, weight in zip(nodes.tolist(), weights.tolist(), strict=True):
        column = np.asarray(expm(F * (0.5 * sampling_time * (1.0 + node))))[:, 4]
        total += 0.5 * sampling_time * weight * np.outer(column, column)
    return total
