"""An independent reference: plain least squares of the effort on the motion.

NumPy and SciPy only; nothing here is shared with the estimators that it judges. Positions and
efforts are interpolated to a uniform grid in each stretch without gaps, low-passed by a zero-phase
Butterworth filter of order 4, and differentiated by central differences. Rows at low speed are left
out. The effort is advanced by the delay that minimizes the residual, a fraction of a sample
included.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Bool, Float
from scipy import optimize, signal

__all__ = [
    "PLAIN_TERMS",
    "TERMS",
    "MotionRows",
    "ReferenceFit",
    "columns",
    "fit_reference",
    "motion_rows",
    "relative_error",
]

PLAIN_TERMS = ("inertia", "viscous_friction", "coulomb_friction", "offset")
"""The terms that every reference fit has."""

_ORDER = 4
_GAP = 3.5
_EDGE_PERIODS = 1.5
_ROWS_PER_PERIOD = 4.0
_FEWEST_ROWS = 40
_COARSE_DELAYS = 41
_DELAY_REACH = 3.0


@dataclass(frozen=True, kw_only=True)
class MotionRows:
    """Filtered motion and effort on the rows that a fit uses.

    Attributes
    ----------
    time, position, velocity, acceleration
        Shape (n,) [SI].
    effort
        Low-passed effort, advanced by ``delay``, shape (n,) [unit of the log].
    delay
        Time by which the logged effort is late with regard to the motion [s].
    moving
        Rows whose speed exceeds the limit, shape (n,).
    """

    time: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    delay: float
    moving: Bool[np.ndarray, " n"]

    def part(self, rows: Bool[np.ndarray, " n"]) -> "MotionRows":
        """Return the selected rows only."""
        return MotionRows(
            time=self.time[rows],
            position=self.position[rows],
            velocity=self.velocity[rows],
            acceleration=self.acceleration[rows],
            effort=self.effort[rows],
            delay=self.delay,
            moving=self.moving[rows],
        )


@dataclass(frozen=True, kw_only=True)
class ReferenceFit:
    """A least-squares fit of the effort.

    Attributes
    ----------
    terms
        Names of the terms, see `TERMS`.
    values
        Coefficient of each [unit of the effort over that of the term].
    delay
        Time by which the logged effort is late [s].
    relative_residual
        Norm of the residual over norm of the effort, on the moving rows [-].
    stribeck_velocity
        Velocity at which the Stribeck term has fallen to 1/e [m/s or rad/s]; NaN without that term.
    """

    terms: tuple[str, ...]
    values: Mapping[str, float]
    delay: float
    relative_residual: float
    stribeck_velocity: float

    def predict(self, rows: MotionRows) -> Float[np.ndarray, " n"]:
        """Return the effort of the fitted law on these rows."""
        matrix = columns(rows, self.terms, self.stribeck_velocity)
        return matrix @ np.array([self.values[name] for name in self.terms])


TERMS: Mapping[str, Callable[[MotionRows, float], Float[np.ndarray, " n"]]] = MappingProxyType(
    {
        "inertia": lambda rows, _: rows.acceleration,
        "viscous_friction": lambda rows, _: rows.velocity,
        "coulomb_friction": lambda rows, _: np.sign(rows.velocity),
        "offset": lambda rows, _: np.ones_like(rows.velocity),
        "gravity_sine": lambda rows, _: np.sin(rows.position),
        "gravity_cosine": lambda rows, _: np.cos(rows.position),
        "spring": lambda rows, _: rows.position - rows.position.mean(),
        "viscous_asymmetry": lambda rows, _: np.abs(rows.velocity),
        "quadratic": lambda rows, _: rows.velocity * np.abs(rows.velocity),
        "two_thirds": lambda rows, _: np.sign(rows.velocity) * np.abs(rows.velocity) ** (2 / 3),
        "stribeck": lambda rows, speed: (
            np.sign(rows.velocity) * np.exp(-((rows.velocity / speed) ** 2))
        ),
        "drift_offset": lambda rows, _: rows.time - rows.time.mean(),
        "drift_coulomb": lambda rows, _: (rows.time - rows.time.mean()) * np.sign(rows.velocity),
        "drift_viscous": lambda rows, _: (rows.time - rows.time.mean()) * rows.velocity,
        "coulomb_place": lambda rows, _: (
            (rows.position - rows.position.mean()) * np.sign(rows.velocity)
        ),
    }
)
"""Every term by name: its column as a function of the rows and of a Stribeck velocity [SI]."""


def columns(
    rows: MotionRows, terms: Sequence[str], stribeck_velocity: float = np.nan
) -> Float[np.ndarray, "n p"]:
    """Return the regressor with one column for each term."""
    return np.stack([TERMS[name](rows, stribeck_velocity) for name in terms], axis=1)


def motion_rows(
    time: Float[np.ndarray, " n"],
    position: Float[np.ndarray, " n"],
    effort: Float[np.ndarray, " n"],
    *,
    cutoff: float,
    slow: float,
    delay: float = 0.0,
) -> MotionRows:
    """Filter a log and return its rows, about four for each period of the cutoff frequency.

    Parameters
    ----------
    time, position, effort
        The log as recorded, shape (n,) [SI].
    cutoff
        Cutoff of the low-pass [Hz].
    slow
        Speed up to which rows do not count as moving [m/s or rad/s].
    delay
        Time by which the logged effort is late [s].

    Returns
    -------
    The rows of all stretches without gaps. They are empty if every stretch is too short.
    """
    steps = np.diff(time)
    starts = [0, *(np.flatnonzero(steps > _GAP * np.median(steps)) + 1), time.size]
    pieces: list[tuple[Float[np.ndarray, " m"], ...]] = []
    for start, stop in zip(starts[:-1], starts[1:], strict=True):
        piece = _stretch(time[start:stop], position[start:stop], effort[start:stop], cutoff, delay)
        if piece is not None:
            pieces.append(piece)
    if not pieces:
        empty = np.empty(0)
        pieces = [(empty, empty, empty, empty, empty)]
    t, q, v, a, u = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    return MotionRows(
        time=t,
        position=q,
        velocity=v,
        acceleration=a,
        effort=u,
        delay=delay,
        moving=np.abs(v) > slow,
    )


def _stretch(
    time: Float[np.ndarray, " n"],
    position: Float[np.ndarray, " n"],
    effort: Float[np.ndarray, " n"],
    cutoff: float,
    delay: float,
) -> tuple[Float[np.ndarray, " m"], ...] | None:
    if time.size < 2:
        return None
    period = (time[-1] - time[0]) / (time.size - 1)
    edge = int(np.ceil(_EDGE_PERIODS / (cutoff * period)))
    if time.size < 2 * edge + 4:
        return None
    grid = time[0] + period * np.arange(time.size)
    q, u = np.interp(grid, time, position), np.interp(grid, time, effort)
    relative = 2.0 * cutoff * period
    if relative < 1.0:
        sections = signal.butter(_ORDER, relative, output="sos")
        pad = min(3 * edge, time.size - 1)
        q, u = (signal.sosfiltfilt(sections, x, padlen=pad) for x in (q, u))
    v = np.gradient(q, period)
    a = np.gradient(v, period)
    if delay:
        u = np.interp(grid + delay, grid, u)
    keep = max(1, int(1.0 / (_ROWS_PER_PERIOD * cutoff * period)))
    inner = slice(edge, time.size - edge, keep)
    return grid[inner], q[inner], v[inner], a[inner], u[inner]


def relative_error(rows: MotionRows, predicted: Float[np.ndarray, " n"]) -> float:
    """Return the norm of the error over that of the effort, on the moving rows [-]."""
    use = rows.moving
    scale = np.linalg.norm(rows.effort[use])
    if not scale:
        return float("nan")
    return float(np.linalg.norm((rows.effort - predicted)[use]) / scale)


def fit_reference(
    time: Float[np.ndarray, " n"],
    position: Float[np.ndarray, " n"],
    effort: Float[np.ndarray, " n"],
    *,
    cutoff: float,
    slow: float,
    terms: Sequence[str] = PLAIN_TERMS,
    delay: float | None = None,
) -> ReferenceFit | None:
    """Fit the effort by least squares.

    Parameters
    ----------
    time, position, effort, cutoff, slow
        See `motion_rows`.
    terms
        Names of the terms.
    delay
        Time by which the logged effort is late [s]; None estimates it.

    Returns
    -------
    The fit, or None if there are fewer than 40 moving rows.
    """
    wanted = {"cutoff": cutoff, "slow": slow}
    rows = motion_rows(time, position, effort, delay=delay or 0.0, **wanted)
    if np.count_nonzero(rows.moving) < _FEWEST_ROWS:
        return None
    if delay is None:
        reach = _DELAY_REACH * max(0.008, float(np.median(np.diff(time))))

        def residual(candidate: float) -> float:
            shifted = motion_rows(time, position, effort, delay=candidate, **wanted)
            return _solve(shifted, terms).relative_residual

        coarse = np.linspace(-reach, reach, _COARSE_DELAYS)
        best = coarse[int(np.argmin([residual(d) for d in coarse]))]
        width = coarse[1] - coarse[0]
        found = optimize.minimize_scalar(
            residual, bounds=(best - width, best + width), method="bounded", options={"xatol": 1e-5}
        )
        rows = motion_rows(time, position, effort, delay=float(found.x), **wanted)
    return _solve(rows, terms)


def _solve(rows: MotionRows, terms: Sequence[str]) -> ReferenceFit:
    if "stribeck" not in terms:
        return _solve_linear(rows, terms, np.nan)
    speeds = np.abs(rows.velocity[rows.moving])
    grid = np.geomspace(max(np.quantile(speeds, 0.02), 1e-9), np.quantile(speeds, 0.6), 12)
    fits = [_solve_linear(rows, terms, float(speed)) for speed in grid]
    return min(fits, key=lambda fit: fit.relative_residual)


def _solve_linear(rows: MotionRows, terms: Sequence[str], speed: float) -> ReferenceFit:
    moving = rows.part(rows.moving)
    matrix = columns(moving, terms, speed)
    scale = np.linalg.norm(matrix, axis=0)
    scale[scale == 0.0] = 1.0
    solution = np.linalg.lstsq(matrix / scale, moving.effort, rcond=None)[0] / scale
    residual = moving.effort - matrix @ solution
    return ReferenceFit(
        terms=tuple(terms),
        values=dict(zip(terms, (float(value) for value in solution), strict=True)),
        delay=rows.delay,
        relative_residual=float(np.linalg.norm(residual) / np.linalg.norm(moving.effort)),
        stribeck_velocity=speed,
    )
