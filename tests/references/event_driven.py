"""Independent reference: both plants under zero-order hold, event by event, in high precision.

Written to be read and to be right, not to be fast. Between events the motion is a sum of
exponentials and a polynomial in time (`exact_plants.Curve`), written down from the eigenvalues of
the plant. Events are found by bisecting what is left of the sample until bounds prove each piece to
hold no zero or exactly one (`first_zero`); a zero is then polished to the working precision.
Nothing is shared with the package under test.

Friction on the (first) mass, with w = effort - offset - spring force:

- sticking (v = 0): it stays while -static_negative <= w <= static_positive;
- slipping the way of s = +1 or -1: inertia * acceleration = w - s coulomb_s - viscous_s v.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from exact_plants import Curve, Number, Plant, State
from mpmath import mp, mpf

WORKING_DIGITS = 100
"""Digits carried. Small viscous friction c costs up to 2 log10(1/c) of them by cancellation."""

_SPARE = 30
"""Digits at the end of the working precision that are taken as rounding noise."""

_MAXIMUM_EVENTS = 1000
"""In one sample; more means that the reference is wrong."""


def _noise() -> mpf:
    """Relative size below which a number is taken as zero."""
    return mpf(10) ** (_SPARE - mp.dps)


def sign_after_zero(curve: Curve, duration: mpf) -> tuple[int, mpf]:
    """Sign of the curve just after t = 0, and a time up to which it is proven to keep it.

    The first derivative that does not vanish decides (order n, magnitude f). Taylor's theorem gives
    the time, f t^n / n! > bound_(n+1) t^(n+1) / (n+1)!, of which half is taken.
    """
    for order in range(6):
        value = curve.at(mpf(0), order)
        if abs(value) > _noise() * max(curve.bound(duration, order), mpf(1) / 10**9):
            bound = curve.bound(duration, order + 1)
            proven = duration if bound == 0 else (order + 1) * abs(value) / bound / 2
            return int(mp.sign(value)), min(proven, duration)
    return 0, duration


def first_zero(curve: Curve, start: mpf, end: mpf) -> tuple[mpf, bool] | None:
    """First zero in [start, end] and whether it is a crossing (else the curve touches zero).

    On an interval of half-width r around t, Taylor's theorem allows no zero if
    abs(f) > r abs(f1) + r^2/2 max abs(f2), and at most one, by the same test of the slope, if
    abs(f1) > r abs(f2) + r^2/2 max abs(f3), where fn is the n-th derivative. Intervals that pass
    neither test are halved; one that is as narrow as the working precision allows holds a double
    zero.
    """
    bends = curve.bound(end, 2), curve.bound(end, 3)
    narrowest = end * mpf(10) ** (-(mp.dps - _SPARE) // 2)
    pieces = [(start, end)]
    while pieces:
        a, b = pieces.pop()
        middle, r = (a + b) / 2, (b - a) / 2
        value, slope, bend = (curve.at(middle, order) for order in range(3))
        if abs(value) > r * abs(slope) + r**2 / 2 * bends[0]:
            continue
        if abs(slope) > r * abs(bend) + r**2 / 2 * bends[1]:
            if curve.at(a) * curve.at(b) <= 0:
                return _polish(curve, a, b), True
            continue
        if b - a < narrowest:
            return middle, False
        pieces += [(middle, b), (a, middle)]
    return None


def _polish(curve: Curve, a: mpf, b: mpf) -> mpf:
    """Newton's method kept inside the bracket [a, b] of a monotone curve."""
    rising = curve.at(b) > curve.at(a)
    t = (a + b) / 2
    for _ in range(20 * mp.dps):
        value = curve.at(t)
        if value == 0:
            return t
        if (value > 0) == rising:
            b = t
        else:
            a = t
        step = value / curve.at(t, 1)
        following = t - step
        if not a < following < b:
            following = (a + b) / 2
        if abs(following - t) <= abs(b) * mpf(10) ** (5 - mp.dps):
            return following
        t = following
    message = "a bracketed zero was not found"
    raise ArithmeticError(message)


@dataclass(kw_only=True)
class Run:
    """A simulated run: n + 1 states, whether the (first) mass sticks there, and what happened."""

    states: list[State]
    stuck: list[bool]
    events: list[tuple[int, str]] = field(default_factory=list)
    """(sample, kind): "stick", "reversal", "breakaway" inside a sample, "start" at its beginning,
    "touch" where the velocity touches zero without crossing it."""
    times: list[mpf] = field(default_factory=list)
    """Time [s] of each event."""
    places: list[mpf] = field(default_factory=list)
    """Position of the (first) mass at each event."""

    def count(self, *kinds: str) -> int:
        """Count the events of these kinds."""
        return sum(kind in kinds for _, kind in self.events)

    def hidden(self) -> int:
        """Samples with a stop inside that both ends do not show: slipping alike before and after.

        Both a stop and the end of it within one sample, and two reversals within one, are counted.
        """
        stops: dict[int, int] = {}
        for sample, kind in self.events:
            if kind in {"stick", "reversal"}:
                stops[sample] = stops.get(sample, 0) + 1
        return sum(mp.sign(self.states[k][1]) * mp.sign(self.states[k + 1][1]) > 0 for k in stops)


def simulate(
    plant: Plant,
    effort: Sequence[Number],
    sampling_time: Number,
    initial_state: Sequence[Number],
    *,
    digits: int = WORKING_DIGITS,
) -> Run:
    """Simulate under zero-order hold; ``effort[k]`` acts from sample k to sample k + 1.

    Floats are taken as the exact binary numbers they are.
    """
    with mp.workdps(digits):
        state: State = tuple(mpf(value) for value in initial_state)
        duration = mpf(sampling_time)
        run = Run(states=[state], stuck=[])
        s = int(mp.sign(state[1]))
        for k, value in enumerate(effort):
            if k == 0:
                run.stuck.append(s == 0 and _leaves(plant, state, mpf(value), duration) == 0)
            state, s = _advance(plant, state, s, mpf(value), duration, _recorder(run, k, duration))
            run.states.append(state)
            run.stuck.append(s == 0)
        return run


def _recorder(run: Run, k: int, duration: mpf) -> Callable[[str, mpf, State], None]:
    def record(kind: str, left: mpf, state: State) -> None:
        run.events.append((k, kind))
        run.times.append((k + 1) * duration - left)
        run.places.append(state[0])

    return record


def _advance(
    plant: Plant,
    state: State,
    s: int,
    effort: mpf,
    left: mpf,
    record: Callable[[str, mpf, State], None],
) -> tuple[State, int]:
    """Carry the state over one sample, event by event."""
    before = "start"
    for _ in range(_MAXIMUM_EVENTS):
        if left == 0:
            return state, s
        if s == 0:
            s = _leaves(plant, state, effort, left)
            if s != 0:
                record(before, left, state)
        if s == 0:
            state, left = _stick(plant, state, effort, left)
            before = "breakaway"
            continue
        state, left, stopped = _slip(plant, state, s, effort, left)
        if stopped:
            touching = stopped == "touch"
            was, s = s, 0
            if touching:
                record("touch", left, state)
            if left > 0 and not touching:
                s = _leaves(plant, state, effort, left)
            record("reversal" if s == -was else "stick", left, state)
            before = "breakaway"
    message = f"more than {_MAXIMUM_EVENTS} events in one sample"
    raise ArithmeticError(message)


def _leaves(plant: Plant, state: State, effort: mpf, left: mpf) -> int:
    """Direction in which a mass at rest starts to slip now; 0 if it sticks."""
    drive = plant.drive(state, effort)
    law = plant.friction
    for s in (1, -1):
        excess = drive.affine(-law.of(law.static, s), s)
        if sign_after_zero(excess, left)[0] > 0:
            return s
    return 0


def _stick(plant: Plant, state: State, effort: mpf, left: mpf) -> tuple[State, mpf]:
    """Stay at rest until the drive leaves the stick range, or to the end of the sample."""
    positions = plant.stick(state)
    drive = plant.drive(state, effort)
    law = plant.friction
    leave = left
    for s in (1, -1):
        reserve = drive.affine(law.of(law.static, s), -s)
        _, start = sign_after_zero(reserve, left)
        while start < leave:
            zero = first_zero(reserve, start, leave)
            if zero is None:
                break
            time, crossing = zero
            if crossing:
                leave = time
                break
            start = time + left * mpf(10) ** (-mp.dps // 4)  # touched the limit: it still sticks
    return _state_at(positions, leave, at_rest=True), left - leave


def _slip(
    plant: Plant, state: State, s: int, effort: mpf, left: mpf
) -> tuple[State, mpf, str | None]:
    """Slip until the velocity is zero, or to the end of the sample."""
    positions = plant.slip(state, effort, s)
    velocity = positions[0].derivative().affine(mpf(0), s)
    start = mpf(0)
    if state[1] == 0:
        sign, start = sign_after_zero(velocity, left)
        if sign <= 0:
            message = "a breakaway does not move the way of the drive"
            raise ArithmeticError(message)
    zero = first_zero(velocity, start, left)
    if zero is None:
        # A zero at the very end of the sample may be missed by a rounding error.
        rest = abs(velocity.at(left)) <= _noise() * velocity.bound(left, 0)
        return _state_at(positions, left, at_rest=rest), mpf(0), "stop" if rest else None
    time, crossing = zero
    left = mpf(0) if abs(left - time) <= _noise() * left else left - time
    return _state_at(positions, time, at_rest=True), left, "stop" if crossing else "touch"


def _state_at(positions: tuple[Curve, ...], t: mpf, *, at_rest: bool) -> State:
    values = [value for curve in positions for value in (curve.at(t), curve.at(t, 1))]
    if at_rest:
        values[1] = mpf(0)
    return tuple(values)
