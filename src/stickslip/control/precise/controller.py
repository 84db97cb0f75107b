"""The default controller of a rigid axis: a move with feedback, then pulses for what is left."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.base import LOADED, PositionController
from stickslip.control.checks import check_fields
from stickslip.control.equal_positions import expect_noise
from stickslip.control.feedback import profile_kernels
from stickslip.control.precise import learning as at
from stickslip.control.precise.braking import (
    PUSHES,
    accelerates_against_effort,
    brake,
    coasts,
    is_falling,
    may_be_elsewhere,
    pushed,
    remember,
    start_braking,
)
from stickslip.control.precise.holding import (
    RELEASES,
    hold,
    letting_go,
    start_holding,
    start_holding_falling,
    start_holding_moving,
)
from stickslip.control.precise.learning import (
    BRAKING,
    EXPLAINED,
    FROZEN,
    HOLDING,
    MOVE,
    SERVO,
    SHAKES,
    SIZE,
    own_fields,
    sent,
    teach,
    unexplained,
)
from stickslip.control.precise.moving import (
    WILD,
    go_on,
    shortest,
    start_move,
    vibrates,
)
from stickslip.control.precise.servo import (
    retarget_servo,
    servo_allowed,
    servo_effort,
    servo_for,
    start_servo,
)
from stickslip.control.pulses import exact_choice, exact_learning, exact_state
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.control.pulses.exact_state import COULOMB, HELD_FAST, law_of
from stickslip.control.pulses.kernel import (
    EXACT,
    MOVING,
    PULSING,
    REACHED,
    RESTING,
    blind_step,
    emit,
    head,
    leaves,
    readable,
    wait_for_rest,
    watch,
)
from stickslip.errors import check_class
from stickslip.friction import CoulombViscousFriction
from stickslip.planning.pulse_kernels import pulse_duration
from stickslip.records import (
    InputError,
    LearnedPulses,
    PositioningOutcome,
    PulseRecord,
    SensorSample,
    non_negative,
    quantity_field,
)

METHOD = 6  # of a vector of this kernel
_MOST_MOVES = 4  # to one target: each must halve the error
_WORTH = 5.0  # tolerances: a shorter way is that of a pulse
_SOONER = 1.0  # times the duration of a pulse: a move that takes longer is not begun
_EXTRA = 1.0  # samples that a move takes beyond the shortest time
_STRONG = 0.9  # of the effort limit: friction up to which a move is begun
_CERTAIN = 2.0  # standard deviations of friction: an effort that frees the axis
_UNKNOWN = 0.9  # standard deviation of the logarithm of unknown friction: a factor 6 is two of them
_UNKNOWN_SHARE = 0.12  # of the effort limit: between a third and a thirtieth, as usual of drives
_UNKNOWN_VISCOUS = 0.3  # of that friction at the largest speed
_PAUSE, _PAUSES = 0.3, 2  # duration [s] and number of waits for what still swings on the axis
_FEWEST = 2  # samples of a rest, where the delay is known
_GENTLE = 3.0  # times friction: effort of moves on an axis that vibrates
_GENTLER, _GENTLEST = 0.5, 1.5  # times that of the last one, if it vibrates again; times friction
_SWINGS = 5.0  # samples in which a swing is taken to die down to a third
_FRUITLESS = 2  # pulses that had not halved the error before the last one, from which one waits
_STAYS, _STAYS_FOR = 100, 0.5  # samples and time [s] at the target: what moves the axis then is new
_SERVO_ROWS = 8  # fewest measured samples of a move before the servo continues it
_BRAKED = 1.5  # factor by which pulses are shorter after one that has to be braked
_LEARNED = 2  # samples of motion from which the pulses learn


@compiled()
def _moves(p: Any, s: Any, own: Any, error: float) -> bool:
    """Return whether a move is to be begun, and no pulse."""
    if p.moves >= p.most_moves or error > 0.5 * p.last_error or error < _WORTH * s.tolerance:
        return False
    side = 0 if s.error > 0.0 else 1
    m, F, c = law_of(own, side)
    if _STRONG * p.most < F:
        return False
    f, n = exact_choice.pulse_for(own, side, error)
    fast = shortest(m, F, p.most, error) + _EXTRA * p.period
    return f <= F or fast < _SOONER * pulse_duration(m, F, c, f, n * p.period)


@compiled()
def _sure_friction(own: Any) -> float:
    """Return what Coulomb friction certainly is at least, to either side."""
    least = math.inf
    for side in range(2):
        i = COULOMB + side
        spread = _CERTAIN * math.sqrt(own.covariance[i, i])
        least = min(least, math.exp(own.values[i] - spread))
    return least


@compiled()
def _mean_friction(own: Any) -> float:
    """Return the Coulomb friction of both directions on average, without the load."""
    return 0.5 * (law_of(own, 0)[1] + law_of(own, 1)[1])


@compiled()
def _hasten(p: Any, s: Any, own: Any) -> None:
    """Set the samples in which an axis that friction stops certainly shows that it still moves.

    Slowed by F/m alone it goes F (n T)^2/(2 m) in the last n samples.
    """
    m, least = math.exp(own.values[0]), _sure_friction(own)
    n = math.ceil(math.sqrt(2.0 * s.spread * m / least) / p.period) + math.ceil(p.lag)
    s.early = min(s.window, max(n + 1, _FEWEST))


@compiled()
def _calm(p: Any, own: Any) -> None:
    """Let moves begin with less effort, which excites a vibration less."""
    F = max(law_of(own, 0)[1], law_of(own, 1)[1])
    most = max(_GENTLER * p.most, _GENTLEST * F) if p.shaken else _GENTLE * F
    p.most, p.shaken = min(p.most, most), 1
    own.vibrates = 1


@compiled()
def _wait(s: Any) -> None:
    """Wait for rest after a motion that was no pulse."""
    wait_for_rest(s)
    s.pending, s.outcome = 0, MOVING


@compiled()
def _ended(p: Any, s: Any, own: Any) -> None:
    """Update the model of the pulses by that of a move, and wait for rest."""
    explained = p.misfit[p.best] <= EXPLAINED * p.rows and (p.wild <= WILD or p.shakes == 0)
    if p.seen and explained and p.rows >= _LEARNED:
        before = law_of(own, p.backward)[1]
        teach(p, own.values, own.covariance)
        ratio = law_of(own, p.backward)[1] / before
        for each in range(2):
            F = law_of(own, each)[1]
            if own.held[each] == 0.0:
                own.breakaway[each] = max(own.breakaway[each] * ratio, F)
            own.breakaway[each] = min(max(own.breakaway[each], F), exact_learning.HIGHEST * F)
            i = COULOMB + each
            sure = exact_learning.HIGHEST * F * math.exp(_CERTAIN * math.sqrt(own.covariance[i, i]))
            own.moved_at[each] = min(own.moved_at[each], sure)
    if p.seen and p.rows >= _LEARNED and (explained or (p.known == 0 and at.certain(p))):
        p.known = 1 if p.known or at.certain(p) else 0
        p.delay, p.lag = at.delay_of(p.best), at.lag_of(p.best)
        s.delay, own.lag = p.delay + p.lag, p.lag * p.period
    if explained or own.taught == 0:
        own.by_moves[:] = own.values
    own.taught = max(own.taught, p.seen)
    if p.shakes >= SHAKES:
        _calm(p, own)
    exact_choice.lengthen_rest(s, own)
    if p.known:
        _hasten(p, s, own)
    _wait(s)


@compiled()
def _pause(p: Any, s: Any) -> None:
    """Wait, and then begin the pulses anew: a mass that swings on the axis spoils them."""
    p.pauses += 1
    wait_for_rest(s)
    s.wait = max(s.wait, math.ceil(p.pauses * _PAUSE / p.period))
    s.pending, s.idle, s.outcome = 0, 0, MOVING


@compiled()
def _leaves_again(p: Any, s: Any, x: float) -> bool:
    """Return whether the axis leaves its target of itself, as it did soon before, again and again.

    Counts how often it does.
    """
    if s.outcome != REACHED:
        return False
    p.stayed += 1
    if p.stayed > _STAYS and p.stayed * p.period > _STAYS_FOR:
        p.leavings = 0
    if not leaves(s, x):
        return False
    side = 1 if x > s.target else -1
    p.leavings = p.leavings + 1 if p.side == side else 1
    p.side, p.stayed = side, 0
    return p.leavings > RELEASES


@compiled()
def _react(p: Any, s: Any, own: Any, x: float) -> None:
    """Brake or hold an axis that moves where it should rest, or begin with the servo."""
    m, F = math.exp(own.values[0]), _sure_friction(own)
    leaves, falling = s.pending == 0 and _leaves_again(p, s, x), is_falling(p)
    runs = (s.pending == 0 and pushed(p, m, F, s.phase == RESTING)) or coasts(p, s.target)
    if not (runs or leaves):
        return
    p.undecided = p.by_pulse = p.waits = 0  # it rests no longer
    if runs and s.phase != RESTING and servo_allowed(p) and unexplained(p) and not falling:
        _calm(p, own)
        start_servo(p, own, s.target, x, (x - p.past[1]) / p.period)
        return
    if s.pending:  # a pulse that is braked is not learned from
        side = int(s.error < 0.0)
        own.share[side] = min(own.share[side] * _BRAKED, exact_learning.LARGEST_SHARE)
    p.held = max(p.held, RELEASES) if leaves else p.held
    if falling:
        start_holding_falling(p, m)
    elif runs and s.phase == RESTING and p.held == 0 and p.shaken == 0:
        start_holding(p, m, _mean_friction(own))
    elif ((p.held or p.brakings >= PUSHES) and p.swung == 0) or accelerates_against_effort(p):
        start_holding_moving(p, m)
    else:
        start_braking(p)
        p.unslowed = 1
    p.seen = p.wild = p.pauses = 0
    if s.phase == RESTING or p.held:  # the motion is not that of the last move or pulse
        p.moves, p.last_error = 0, math.inf


@compiled()
def _servo_continues(p: Any) -> bool:
    """Return whether the servo continues a move that has not ended at the target."""
    return p.rows >= _SERVO_ROWS and servo_allowed(p)


@compiled()
def _decide(p: Any, s: Any, own: Any, rested: bool) -> None:
    """Learn from a pulse once the axis rests, and go on once little swings on it.

    A pulse lets a mass behind a spring swing by up to its displacement. After pulses that have not
    helped the next one waits until that is less than the error.
    """
    p.swing *= math.exp(-1.0 / _SWINGS)
    if rested:
        p.undecided = 1
        if s.fresh:
            if not s.last.moved and exact_learning.freed_before(s, own):
                expect_noise(p.sensor)
            exact_learning.learn(s, own)
            p.swing, p.by_pulse = p.swing + abs(s.last.achieved), 1
            if p.known:
                _hasten(p, s, own)
    if not p.undecided or may_be_elsewhere(p):
        return
    if abs(s.position - s.rest) > s.least_motion + s.spread:  # it is elsewhere
        p.undecided = p.by_pulse = p.waits = 0
        wait_for_rest(s)
        return
    if s.outcome == MOVING and own.fruitless >= _FRUITLESS and p.swing > abs(s.error):
        p.waits = 1
        return
    if p.waits:
        exact_learning.forget_held(own)
    s.fresh = p.by_pulse
    p.undecided = p.by_pulse = p.waits = 0
    _rested(p, s, own)


@compiled()
def _rested(p: Any, s: Any, own: Any) -> None:
    """Begin a move or a pulse once the axis has come to rest."""
    if s.outcome == MOVING and p.held == 0 and p.brakings == 0:
        p.leavings = 0  # friction or bristles have stopped it
    p.brakings = p.held = p.turns = p.swung = p.one_way = p.undelayed = 0
    p.holds = 0 if s.outcome == REACHED else p.holds
    if s.outcome != MOVING:
        return
    unmoved = p.glitch == FROZEN or (p.unseen == 1 and abs(s.rest - p.start) <= s.least_motion)
    p.unseen = p.glitch = 0
    if unmoved:
        exact_choice.give_up(s, own, HELD_FAST)
    elif _moves(p, s, own, abs(s.error)):
        start_move(p, s.rest, s.target, own.values, own.covariance)
    elif _servo_continues(p) and p.held == 0:
        start_servo(p, own, s.target, s.rest, 0.0)
    else:
        exact_choice.plan(s, own)
        if s.phase != PULSING and own.reason != HELD_FAST and p.pauses < _PAUSES:
            _pause(p, s)


@compiled()
def _effort(p: Any, s: Any, own: Any, x: float, measured: bool) -> float:
    """Return the effort until the next sample of a move, a braking, a hold or the servo."""
    u, moved = 0.0, p.moving == MOVE
    if p.moving == SERVO:
        u = servo_effort(p, x) if measured else p.commands[0]
        if p.servo_failed:
            _wait(s)
        return u
    if p.moving == MOVE:
        u = go_on(p, x, measured)
        if measured and servo_allowed(p) and vibrates(p):
            _calm(p, own)
            start_servo(p, own, s.target, x, at.direction(p) * p.v)
            return servo_effort(p, x)
    m, moving = math.exp(own.values[0]), p.moving
    if moving == BRAKING:
        u = brake(p, m, _sure_friction(own), measured)
    elif moving == HOLDING:
        u = hold(p, m, _mean_friction(own), measured)
    if p.moving == 0:
        _ended(p, s, own)
        missed = moved and measured and p.glitch < 1 and abs(s.target - x) > s.tolerance
        if missed and _servo_continues(p):
            start_servo(p, own, s.target, x, (x - p.past[1]) / p.period)
            return servo_effort(p, x)
        if moving == HOLDING:  # a load moves it meanwhile
            s.wait = max(s.wait, math.ceil(letting_go(p)))
    return u


@compiled()
def _next(vector: Float[np.ndarray, " s"], sample: SensorSample) -> float:
    """Go on by a sample; return the effort until the next one."""
    inner = vector[SIZE:]
    p, s, own = own_fields(vector), head(inner), exact_state.own_fields(inner)
    x = sample.measured_position
    if p.begun == 0:
        p.begun, s.error = 1, s.target - x
        if _moves(p, s, own, abs(s.error)):
            start_move(p, x, s.target, own.values, own.covariance)
    remember(p, x)
    if p.moving == 0:
        _react(p, s, own, x)
        if p.moving == 0:
            _decide(p, s, own, watch(inner, sample))
    return emit(s) if p.moving == 0 else _effort(p, s, own, x, True)


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    if state.size < SIZE or own_fields(state).method != METHOD:
        raise ValueError("not a state of a PreciseController: begin with the one of its init()")
    vector = state.copy()
    if not readable(vector[SIZE:], EXACT, sample):
        return vector, np.nan
    u = _next(vector, sample)
    sent(own_fields(vector), u)
    return vector, u


@compiled()
def _next_blind(vector: Float[np.ndarray, " s"]) -> float:
    """Go on by a sample without a measurement; return the effort until the next one."""
    inner = vector[SIZE:]
    p = own_fields(vector)
    if p.moving == 0:
        after, u = blind_step(inner)
        inner[:] = after
        return u
    return _effort(p, head(inner), exact_state.own_fields(inner), 0.0, False)


@compiled()
def _blind(state: Float[np.ndarray, " s"]) -> tuple[Float[np.ndarray, " s"], float]:
    vector = state.copy()
    u = _next_blind(vector)
    sent(own_fields(vector), u)
    return vector, u


@dataclass(frozen=True, kw_only=True)
class PreciseController(PositionController[Float[np.ndarray, " s"]]):
    """Position a rigid axis: a fast move with feedback, then pulses.

    A distance for which a pulse would take longer is covered by a move from rest to rest: largest
    effort, then planned braking. The shortest duration of the first move grows with the uncertainty
    of friction: six samples if friction and delay are unknown. Mass, friction and delay are learned
    in the move (`stickslip.control.precise.learning`); feedback plans each sample with them. The
    pulses of an `ExactPulseController` begin with what it has learned, and correct what is left. An
    axis that is pushed from rest is held, and returns. One that moves whenever it is let go is
    under a load above friction: it is held for good, with the outcome ``STOPPED``. One that
    vibrates during a move is braked, and moves on with three times the effort of friction. At short
    sampling times the servo of a `ProfileController` positions it instead; if that fails, pulses
    follow. Where pulses have not halved the error, the next one waits for what may swing on the
    axis, by how far they moved it; where no pulse seems to help, it waits 0.3 s and then 0.6 s.

    The first move begins with the first sample, and assumes that the axis is at rest.

    Attributes
    ----------
    pulses
        The controller of the pulses; its guesses, limits, target and tolerance are those of the
        moves.
    delay
        Of drive and sensors together; None to learn it from the first move.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> from stickslip.control import RestDetection
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, static_friction=130.0,
    ...                                        viscous_friction=700.0)
    >>> guess = CoulombViscousFriction.symmetric(coulomb_friction=80.0, viscous_friction=500.0)
    >>> controller = PreciseController(pulses=ExactPulseController(
    ...     sampling_time=0.01, target=0.05, tolerance=1e-6, effort_limit=300.0, mass=150.0,
    ...     friction=guess, rest=RestDetection(samples=1, spread=0.0, speed=0.0)))
    >>> run = simulate_closed_loop(SingleMass(mass=150.0, friction=law), controller,
    ...                            sampling_time=0.01, samples=200)
    >>> controller.outcome(run.controller_state).value
    'reached'
    """

    pulses: ExactPulseController
    delay: float | None = quantity_field("time", default=None)
    unknown_spread: ClassVar[float] = _UNKNOWN

    def __post_init__(self) -> None:
        check_class("pulses", self.pulses, ExactPulseController)
        check_fields(self, non_negative, {"delay": "s"})
        longest = at.LONGEST_DELAY * self.sampling_time
        if self.delay is not None and self.delay > longest:
            interval = f"[0, {longest:g}]"
            raise InputError(
                "not_in_interval", name="delay", value=self.delay, interval=interval, usual=0.0
            )

    @staticmethod
    def unknown_friction(
        *, mass: float, effort_limit: float, distance: float
    ) -> CoulombViscousFriction:
        """Return a first guess of friction of which nothing is known.

        Its logarithm has the standard deviation ``unknown_spread`` (``friction_uncertainty`` of the
        pulses).

        Parameters
        ----------
        mass
            [kg or kg m^2].
        effort_limit
            [N or N m].
        distance
            Of the longest move [m or rad].
        """
        F = _UNKNOWN_SHARE * effort_limit
        v = math.sqrt(effort_limit * distance / mass)
        return CoulombViscousFriction.symmetric(
            coulomb_friction=F, viscous_friction=_UNKNOWN_VISCOUS * F / v
        )

    @property
    def sampling_time(self) -> float:
        """Of the loop [s]."""
        return self.pulses.sampling_time

    @property
    def target(self) -> float:
        """Where the axis is to rest [m or rad]."""
        return self.pulses.target

    @property
    def step(
        self,
    ) -> Callable[[Float[np.ndarray, " s"], SensorSample], tuple[Float[np.ndarray, " s"], float]]:
        """The pure step ``step(state, sample) -> (state, effort)``, a compiled kernel."""
        return _step

    @property
    def channels(self) -> tuple[str, ...]:
        """Those of the pulses."""
        return self.pulses.channels

    def blind(
        self,
        state: Float[np.ndarray, " s"],
        time: float,  # noqa: ARG002
    ) -> tuple[Float[np.ndarray, " s"], float]:
        """Go on with a move, as predicted, or with a pulse."""
        return _blind(state)

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        inner = self.pulses.init()
        state = np.concatenate([np.zeros(SIZE), inner])
        p, s = own_fields(state), head(state[SIZE:])
        p.method, p.length, p.period = METHOD, state.size, self.sampling_time
        p.limit = p.most = self.pulses.effort_limit
        p.bend = 0.5 * self.pulses.tolerance
        p.noise, p.most_moves, p.last_error = self.pulses.position_noise, _MOST_MOVES, math.inf
        if self.delay is None:
            p.known, p.delay = int(s.delay > 0), s.delay
        else:
            p.known, p.delay = 1, self.delay / self.sampling_time
            s.delay = p.delay
        servo, p.fast = servo_for(self.pulses, exact_state.own_fields(inner), self.delay)
        p.servo = profile_kernels.fields(servo)
        return state

    def retargeted(self, state: Float[np.ndarray, " s"], target: float) -> Float[np.ndarray, " s"]:
        """Return the state with another target [m or rad]; a move under way goes on to it."""
        inner = self.pulses.retargeted(state[SIZE:], target)
        vector = np.concatenate([state[:SIZE], inner])
        p = own_fields(vector)
        p.moves, p.last_error, p.wild, p.pauses, p.holds = 0, math.inf, 0, 0, 0
        p.leavings = p.unseen = p.undecided = p.by_pulse = p.waits = p.glitch = 0
        if p.loaded:  # let go, to see whether the load is still there
            p.loaded = p.held = p.brake_left = p.restarts = 0
        if p.moving == SERVO:
            retarget_servo(p, target)
        if p.moving == MOVE:
            p.way = (target - p.start) * (-1.0 if p.backward else 1.0)
            p.left, p.longest = 0, p.samples + p.longest
        return vector

    def outcome(self, state: Float[np.ndarray, " s"]) -> PositioningOutcome:
        """Return how far positioning has come."""
        p = own_fields(state)
        if p.moving == SERVO and profile_kernels.rests_at_target(p.servo):
            return PositioningOutcome.REACHED
        if p.moving:
            return PositioningOutcome.STOPPED if p.loaded else PositioningOutcome.MOVING
        return self.pulses.outcome(state[SIZE:])

    def why(self, state: Float[np.ndarray, " s"]) -> str | None:
        """Return why the controller has stopped short of the target; None if it has not."""
        p = own_fields(state)
        if p.moving:
            return LOADED if p.loaded else None
        return self.pulses.why(state[SIZE:])

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return mass and friction of either direction, offsets included [SI]."""
        return self.pulses.estimates(state[SIZE:])

    def learned_delay(self, state: Float[np.ndarray, " s"]) -> float | None:
        """Return the delay that is given or learned [s]; None while it is neither."""
        p = own_fields(state)
        return float(p.delay) * self.sampling_time if p.known else None

    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return what was learned, in the form of `ExactPulseController.learned`."""
        return self.pulses.learned(state[SIZE:])

    def resumed(self, learned: LearnedPulses) -> "PreciseController":
        """Return the same controller, beginning with what an earlier run has learned."""
        return replace(self, pulses=self.pulses.resumed(learned))

    def pulse_count(self, state: Float[np.ndarray, " s"]) -> int:
        """Return the number of pulses whose outcome is known."""
        return self.pulses.pulse_count(state[SIZE:])

    def last_pulse(self, state: Float[np.ndarray, " s"]) -> PulseRecord | None:
        """Return the last pulse whose outcome is known, or None."""
        return self.pulses.last_pulse(state[SIZE:])
