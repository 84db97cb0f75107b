"""Effort over speed as a table with few points, placed for the smallest largest error."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.export.parameters import ExportParameters
from stickslip.friction.estimated_law import law_effort
from stickslip.records import InputError, positive

Values = Float[np.ndarray, " n"]
_GRID = 1000  # speeds at which deviations are measured
_COARSE = 120  # places that a knot can have
_STRAIGHT = 1e-9  # relative deviation of a law from a straight line that is rounding
MOST_POINTS = 100  # fewer than places


@dataclass(frozen=True, kw_only=True)
class LawTable:
    """Efforts to hold constant speeds."""

    speed: Values  #: Ascending from 0 [rad/s or m/s], shape (n,).
    #: Effort that holds the speed forward [N m or N], shape (n,); the friction with the offset.
    forward: Values
    #: The same backward; negative where friction dominates.
    backward: Values
    error: float  #: Largest deviation of linear interpolation from the law [N m or N].
    #: Speed below which the table leaves the Stribeck effect out [rad/s or m/s]; 0 without one.
    flat_below: float

    @property
    def magnitude(self) -> Values:
        """Mean of the friction of both directions, without the offset [N m or N], shape (n,)."""
        return 0.5 * (self.forward - self.backward)


def law_table(
    parameters: ExportParameters,
    *,
    points: int,
    top_speed: float,
    least_speed: float = 0.0,
    falling: bool = False,
) -> LawTable:
    """Return a table of the friction law of an axis, between two speeds [rad/s or m/s].

    Friction that falls with speed is left out unless it is for a simulation (``falling``): at each
    speed the table has the smallest friction of this and all higher speeds. So it never holds the
    static friction at zero speed, which would push a resting axis and make it hunt. Knots are
    placed by dynamic programming on a grid, and the efforts at them by a linear programme.
    """
    if not 2 <= points <= MOST_POINTS:
        raise InputError(
            "out_of_range", name="points", value=points, least=2, most=MOST_POINTS, unit=""
        )
    top_speed = positive("top_speed", top_speed, "rad/s or m/s")
    grid = _grid(parameters, least_speed, top_speed, _GRID)
    raw = [_magnitude(parameters, grid, sign) for sign in (1.0, -1.0)]
    laws = raw if falling else [np.minimum.accumulate(law[::-1])[::-1] for law in raw]
    left_out = np.array(raw) - np.array(laws) > 1e-12 * np.max(np.abs(raw))
    places = np.flatnonzero(left_out.any(axis=0))
    flat_below = float(grid[places[-1] + 1]) if places.size else 0.0
    coarse = _grid(parameters, least_speed, top_speed, _COARSE)
    knots = _knots(coarse, np.array([np.interp(coarse, grid, law) for law in laws]), points)
    speed = coarse[knots]
    chords = [np.interp(grid, grid[[0, -1]], law[[0, -1]]) for law in laws]
    if np.allclose(chords, laws, rtol=_STRAIGHT, atol=0.0):
        speed = np.linspace(least_speed, top_speed, points)
    fitted = [_fitted(grid, law, speed) for law in laws]
    offset = 0.0 if parameters.directional("coulomb_friction") else parameters.offset
    error = max(
        float(np.max(np.abs(np.interp(grid, speed, efforts) - law)))
        for efforts, law in zip(fitted, laws, strict=True)
    )
    return LawTable(
        speed=speed,
        forward=fitted[0] + offset,
        backward=-fitted[1] + offset,
        error=error,
        flat_below=flat_below,
    )


def _grid(parameters: ExportParameters, least: float, top: float, size: int) -> Values:
    """Return speeds that resolve the Stribeck effect and the whole range."""
    shapes = [
        value
        for name in ("stribeck_velocity", "low_speed_velocity")
        if (value := parameters.mean(name)) is not None and 0.0 < value < top
    ]
    fine = [np.linspace(0.0, min(4.0 * value, top), size // 3) for value in shapes]
    speeds = np.unique(np.concatenate([np.linspace(0.0, top, size), *fine]))
    return np.concatenate([[least], speeds[speeds > least]])


def _magnitude(parameters: ExportParameters, speed: Values, sign: float) -> Values:
    """Return the friction against a direction, without the offset [N m or N]."""
    values = {name: value for name, value in parameters.values.items() if name != "offset"}
    direction = np.full(speed.size, sign)
    return sign * law_effort(values, sign * speed, direction)


def _knots(grid: Values, laws: Float[np.ndarray, "d n"], points: int) -> list[int]:
    """Return the places of knots, for which chords deviate from the laws the least."""
    size = grid.size
    points = min(points, size)
    chord = np.zeros((size, size))
    for start in range(size - 1):
        # Deviation of all laws from the chords that begin here, at all places up to their ends
        spans, rises = grid[start + 1 :] - grid[start], laws[:, start + 1 :] - laws[:, start, None]
        lines = (rises / spans)[:, :, None] * spans
        inside = spans < spans[:, None]
        chord[start, start + 1 :] = np.max(np.abs(rises[:, None] - lines) * inside, axis=(0, 2))
    best = np.full((points, size), np.inf)
    before = np.zeros((points, size), dtype=int)
    best[0, 0] = 0.0
    for count in range(1, points):
        for end in range(1, size):
            worst = np.maximum(best[count - 1, :end], chord[:end, end])
            before[count, end] = int(np.argmin(worst))
            best[count, end] = worst[before[count, end]]
    knots = [size - 1]
    for count in range(points - 1, 0, -1):
        knots.append(int(before[count, knots[-1]]))
    return knots[::-1]


def _fitted(grid: Values, law: Values, knots: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    """Return the efforts at knots with the smallest largest deviation, none above at the first."""
    from scipy.optimize import linprog

    count = knots.size
    weights = np.array([np.interp(grid, knots, row) for row in np.eye(count)]).T
    ones = np.ones((grid.size, 1))
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.block([[weights, -ones], [-weights, -ones]]),
        b_ub=np.concatenate([law, -law]),
        bounds=[(None, float(law[0])), *[(None, None)] * (count - 1), (0.0, None)],
        method="highs",
    )
    # A solution always exists; HiGHS may give up on rounding
    return np.interp(knots, grid, law) if found.x is None else np.array(found.x[:count])
