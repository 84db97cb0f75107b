"""An independent reference: plain least squares of the effort on the motion.

NumPy and SciPy only; nothing here is shared with the estimators that it judges. Positions and
efforts are interpolated to a uniform grid in each stretch without gaps, low-passed by a zero-phase
Butterworth filter of order 4, and differentiated by central differences. Rows at low speed are left
out. The effort is advanced by the delay that minimizes the residual, a fraction of a sample
included.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from jaxtyping import Bool, Float
from scipy import optimize, signal

PLAIN_TERMS = ("inertia", "viscous_friction", "coulomb_friction", "offset")
"""The terms that every reference fit has."""

FEWEST_ROWS = 40
"""Moving rows that a fit needs at least, ten for each plain term [-]."""

_ORDER = 4  # of the low-pass, in one pass
_GAP = 3.5  # step of time over the median one [-], beyond which it is a gap
_GAP_PERIODS = 0.25  # the same in periods of the cutoff [-]; the longer of both counts
_EDGE_PERIODS = 1.5  # of the cutoff at the ends of a stretch, where the low-pass extrapolates [-]
_ROWS_PER_PERIOD = 4.0  # rows in a period of the cutoff [-]
_DELAY_REACH = 0.025  # largest delay in the search, of either sign [s]
_DELAY_STEP = 0.0025  # step of its grid [s]
_DELAY_TOLERANCE = 1e-5  # of its refinement [s]
_DELAY_GAIN = 0.01  # least decrease of the residual by a delay [-]
_STRIBECK_SPEEDS = 12  # Stribeck velocities that are tried [-]
_NO_SHAPES: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class MotionRows:
    """Filtered motion and effort on the rows that a fit uses."""

    #: Shape (n,) [SI].
    time: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    #: Low-passed effort, advanced by ``delay``, shape (n,) [unit of the log].
    effort: Float[np.ndarray, " n"]
    moving: Bool[np.ndarray, " n"]  #: Rows whose speed exceeds the limit, shape (n,).
    delay: float  #: Delay of the logged effort with respect to the motion [s].

    def part(self, rows: Bool[np.ndarray, " n"]) -> "MotionRows":
        """Return the selected rows only."""
        names = ("time", "position", "velocity", "acceleration", "effort", "moving")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


@dataclass(frozen=True, kw_only=True)
class _Stretch:
    """A stretch without gaps on its uniform grid; ``rows`` are those that a fit uses."""

    time: Float[np.ndarray, " m"]
    position: Float[np.ndarray, " m"]
    velocity: Float[np.ndarray, " m"]
    acceleration: Float[np.ndarray, " m"]
    effort: Float[np.ndarray, " m"]
    rows: slice


@dataclass(frozen=True, kw_only=True)
class FilteredLog:
    """A log, low-passed once; rows with any delay of the effort are read from it."""

    #: The log as recorded, shape (n,) [SI].
    time: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    cutoff: float  #: Cutoff of the low-pass [Hz].
    slow: float  #: Speed up to which rows do not count as moving [m/s or rad/s].

    @cached_property
    def _stretches(self) -> tuple[_Stretch, ...]:
        steps = np.diff(self.time)
        longest = max(_GAP * float(np.median(steps)), _GAP_PERIODS / self.cutoff)
        bounds = [0, *(int(k) + 1 for k in np.flatnonzero(steps > longest)), self.time.size]
        made = (self._stretch(a, b) for a, b in pairwise(bounds))
        return tuple(stretch for stretch in made if stretch is not None)

    def _stretch(self, start: int, stop: int) -> _Stretch | None:
        time = self.time[start:stop]
        if time.size < 2:
            return None
        period = (time[-1] - time[0]) / (time.size - 1)
        edge = int(np.ceil(_EDGE_PERIODS / (self.cutoff * period)))
        if time.size < 2 * edge + 4:
            return None
        grid = time[0] + period * np.arange(time.size)
        q = np.interp(grid, time, self.position[start:stop])
        u = np.interp(grid, time, self.effort[start:stop])
        relative = 2.0 * self.cutoff * period
        if relative < 1.0:
            sections = signal.butter(_ORDER, relative, output="sos")
            pad = min(3 * edge, time.size - 1)
            q, u = (signal.sosfiltfilt(sections, x, padlen=pad) for x in (q, u))
        v = np.gradient(q, period)
        every = max(1, int(1.0 / (_ROWS_PER_PERIOD * self.cutoff * period)))
        return _Stretch(
            time=grid,
            position=q,
            velocity=v,
            acceleration=np.gradient(v, period),
            effort=u,
            rows=slice(edge, time.size - edge, every),
        )

    def rows(self, delay: float = 0.0) -> MotionRows:
        """Return about four rows for each period of the cutoff frequency, of all stretches.

        ``delay`` is that of the logged effort with respect to the motion [s].
        """
        efforts = [np.interp((s.time + delay)[s.rows], s.time, s.effort) for s in self._stretches]
        velocity = self._joined("velocity")
        return MotionRows(
            time=self._joined("time"),
            position=self._joined("position"),
            velocity=velocity,
            acceleration=self._joined("acceleration"),
            effort=np.concatenate([np.empty(0), *efforts]),
            moving=np.abs(velocity) > self.slow,
            delay=delay,
        )

    def _joined(self, name: str) -> Float[np.ndarray, " n"]:
        parts = [getattr(stretch, name)[stretch.rows] for stretch in self._stretches]
        return np.concatenate([np.empty(0), *parts])


@dataclass(frozen=True, kw_only=True)
class ReferenceFit:
    """A least-squares fit of the effort."""

    terms: tuple[str, ...]  #: Names of the terms, see `TERMS`.
    values: Mapping[str, float]  #: Coefficient of each [unit of the effort over that of the term].
    #: Velocity of the ``stribeck`` term [m/s or rad/s] and period of the ``ripple`` [m or rad],
    #: where the law has them.
    shapes: Mapping[str, float]
    delay: float  #: Delay of the logged effort with respect to the motion [s].
    #: Norm of the residual over norm of the effort, on the moving rows [-].
    relative_residual: float

    def predict(self, rows: MotionRows) -> Float[np.ndarray, " n"]:
        """Return the effort of the fitted law on these rows."""
        return columns(rows, self.terms, self.shapes) @ np.array([*self.values.values()])


TERMS: Mapping[str, Callable[[MotionRows, Mapping[str, float]], Float[np.ndarray, " n"]]] = (
    MappingProxyType(
        {
            "inertia": lambda rows, _: rows.acceleration,
            "viscous_friction": lambda rows, _: rows.velocity,
            "coulomb_friction": lambda rows, _: np.sign(rows.velocity),
            "offset": lambda rows, _: np.ones_like(rows.velocity),
            "gravity_sine": lambda rows, _: np.sin(rows.position),
            "gravity_cosine": lambda rows, _: np.cos(rows.position),
            "spring": lambda rows, _: rows.position,
            "viscous_asymmetry": lambda rows, _: np.abs(rows.velocity),
            "quadratic": lambda rows, _: rows.velocity * np.abs(rows.velocity),
            "two_thirds": lambda rows, _: np.sign(rows.velocity) * np.abs(rows.velocity) ** (2 / 3),
            "stribeck": lambda rows, shapes: (
                np.sign(rows.velocity) * np.exp(-((rows.velocity / shapes["stribeck"]) ** 2))
            ),
            "drift_offset": lambda rows, _: rows.time,
            "drift_coulomb": lambda rows, _: rows.time * np.sign(rows.velocity),
            "drift_viscous": lambda rows, _: rows.time * rows.velocity,
            "coulomb_over_position": lambda rows, _: rows.position * np.sign(rows.velocity),
            "ripple_sine": lambda rows, shapes: np.sin(
                2 * np.pi * rows.position / shapes["ripple"]
            ),
            "ripple_cosine": lambda rows, shapes: np.cos(
                2 * np.pi * rows.position / shapes["ripple"]
            ),
        }
    )
)
"""Every term by name: its column as a function of the rows and of the shapes [SI]."""


def columns(
    rows: MotionRows, terms: Sequence[str], shapes: Mapping[str, float] = _NO_SHAPES
) -> Float[np.ndarray, "n p"]:
    """Return the regressor, one column for each term."""
    return np.stack([TERMS[name](rows, shapes) for name in terms], axis=1)


def relative_error(rows: MotionRows, predicted: Float[np.ndarray, " n"]) -> float:
    """Return the norm of the error over that of the effort, on the moving rows [-]."""
    use = rows.moving
    scale = float(np.linalg.norm(rows.effort[use]))
    error = float(np.linalg.norm((rows.effort - predicted)[use]))
    return error / scale if scale else float("nan")


def fit_rows(
    rows: MotionRows,
    terms: Sequence[str] = PLAIN_TERMS,
    shapes: Mapping[str, float] = _NO_SHAPES,
) -> ReferenceFit | None:
    """Fit the effort of the moving rows by least squares; None if fewer than 40 rows move.

    A Stribeck velocity that is absent from the shapes is chosen from a grid.
    """
    moving = rows.part(rows.moving)
    if moving.time.size < FEWEST_ROWS:
        return None
    if "stribeck" not in terms or "stribeck" in shapes:
        return _solve(moving, terms, shapes)
    speeds = np.abs(moving.velocity)
    low, high = max(float(np.quantile(speeds, 0.02)), 1e-9), float(np.quantile(speeds, 0.6))
    fits = (
        _solve(moving, terms, {**shapes, "stribeck": float(speed)})
        for speed in np.geomspace(low, high, _STRIBECK_SPEEDS)
    )
    return min(fits, key=lambda fit: fit.relative_residual)


def _solve(moving: MotionRows, terms: Sequence[str], shapes: Mapping[str, float]) -> ReferenceFit:
    matrix = columns(moving, terms, shapes)
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    scaled = matrix / scale
    # Normal equations: a pseudo-inverse of p by p is as good here, and ten times as fast.
    solution = np.linalg.pinv(scaled.T @ scaled, hermitian=True) @ (scaled.T @ moving.effort)
    solution /= scale
    return ReferenceFit(
        terms=tuple(terms),
        values=dict(zip(terms, (float(value) for value in solution), strict=True)),
        shapes=dict(shapes),
        delay=moving.delay,
        relative_residual=relative_error(moving, matrix @ solution),
    )


def find_delay(log: FilteredLog, terms: Sequence[str] = PLAIN_TERMS) -> float:
    """Return the delay of the effort that minimizes the residual [s].

    It is 0 if too few rows move, if no delay within 25 ms is a minimum, as where stick-slip or
    presliding looks like a long delay, or if the minimum lowers the residual by less than 1 %.
    """

    def residual(delay: float) -> float:
        fit = fit_rows(log.rows(delay), terms)
        return np.inf if fit is None else fit.relative_residual

    without = residual(0.0)
    if not np.isfinite(without):
        return 0.0
    coarse = np.arange(-_DELAY_REACH, _DELAY_REACH + _DELAY_STEP / 2, _DELAY_STEP)
    best = int(np.argmin([residual(float(delay)) for delay in coarse]))
    if best in {0, coarse.size - 1}:
        return 0.0
    found = optimize.minimize_scalar(
        residual,
        bounds=(coarse[best - 1], coarse[best + 1]),
        method="bounded",
        options={"xatol": _DELAY_TOLERANCE},
    )
    return float(found.x) if found.fun < (1.0 - _DELAY_GAIN) * without else 0.0
