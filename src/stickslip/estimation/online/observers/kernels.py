"""Kernels of the observers of the friction force: the balance of one sample, and their steps.

Over a sample in which the effort u is held, momentum is exactly

    m (v - v_0) = T (u_0 - k_s d - f),    f = c v_m + f_c sign(v) + offset,

with means over the sample: d the stretch of the spring, v_m the velocity, f the friction force. So
f is known at the end of each sample without a derivative, and is linear in what is sought. Samples
in which the velocity changes its sign or is zero at an end give no row. Nor do
those of a rest: where its noise makes an axis seem to move, its force has either sign, and an
observer learns from that that there is no friction. A dead band keeps it from that.

A sample passes `stickslip.estimation.online.faults.admission` first. One with a missing or
impossible value gives no row, nor does the next one. After a sample `_settled` returns to
the last valid estimates if these are not finite (`stickslip.estimation.online.faults.guard`).

The fields of the recursion (`stickslip.estimation.online.recursion`) come first, with viscous
friction, Coulomb friction and the offset as its values (and a sought mass before them).
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE, admit
from stickslip.estimation.online.faults.guard import guard_dtype, stays_valid
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import RECURSION, VALUES, update
from stickslip.numerics.named_fields import fields_at, places

_FRICTION = 3  # parameters that a gain belongs to
_VALUES = 4  # at most: inertia, viscous and Coulomb friction, offset

_LEARNED: list[Any] = [
    ("recursion", RECURSION),
    # Settings
    ("inertia", "f8"),  # 0 where it is sought
    ("speed", "f8"),  # typical one, that gains refer to
    ("dead_band", "f8"),  # slower than this, the axis may be at rest
    ("gains", "f8", (_FRICTION,)),  # Gamma
    # What changes
    ("known", "i8"),  # whether there is a sample before this one
    ("last_effort", "f8"),
    ("last_position", "f8"),
    ("last_velocity", "f8"),
    ("last_load", "f8"),
    ("last_load_velocity", "f8"),
    ("force", "f8"),  # f of the last sample; with the inertia sought, f and its force
    # Least squares
    ("block", "i8"),  # samples in a block
    ("filled", "i8"),  # samples in the block so far
    ("force_sum", "f8"),  # over the block
    ("row_sum", "f8", (_VALUES,)),
    # Friedland and Park
    ("exponent", "f8"),  # mu
    # Gradient
    ("filter_share", "f8"),  # 1 - exp(-lambda T)
    ("filtered_force", "f8"),
    ("filtered_row", "f8", (_FRICTION,)),
    # Liao and Chien
    ("k_p", "f8"),
    ("k_d", "f8"),
    ("cross", "f8"),  # <B, P E> = cross e + square e'
    ("square", "f8"),
    ("model_position", "f8"),
    ("model_velocity", "f8"),
]
_FIELDS = np.dtype(
    [
        *_LEARNED,
        ("admission", ADMISSION_DTYPE),
        ("guard", guard_dtype(places(np.dtype(_LEARNED)))),
    ]
)
STATE_SIZE = places(_FIELDS)

fields = fields_at(_FIELDS)


@compiled(inline=True)
def _balance(s: Any, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Write force and row of the sample that ends here; return whether there is a row.

    The mean stretch of the spring is that of the cubic through both ends.
    """
    complete = False
    ready, u, unknown, x, v, x2, v2, _ = admit(s.admission, u, x, v, x2, v2)
    if not ready:
        return False
    if s.recursion.stiffness == 0.0:
        x2, v2 = 0.0, 0.0
    if np.isnan(x + v + x2 + v2):
        s.known = 0
        return False
    v0 = s.last_velocity
    if s.known:
        T = s.recursion.sampling_time
        d0, d = s.last_position - s.last_load, x - x2
        w0, w = v0 - s.last_load_velocity, v - v2
        stretch = 0.5 * (d0 + d) + T / 12.0 * (w0 - w)
        acceleration = (v - v0) / T
        s.force = s.last_effort - s.inertia * acceleration - s.recursion.stiffness * stretch
        k, row = 0, s.recursion.row
        if s.inertia == 0.0:
            row[k] = acceleration
            k += 1
        row[k] = 0.5 * (v0 + v)
        row[k + 1] = 1.0 if v > 0.0 else -1.0
        row[k + 2] = 1.0
        complete = v0 * v > 0.0 and min(abs(v0), abs(v)) > s.dead_band
    s.known = 0 if unknown else 1
    s.last_effort, s.last_position, s.last_velocity = u, x, v
    s.last_load, s.last_load_velocity = x2, v2
    return complete


@compiled(inline=True)
def _follow(s: Any, y: float, rho: float) -> None:
    """Follow the gradient flow theta' = rho Gamma r (y - <r, theta>) over a sample.

    With the row r and the target y held, the flow moves along Gamma r only, and is solved exactly:
    the error y - <r, theta> decays by exp(-rho g T), g = <r, Gamma r>. So the step is stable
    whatever the gains, and <theta~, Gamma^-1 theta~> never grows where y = <r, theta>.
    """
    g, e = 0.0, y
    for i in range(_FRICTION):
        g += s.gains[i] * s.recursion.row[i] * s.recursion.row[i]
        e -= s.recursion.row[i] * s.recursion.values[i]
    if g > 0.0:
        share = -np.expm1(-rho * g * s.recursion.sampling_time) / g
        for i in range(_FRICTION):
            s.recursion.values[i] += s.gains[i] * s.recursion.row[i] * share * e


@compiled(inline=True)
def _settled(vector: State, s: Any, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Validate the estimates after a sample; return whether all of the sample was finite."""
    if not stays_valid(vector, s.guard, VALUES, _VALUES):
        s.known = 0
    load = x2 + v2 if s.recursion.stiffness > 0.0 else 0.0
    return bool(np.isfinite(u + x + v + load))


@compiled(brief=True)
def least_squares_step(vector: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into a state, in place; return whether all of it was finite.

    Rows are the means over blocks of samples.
    """
    s = fields(vector)
    p = s.recursion.parameters
    if not _balance(s, u, x, v, x2, v2):
        s.filled = 0
        return _settled(vector, s, u, x, v, x2, v2)
    if s.filled == 0:
        s.force_sum = 0.0
        s.row_sum[:] = 0.0
    s.force_sum += s.force
    for i in range(p):
        s.row_sum[i] += s.recursion.row[i]
    s.filled += 1
    if s.filled >= s.block:
        for i in range(p):
            s.recursion.row[i] = s.row_sum[i] / s.block
        update(s.recursion, s.force_sum / s.block, s.recursion.forgetting, True)
        s.filled = 0
    return _settled(vector, s, u, x, v, x2, v2)


@compiled(inline=True)
def _friedland_park_slope(a: float, b: float, mu: float, scale: float) -> float:
    """Return the mean of g' / rate while the speed goes evenly from a to b.

    It is (g(b) - g(a)) / (b - a) of g / rate = scale (|v| / scale)^mu.
    """
    if mu == 1.0:
        return 1.0
    a, b = a / scale, b / scale
    if abs(b - a) < 1e-6 * (a + b):
        return mu * (0.5 * (a + b)) ** (mu - 1.0)
    return (b**mu - a**mu) / (b - a)


@compiled(brief=True)
def friedland_park_step(vector: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into a state, in place; return whether all of it was finite.

    a^' = g' (f sign(v) - a^) over a sample, exact where f is held and the speed changes evenly.
    """
    s = fields(vector)
    before = abs(s.last_velocity)
    if _balance(s, u, x, v, x2, v2):
        slope = _friedland_park_slope(before, abs(s.last_velocity), s.exponent, s.speed)
        _follow(s, s.force, slope)
    return _settled(vector, s, u, x, v, x2, v2)


@compiled(inline=True)
def _logarithmic_slope(a: float, b: float, scale: float) -> float:
    """Return the mean of g' / rate = 1 / (1 + |v| / scale) while the speed goes from a to b."""
    z = (b - a) / (scale + a)
    if abs(z) < 1e-5:
        return scale / (scale + a) * (1.0 - 0.5 * z)
    return scale / (scale + a) * np.log1p(z) / z


@compiled(brief=True)
def yazdizadeh_khorasani_step(
    vector: State, u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into a state, in place; return whether all of it was finite."""
    s = fields(vector)
    before = abs(s.last_velocity)
    if _balance(s, u, x, v, x2, v2):
        _follow(s, s.force, _logarithmic_slope(before, abs(s.last_velocity), s.speed))
    return _settled(vector, s, u, x, v, x2, v2)


@compiled(brief=True)
def liao_chien_step(vector: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into a state, in place; return whether all of it was finite.

    The equations of E = (e, w) and of q = <r, theta~>,

        e' = w,    w' = -k_p e - k_d w - q / m,    q' = -g (q - <B, P E> / m),    g = <r, Gamma r>,

    are linear over a sample, and are stepped by the implicit midpoint rule, under which a quadratic
    V never grows. Where the axis turned or rested in the sample, friction is not known, and the
    model is set onto the axis.
    """
    s = fields(vector)
    e = s.last_position - s.model_position
    w = s.last_velocity - s.model_velocity
    if not _balance(s, u, x, v, x2, v2):
        s.model_position, s.model_velocity = s.last_position, s.last_velocity
        return _settled(vector, s, u, x, v, x2, v2)
    m, h = s.inertia, 0.5 * s.recursion.sampling_time
    q, g = s.force, 0.0
    for i in range(_FRICTION):
        q -= s.recursion.row[i] * s.recursion.values[i]
        g += s.gains[i] * s.recursion.row[i] * s.recursion.row[i]
    # Midpoint values from e_m = e + h w_m and the equations of q' and e''
    alpha = 1.0 + h * g
    beta = 1.0 + h * s.k_d + h * h * s.k_p
    kappa = h * g / m * (h * s.cross + s.square)
    q_known = q + h * g / m * s.cross * e
    w_known = w - h * s.k_p * e
    det = alpha * beta + kappa * h / m
    q_m = (beta * q_known + kappa * w_known) / det
    w_m = (alpha * w_known - h / m * q_known) / det
    e_m = e + h * w_m
    speed = 2.0 * h * (q_m - (s.cross * e_m + s.square * w_m) / m)
    for i in range(_FRICTION):
        s.recursion.values[i] += s.gains[i] * s.recursion.row[i] * speed
    before = s.model_velocity
    s.model_velocity = s.last_velocity - (2.0 * w_m - w)
    s.model_position += h * (before + s.model_velocity)
    return _settled(vector, s, u, x, v, x2, v2)


@compiled(brief=True)
def gradient_step(vector: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into a state, in place; return whether all of it was finite."""
    s = fields(vector)
    if _balance(s, u, x, v, x2, v2):
        s.filtered_force += s.filter_share * (s.force - s.filtered_force)
        for i in range(_FRICTION):
            s.filtered_row[i] += s.filter_share * (s.recursion.row[i] - s.filtered_row[i])
            s.recursion.row[i] = s.filtered_row[i]
        _follow(s, s.filtered_force, 1.0)
    return _settled(vector, s, u, x, v, x2, v2)


METHODS = ("rls", "friedland-park", "yazdizadeh-khorasani", "liao-chien", "gradient")
"""Names of the estimators, in the order of the numbers that `observer_run` takes."""


@compiled()
def observer_run(
    method: int,
    vector: State,
    samples: Float[np.ndarray, "n 5"],
    quiet: Bool[np.ndarray, " n"],
) -> Float[np.ndarray, "n 4"]:
    """Take many samples, in place; return the values after each. Quiet samples give no row.

    One loop for all: a kernel that takes another one as an argument could not be kept on disk.
    """
    n = samples.shape[0]
    s = fields(vector)
    history = np.empty((n, _VALUES))
    for k in range(n):
        u, x, v, x2, v2 = samples[k]
        if quiet[k]:
            s.known = 0
        if method == 0:
            least_squares_step(vector, u, x, v, x2, v2)
        elif method == 1:
            friedland_park_step(vector, u, x, v, x2, v2)
        elif method == 2:
            yazdizadeh_khorasani_step(vector, u, x, v, x2, v2)
        elif method == 3:
            liao_chien_step(vector, u, x, v, x2, v2)
        else:
            gradient_step(vector, u, x, v, x2, v2)
        if quiet[k]:
            s.known = 0
        history[k] = s.recursion.values[:_VALUES]
    return history
