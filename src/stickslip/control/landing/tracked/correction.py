"""Correction of a series on its way, so that both masses end on its target all the same.

The planned motion of mass 1 is changed a little, by an acceleration a, where mass 2 is not where
it was planned to be. With the deviation r = (x1, v1, x2, v2) from the plan,

    x1'' = a,  m2 x2'' = ks (x1 - x2) + d (v1 - v2) - c2 v2 + g(t),

where g is the Coulomb friction of mass 2 where the planned motion has another: while mass 2 rests
or moves back. Of all accelerations that end with r = 0 it is the one of least sum a^2/w, with
weights w that leave slow motion alone, so that mass 1 does not turn back. It is computed anew in
every sample, from the deviation seen then: a state feedback whose gains vary along the series.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import cos, exp, pi, sin, sqrt

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

from stickslip.compiled import compiled
from stickslip.control.landing.tracked.drive_fit import DriveFit
from stickslip.control.landing.tuning import TRACKING
from stickslip.numerics.held_step import held_step
from stickslip.planning import LoadLosses, PulseSeries
from stickslip.plants import FlexibleArm

_REGULAR = 1e-10  # of the largest covariance of the reachable states
_TURNS = 1e-3  # of the planned speed
_HALVINGS = 6  # of the share that is feasible: to 1/64

Deviation = tuple[float, float, float, float]
Gain = Float[np.ndarray, "2 2"]
Values = NDArray[np.float64]
Goal = tuple[float, float, float, float]  # positions, and velocities over the frequency
NONE: Deviation = (0.0, 0.0, 0.0, 0.0)


@lru_cache(maxsize=64)
def _matrices(
    w: float, d: float, c: float, T: float
) -> tuple[Float[np.ndarray, "4 6"], Float[np.ndarray, "4 6"]]:
    """Return [A B_a B_g] over a sample while mass 1 slips, and while it rests.

    Of the state (x1, v1/w, x2, v2/w), with d and c over m2.
    """
    rests = np.zeros((4, 6))
    rests[2, 3] = w
    rests[3] = w, d, -w, -d - c, 0.0, 1.0 / w
    slips = rests.copy()
    slips[0, 1], slips[1, 4] = w, 1.0 / w
    resting = held_step(rests, T).copy()
    resting[1] = 0.0
    resting.flags.writeable = False
    return held_step(slips, T), resting


@compiled()
def _gains(
    slip: Values, rest: Values, rests: NDArray[np.bool_], weight: Values, g: Values, unsure: float
) -> tuple[Values, Values, Values, Values]:
    """Return the map to the final state, that without a deviation, and gains of the final state.

    The last one is what bringing mass 1 back to its plan does to the final state of mass 2.

    With the final state z = P_i r_i + D_i if nothing is corrected, a_i = -G_i (z - goal). Of a
    state of mass 2 that is ``unsure`` (its variance over that of accelerations) less is corrected,
    the less there is left to correct it with.
    """
    n = weight.shape[0]
    P, D, G = np.zeros((n + 1, 4, 4)), np.zeros((n + 1, 4)), np.zeros((n, 4))
    H = np.zeros((n, 2, 2))
    W = np.zeros((4, 4))
    for j in range(4):
        P[n, j, j] = 1.0
    for i in range(n - 1, -1, -1):
        M = rest if rests[i] else slip
        b = np.zeros(4)
        for j in range(4):
            D[i, j] = D[i + 1, j]
            for m in range(4):
                b[j] += P[i + 1, j, m] * M[m, 4]
                D[i, j] += P[i + 1, j, m] * M[m, 5] * g[i]
                for q in range(4):
                    P[i, j, m] += P[i + 1, j, q] * M[q, m]
        if weight[i] <= 0.0:
            continue
        for j in range(4):
            for m in range(4):
                W[j, m] += weight[i] * b[j] * b[m]
        R = W.copy()
        size = max(W[0, 0], W[1, 1], W[2, 2], W[3, 3])
        for j in range(4):
            R[j, j] += _REGULAR * size
        H[i] = np.linalg.solve(R[:2, :2], R[:2, 2:]).T
        R[2, 2] += unsure
        R[3, 3] += unsure
        G[i] = weight[i] * np.linalg.solve(R, b)
    return P, D, G, H


Motion = tuple[
    tuple[Values, Values, Values, Values], tuple[Values, Values], NDArray[np.bool_], Values
]  # maps to the final state, steps, rests, what is forced
Bounds = tuple[Values, Values, Values]  # planned speed, bounds of the acceleration


@compiled()
def _feasible(k: int, start: Values, goal: Values, motion: Motion, bounds: Bounds) -> bool:
    """Return whether the corrections to a goal keep to their bounds, and mass 1 to its way."""
    maps, steps, rests, forced = motion
    speed, low, high = bounds
    P, D, G, _ = maps
    slip, rest = steps
    r, after = start.copy(), np.empty(4)
    for i in range(k, rests.shape[0]):
        a = 0.0
        for j in range(4):
            z = D[i, j] - goal[j]
            for m in range(4):
                z += P[i, j, m] * r[m]
            a -= G[i, j] * z
        if a < low[i] or a > high[i]:
            return False
        M = rest if rests[i] else slip
        for j in range(4):
            after[j] = M[j, 4] * a + M[j, 5] * forced[i]
            for m in range(4):
                after[j] += M[j, m] * r[m]
        r, after = after, r
        if speed[i + 1] + r[1] < -_TURNS * speed[i + 1] and i + 1 < rests.shape[0]:
            return False
    return True


@compiled()
def _nearest(k: int, r: Values, aim: Values, motion: Motion, bounds: Bounds) -> Values:
    """Return the final state nearest to an aim that corrections within their bounds lead to.

    It is on the way from that where mass 1 alone goes where the aim has it.
    """
    maps = motion[0]
    P, D, _, H = maps
    z = D[k] + P[k] @ r - aim
    z[2:] -= H[k] @ z[:2]
    z[0], z[1] = 0.0, 0.0
    if _feasible(k, r, aim, motion, bounds):
        return aim.copy()
    none, all_of_it = 0.0, 1.0
    for _ in range(_HALVINGS):
        share = 0.5 * (none + all_of_it)
        if _feasible(k, r, aim + share * z, motion, bounds):
            all_of_it = share
        else:
            none = share
    return aim + all_of_it * z


def _taken(
    w: float, T: float, pole: float, strays: float, noise: tuple[float, float]
) -> tuple[Gain, float]:
    """Return the gain of the measured deviation of mass 2 (position, velocity/w) on that known.

    It is that of a Kalman filter for a free swing that strays from its plan (random walk, standard
    deviation ``strays`` in half a swing). Without noise a deviation is taken over in two time
    constants of feedback. The second value is the standard deviation of the amplitude by noise.
    """
    share = 1.0 - exp(-pole * T / TRACKING.taken_over)
    walk = strays**2 * w * T / pi
    least = (1.0 - share) / share**2
    N = np.diag([noise[0] ** 2, (noise[1] / w) ** 2])
    # Over the walk, as the solution of equations of 1e-12 m^2 fails
    R = N / walk + least * np.eye(2)
    c, s = cos(w * T), sin(w * T)
    A = np.array([[c, s], [-s, c]])
    P = solve_discrete_are(A.T, np.eye(2), np.eye(2), R)
    K = P @ np.linalg.inv(P + R)
    by_noise = solve_discrete_lyapunov((np.eye(2) - K) @ A, K @ N @ K.T)
    return K, sqrt(float(np.trace(by_noise)))


@dataclass(frozen=True, kw_only=True)
class Tracking:
    """How a series is tracked."""

    pole: float  #: Double pole of the feedback [rad/s].
    settling: int  #: Samples on the target after the series.
    limit: float  #: Effort that no correction leads beyond [N or N m].
    #: Share of a deviation of the velocity that its filter takes over in a sample [-].
    filtered: float = 1.0
    #: Standard deviation of a position and of a velocity [m or rad, m/s or rad/s].
    noise: tuple[float, float] = (0.0, 0.0)
    learned: bool = False  #: Whether the load has been learned from a series.
    aim: Goal = NONE  #: Final deviation to aim at.


@dataclass(frozen=True, kw_only=True)
class CorrectedSeries(PulseSeries):
    """A series with what corrects it on its way, and a time on its target."""

    losses: LoadLosses  #: Of the load.
    drive: DriveFit  #: What was known of it.
    pole: float  #: Of the feedback (`Tracking`).
    filtered: float  #: Of the feedback (`Tracking`).
    moving: int  #: Samples before the time on the target.
    frequency: float  #: Of mass 2 while mass 1 rests [rad/s].
    #: Maps to the final state, of a state and of none, the gains of the final state, and from mass
    #: 1 to mass 2.
    maps: tuple[
        Float[np.ndarray, "n 4 4"],
        Float[np.ndarray, "n 4"],
        Float[np.ndarray, "m 4"],
        Float[np.ndarray, "m 2 2"],
    ]
    forced: Float[np.ndarray, " m"]  #: Coulomb friction that the plan has not, over mass 2.
    rests: Bool[np.ndarray, " m"]  #: Whether mass 1 is planned to rest in a sample.
    #: State after a sample, of that before, the acceleration and the losses; while mass 1 slips and
    #: while it rests.
    steps: tuple[Float[np.ndarray, "4 6"], Float[np.ndarray, "4 6"]]
    low: Float[np.ndarray, " m"]  #: Lower bounds of the acceleration that corrects.
    high: Float[np.ndarray, " m"]  #: Upper bounds of the acceleration that corrects.
    ahead: tuple[Motion, Bounds]  #: Motion and bounds in the direction of the series, for `goal`.
    taken: Gain  #: Gain of what is seen of mass 2 (`seen`).
    aim: Goal  #: Final deviation to aim at: a miss that is known, reversed.

    @classmethod
    def of(
        cls,
        series: PulseSeries,
        arm: FlexibleArm,
        losses: LoadLosses,
        drive: DriveFit,
        tracking: Tracking,
    ) -> "CorrectedSeries":
        """Return a series followed by some samples on its target, planned with the losses."""
        pole, limit, settling = tracking.pole, tracking.limit, tracking.settling
        n, T, m2 = series.effort.size, series.sampling_time, arm.mass_2
        w = sqrt(arm.stiffness / m2)
        d, dry, viscous = losses
        steps = _matrices(w, d / m2, viscous / m2, T)
        speed = 0.5 * np.abs(series.velocity[1:] + series.velocity[:-1])
        weight = np.minimum(1.0, speed / (TRACKING.slow_speed * float(speed.max()))) ** 2
        rests = np.zeros(n, dtype=np.bool_)
        if series.rest_samples is not None:
            rests[slice(*series.rest_samples)] = True
        weight[rests] = 0.0
        weight *= np.minimum(1.0, w * T * np.arange(n, 0, -1) / TRACKING.early_angle) ** 2
        v2 = 0.5 * (series.load_velocity[1:] + series.load_velocity[:-1])
        spring = arm.stiffness * (series.position - series.load_position)[1:]
        held = np.abs(series.load_velocity[0]) * m2 * w <= dry
        stuck = np.logical_and.accumulate(np.abs(spring) <= dry) & held
        friction = np.where(stuck, spring, dry * np.sign(v2))
        forced = (dry * series.direction - friction) / m2
        rest, place = np.zeros(settling), np.full(settling, series.target)
        values = {name: getattr(series, name) for name in PulseSeries.__dataclass_fields__}
        values |= {
            "effort": np.append(series.effort, rest),
            "position": np.append(series.position, place),
            "velocity": np.append(series.velocity, rest),
            "load_position": np.append(series.load_position, place),
            "load_velocity": np.append(series.load_velocity, rest),
        }
        share = TRACKING.learned_deviation if tracking.learned else TRACKING.first_deviation
        strays = share * float(np.ptp(series.position))
        taken, spread = _taken(w, T, pole, strays, tracking.noise)
        unsure = (spread * arm.mass_1 / (TRACKING.noise_correction * limit)) ** 2
        maps = _gains(*steps, rests, weight, forced, unsure)
        low = np.minimum(0.0, -limit - series.effort) / arm.mass_1
        high = np.maximum(0.0, limit - series.effort) / arm.mass_1
        way, (P, D, G, H) = series.direction, maps
        motion = ((P, way * D, G, H), steps, rests, way * forced)
        bounds = (low, high) if way > 0 else (-high, -low)
        return cls(
            **values,
            losses=losses,
            drive=drive,
            pole=pole,
            filtered=tracking.filtered,
            moving=n,
            frequency=w,
            maps=maps,
            forced=forced,
            rests=rests,
            steps=steps,
            low=low,
            high=high,
            ahead=(motion, (way * series.velocity / w, *bounds)),
            taken=taken,
            aim=tracking.aim,
        )

    def seen(self, k: int, r: Deviation, by: tuple[float, float]) -> Deviation:
        """Return a deviation after mass 2 was seen off that by a position and a velocity."""
        if not self.corrects(k):
            return r
        w = self.frequency
        x2, v2 = (self.taken @ (by[0], by[1] / w)).tolist()
        return r[0], r[1], r[2] + x2, r[3] + w * v2

    def corrects(self, k: int) -> bool:
        """Return whether what is seen in sample k still counts."""
        return k < self.moving - TRACKING.last_angle / (self.frequency * self.sampling_time)

    def at(self, k: float) -> Deviation:
        """Return the planned state, also between samples."""
        k = min(max(k, 0.0), float(self.effort.size))
        i = min(int(k), self.effort.size - 1)
        return _between(self._planned(i), self._planned(i + 1), k - i, self.sampling_time)

    def _planned(self, i: int) -> Deviation:
        x, v, x2, v2 = self.states[i].tolist()
        return x, v, x2, v2

    def _scaled(self, r: Deviation) -> Float[np.ndarray, " 4"]:
        return np.array([r[0], r[1] / self.frequency, r[2], r[3] / self.frequency])

    def goal(self, k: int, r: Deviation, last: Goal) -> Goal:
        """Return the final deviation to aim at in sample k: the aim, or the nearest within reach.

        It is looked for now and then; in between it is the ``last`` one.
        """
        if k >= self.moving or k % max(1, self.moving // TRACKING.goal_updates) != 0:
            return last
        way = self.direction
        aim = way * np.array(self.aim)
        x, v, x2, v2 = _nearest(k, way * self._scaled(r), aim, *self.ahead).tolist()
        return way * x, way * v, way * x2, way * v2

    def acceleration(self, k: int, r: Deviation, goal: Goal) -> float:
        """Return the acceleration of mass 1 in sample k beside that of the plan."""
        if k >= self.moving:
            return 0.0
        P, D, G, _ = self.maps
        a = -float(G[k] @ (P[k] @ self._scaled(r) + D[k] - goal))
        return min(max(a, float(self.low[k])), float(self.high[k]))

    def after(self, k: int, r: Deviation, a: float) -> Deviation:
        """Return the deviation of the changed plan one sample later."""
        if k + 1 >= self.moving:
            return self.aim[0], 0.0, self.aim[0], 0.0
        w, M = self.frequency, self.steps[int(self.rests[k])]
        state = np.append(self._scaled(r), (a, self.forced[k]))
        x, v, x2, v2 = (M @ state).tolist()
        ahead = self.direction * (float(self.velocity[k + 1]) + w * v)
        # Mass 1 does not turn back
        v = -float(self.velocity[k + 1]) / w if ahead < 0.0 else v
        return x, w * v, x2, w * v2


def before(deviations: tuple[Deviation, ...], delay: float, T: float) -> Deviation:
    """Return the deviation some samples of length T before the last one.

    Positions bend as the velocities say. They do not say how far they go: what is seen of mass 2
    moves it too (`CorrectedSeries.seen`).
    """
    i = min(int(delay), len(deviations) - 2)
    earlier, later, s = deviations[-2 - i], deviations[-1 - i], 1.0 + i - delay
    values: list[float] = []
    for j in (0, 2):
        faster = later[j + 1] - earlier[j + 1]
        bend = 0.5 * s * (1.0 - s) * T * faster
        values.append(earlier[j] + s * (later[j] - earlier[j]) - bend)
        values.append(earlier[j + 1] + s * faster)
    return values[0], values[1], values[2], values[3]


def _between(earlier: Deviation, later: Deviation, s: float, T: float) -> Deviation:
    """Return the state at a share s of a sample of length T, by the cubic through both states."""
    swells, ahead, back = s * s * (3.0 - 2.0 * s), s * (1.0 - s) ** 2 * T, s * s * (1.0 - s) * T
    rises = 6.0 * s * (1.0 - s) / T
    leaves, arrives = (1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)
    values: list[float] = []
    for j in (0, 2):
        way, v, w = later[j] - earlier[j], earlier[j + 1], later[j + 1]
        values.append(earlier[j] + swells * way + ahead * v - back * w)
        values.append(rises * way + leaves * v + arrives * w)
    return values[0], values[1], values[2], values[3]
