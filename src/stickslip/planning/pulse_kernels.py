"""One pulse on a resting mass: how far it goes, and which pulse takes it as far as asked.

Van de Wijdeven (2002) B, Eqs. 2 and 3. The mass m, at rest, is pushed by the effort f for a time t
against the Coulomb friction F and the viscous friction c, and then left alone until it rests. Eq. 3
is the sum of the travel under the effort and the travel after it, and is computed as such: no term
cancels another as c or t goes to 0, and with c = 0 it is Eq. 2.
"""

import math

from stickslip.compiled import compiled
from stickslip.plants.closed_forms import phi1, phi2, stopping_distance, stopping_time

_ITERATIONS = 60  # of Newton's method at most
_CONVERGED = 4e-16  # relative step: about two units in the last place
_NEAR = 1e-9  # relative error of an effort behind a lag


@compiled(inline=True)
def _speed_after(m: float, F: float, c: float, f: float, t: float) -> float:
    """Return the speed at the end of the pulse, (f - F) t/m phi1(-c t/m)."""
    return (f - F) * t / m * phi1(-c * t / m)


@compiled(inline=True)
def pulse_ends(
    m: float, F: float, c: float, f: float, t: float
) -> tuple[float, float, float, float]:
    """Return position and speed at the end of the pulse, and time and displacement at rest."""
    v = _speed_after(m, F, c, f, t)
    x = (f - F) * t * t / m * phi2(-c * t / m)
    stopped = t + m * v / F * stopping_time(c * v / F)
    return x, v, stopped, x + m * v * v / F * stopping_distance(c * v / F)


@compiled(inline=True)
def position_along(
    m: float, F: float, c: float, f: float, t: float, tau: float,
    ends: tuple[float, float, float, float],
) -> float:  # fmt: skip
    """Return how far the mass is at the time tau after the start of a pulse with these ends."""
    x, v, stopped, d = ends
    if tau <= t:
        return (f - F) * tau * tau / m * phi2(-c * tau / m)
    if tau >= stopped:
        return d
    h, z = tau - t, -c * (tau - t) / m
    return x + v * h * phi1(z) - F * h * h / m * phi2(z)


@compiled()
def pulse_displacement(m: float, F: float, c: float, f: float, t: float) -> float:
    """Return the displacement from rest to rest (Eq. 3; Eq. 2 for c = 0), for f > F."""
    return pulse_ends(m, F, c, f, t)[3]


@compiled()
def pulse_duration(m: float, F: float, c: float, f: float, t: float) -> float:
    """Return the time from rest to rest, t + (m/c) log(1 + c v/F), for f > F."""
    return pulse_ends(m, F, c, f, t)[2]


@compiled()
def width_for(m: float, F: float, c: float, d: float, f: float) -> float:
    """Return the width t with which the effort f takes the mass by d > 0, for f > F.

    Newton's method on Eq. 3, which is convex in t with the slope f v/(F + c v). The solution of
    Eq. 4 is where it begins, as it is too short where there is viscous friction; the first step
    leads beyond the root, and all others back to it.
    """
    t = math.sqrt(2.0 * m * F * d / (f * (f - F)))
    for _ in range(_ITERATIONS):
        v = _speed_after(m, F, c, f, t)
        step = (pulse_displacement(m, F, c, f, t) - d) * (F + c * v) / (f * v)
        t -= step
        if abs(step) <= _CONVERGED * t:
            break
    return t


@compiled()
def effort_for(m: float, F: float, c: float, d: float, t: float) -> float:
    """Return the effort f > F that takes the mass by d > 0 within a pulse of width t.

    Newton's method on Eq. 3, which is convex in f. Eq. 15's positive root, exact without viscous
    friction and too small with it, is where it begins.
    """
    f = 0.5 * (F + math.sqrt(F * F + 8.0 * m * F * d / (t * t)))
    z = -c * t / m
    at_unit, gain = t * t / m * phi2(z), t / m * phi1(z)
    for _ in range(_ITERATIONS):
        v = (f - F) * gain
        slope = at_unit + m * v / (F + c * v) * gain
        step = (pulse_displacement(m, F, c, f, t) - d) / slope
        f -= step
        if abs(step) <= _CONVERGED * f:
            break
    return f


@compiled(inline=True)
def peak_behind_lag(f: float, t: float, lag: float) -> float:
    """Return the largest effort of a pulse behind a lag."""
    return f if lag <= 0.0 else f * -math.expm1(-t / lag)


@compiled()
def behind_lag(F: float, f: float, t: float, lag: float) -> tuple[float, float, float]:
    """Return effort, width and start of the pulse that does the same without the lag.

    The effort has risen to F after t_0. From there on it is f - (f - F) exp(-s/lag) until the
    pulse ends, at s = w, and u exp(-(s - w)/lag) after it. At rest the impulse I of the effort is
    F s. Newton's method finds that time from the right, as I - F s is concave. With the first
    moment M of the effort, the width is 2 M/I and the effort I over that.
    """
    if lag <= 0.0:
        return f, t, 0.0
    if peak_behind_lag(f, t, lag) <= F:  # never above friction
        return F, t, 0.0
    start = -lag * math.log1p(-F / f)
    w = t - start
    left = math.exp(-w / lag)
    u = f - (f - F) * left
    impulse = f * w - (f - F) * lag * (1.0 - left)
    s = (impulse + u * lag) / F
    for _ in range(_ITERATIONS):
        tail = u * math.exp(-(s - w) / lag)
        step = (impulse + (u - tail) * lag - F * s) / (tail - F)
        s -= step
        if abs(step) <= _NEAR * s:
            break
    tail = math.exp(-(s - w) / lag)
    moment = 0.5 * f * w * w - (f - F) * lag * (lag * (1.0 - left) - w * left)
    moment += u * lag * (w + lag - (s + lag) * tail)
    width = 2.0 * moment / (F * s)
    return F * s / width, width, start


@compiled()
def lagging_displacement(m: float, F: float, c: float, f: float, t: float, lag: float) -> float:
    """Return the displacement from rest to rest behind a lag; 0 if the effort stays below F."""
    effort, width, _ = behind_lag(F, f, t, lag)
    return pulse_displacement(m, F, c, effort, width) if effort > F else 0.0


@compiled()
def lagging_effort_for(
    m: float, F: float, c: float, d: float, t: float, lag: float, limit: float
) -> float:
    """Return the effort that takes the mass by d > 0 behind a lag, or the limit if it does not.

    Regula falsi (Illinois) between an effort that frees nothing and the limit.
    """
    if lag <= 0.0:
        return min(effort_for(m, F, c, d, t), limit)
    low, high = F / peak_behind_lag(1.0, t, lag), limit
    off_low, off_high = -d, lagging_displacement(m, F, c, high, t, lag) - d
    if off_high <= 0.0:
        return limit
    f = high
    for _ in range(_ITERATIONS):
        f = (low * off_high - high * off_low) / (off_high - off_low)
        off = lagging_displacement(m, F, c, f, t, lag) - d
        if abs(off) <= _NEAR * d:
            break
        if off > 0.0:
            high, off_high, off_low = f, off, 0.5 * off_low
        else:
            low, off_low, off_high = f, off, 0.5 * off_high
    return f
