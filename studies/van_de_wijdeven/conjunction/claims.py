"""Claims of the source's concluding remarks, judged by measurements."""

from typing import NamedTuple

import numpy as np

from stickslip.records import PositioningOutcome
from stickslip.tasks import surrogate
from studies.van_de_wijdeven import judging
from studies.van_de_wijdeven.conjunction.cases import BOUND
from studies.van_de_wijdeven.conjunction.landings import FEEDBACK, RIGID, Landing, LandingEvidence
from studies.van_de_wijdeven.conjunction.series import SeriesEvidence
from studies.van_de_wijdeven.conjunction.setting import MOVE, TARGETS
from studies.van_de_wijdeven.records import SuccessiveSeries

_PLACE = "Concluding remarks"
_MORE = 1.0 + 1e-9  # ratio from which a value is larger than another


class Evidence(NamedTuple):
    """Measurements."""

    landings: LandingEvidence
    series: SeriesEvidence


Quantity = judging.Quantity[Evidence]
Row = judging.Row[Evidence]


def _worst(landing: Landing) -> tuple[float, float]:
    """Return the largest error of mass 1 and swing of mass 2 in the end, over the move."""
    errors, swings = zip(*(landing.left(k) for k in range(len(TARGETS))), strict=True)
    return max(map(abs, errors)) / MOVE, max(swings) / MOVE


def _left_by(evidence: Evidence, friction_error: float) -> float:
    """Return what a series leaves with a Coulomb friction off by a share, over the move."""
    return (
        max(
            abs(each.error)
            for each in evidence.series.effects
            if abs(each.friction_error) == friction_error
        )
        / MOVE
    )


def _first_estimates(landing: Landing) -> tuple[np.ndarray, np.ndarray]:
    """Return errors and standard deviations of the friction when the first feedback ends."""
    found = landing.at(landing.of_move(0)[1].start)
    truth = np.array([surrogate.COULOMB_FRICTION, surrogate.VISCOUS_FRICTION])
    errors = np.abs(np.array([found.coulomb, found.viscous]) - truth)
    return errors / truth, errors / np.array([found.coulomb_std, found.viscous_std])


def _left(each: SuccessiveSeries, k: int) -> float:
    return float(max(abs(each.error[k]), each.swing[k]))


def _least_fall(evidence: Evidence) -> float:
    """Return the least reduction by a series, where the estimator learns from each."""
    return min(
        _left(each, k) / _left(each, k + 1)
        for each in evidence.series.successive
        if each.learning
        for k in range(each.error.size - 1)
    )


def _last(evidence: Evidence, *, learning: bool) -> float:
    """Return what the last series leaves, over the move; with a first guess too large without."""
    return (
        max(
            _left(each, -1)
            for each in evidence.series.successive
            if each.learning == learning and (learning or each.friction_error > 0)
        )
        / MOVE
    )


def _with_feedback(evidence: Evidence) -> int:
    both = (evidence.landings.exact, evidence.landings.noisy)
    return sum(landing.of_move(1)[0].name == "feedback" for landing in both)


def _landed(evidence: Evidence) -> int:
    both = (evidence.landings.exact, evidence.landings.noisy)
    return sum(landing.outcomes[1] is PositioningOutcome.REACHED for landing in both)


def _std_ratio(evidence: Evidence) -> float:
    """Return the standard deviation of the friction after the first move, over that after both."""
    noisy = evidence.landings.noisy
    first, second = (
        noisy.at(noisy.of_move(move)[-1].start).coulomb_std for move in range(len(TARGETS))
    )
    return first / second


def _alone(evidence: Evidence) -> float:
    alone = evidence.landings.rivals[FEEDBACK]
    return max(alone.error_1, alone.error_2)


CONJUNCTION_CLAIMS = (
    Row(
        "rigid mass",
        _PLACE,
        "For systems more complex than a single mass, pulse width control is not useful any more.",
        "Pulses calculated for mass 1 alone bring it to rest where it should be, but the energy "
        "in the spring stays in mass 2, which nothing damps while mass 1 sticks.",
        Quantity(
            "swing of mass 2 left by PAPWC, over the move",
            "1",
            lambda e: e.landings.rivals[RIGID].swing,
            low=BOUND,
        ),
        Quantity("error of mass 1, over the move", "1", lambda e: e.landings.rivals[RIGID].error_1),
    ),
    Row(
        "precise positioning",
        _PLACE,
        "The idea of using pulses for precise positioning is useful for a flexible arm as well.",
        "The last effort ends with both masses at rest and the spring relaxed, so that mass 1 "
        "sticks and nothing is left to move mass 2.",
        Quantity(
            "largest error of mass 1 without noise, over the move",
            "1",
            lambda e: _worst(e.landings.exact)[0],
            high=BOUND,
        ),
        Quantity(
            "largest swing of mass 2, over the move",
            "1",
            lambda e: _worst(e.landings.exact)[1],
            high=BOUND,
        ),
    ),
    Row(
        "rest to rest",
        _PLACE,
        "Multiple pulses move a flexible arm under Coulomb and viscous friction from rest to rest.",
        "While mass 1 moves one way its friction is a constant force, so that the arm is linear, "
        "and the four states at the end are four linear equations for the pulses.",
        Quantity(
            "largest residual of the planned series in the exact simulation, over the move",
            "1",
            lambda e: max(each.numbers.residual for each in e.series.planned) / MOVE,
            high=1e-9,
        ),
        Quantity(
            "largest difference to the shortest durations that are known",
            "s",
            lambda e: max(
                abs(each.numbers.duration - each.numbers.expected_duration)
                for each in e.series.planned
            ),
        ),
    ),
    Row(
        "knowledge of the friction",
        _PLACE,
        "To calculate the series, knowledge of the friction parameters is needed.",
        "A friction that is wrong is a force that acts on both masses for the whole duration. Its "
        "effect depends on that duration, and not on the pulses nor on how short the move is.",
        Quantity(
            "error left with a Coulomb friction 1 % off, over the move",
            "1",
            lambda e: _left_by(e, 0.01),
            low=BOUND,
        ),
        Quantity("the same with 5 %", "1", lambda e: _left_by(e, 0.05)),
    ),
    Row(
        "vicinity by feedback",
        _PLACE,
        "A simple feedback controller moves the system to the vicinity of the desired position.",
        "With its friction compensated, mass 1 follows a smooth reference, until it sticks where "
        "the effort no longer frees it. Mass 2 swings on. In a landing feedback moves to a place "
        "short of the target, as a series needs a travel longer than the swing that it ends.",
        Quantity(
            "largest error of mass 1 with feedback alone, over the move",
            "1",
            lambda e: max(e.landings.feedback_errors) / MOVE,
            high=0.05,
        ),
    ),
    Row(
        "estimated meanwhile",
        _PLACE,
        "The energy-based algorithm estimates the friction while the feedback moves the system.",
        "It begins without a first guess. It needs no more than that the mass moves.",
        Quantity(
            "larger relative error when the first feedback ends, without noise",
            "1",
            lambda e: float(np.max(_first_estimates(e.landings.exact)[0])),
            high=0.01,
        ),
        Quantity(
            "the same with noise",
            "1",
            lambda e: float(np.max(_first_estimates(e.landings.noisy)[0])),
            high=0.01,
        ),
        Quantity(
            "the same with noise",
            "standard deviations",
            lambda e: float(np.max(_first_estimates(e.landings.noisy)[1])),
            high=4.0,
        ),
    ),
    Row(
        "new series",
        _PLACE,
        "If the error is too large, a new series drives the system closer to the desired position.",
        "Each series is a motion of its own, from which friction is learned. Without that, and "
        "with a friction lower than assumed, a new series repeats the error of the old one: what "
        "wrong friction leaves depends on the duration, not on the travel.",
        Quantity("least reduction by a series", "1", _least_fall, low=_MORE),
        Quantity(
            "left by three series with an estimator that learns from each, over the move",
            "1",
            lambda e: _last(e, learning=True),
            high=1e-6,
        ),
        Quantity(
            "left by as many with a friction that stays too large, over the move",
            "1",
            lambda e: _last(e, learning=False),
        ),
    ),
    Row(
        "new target",
        _PLACE,
        "With a new desired position, feedback takes over again and the estimation continues.",
        "The state of the estimator is handed from phase to phase and from move to move.",
        Quantity("second moves that begin with feedback, of two", "moves", _with_feedback, low=2.0),
        Quantity("second moves that land, of two", "moves", _landed, low=2.0),
        Quantity(
            "standard deviation of the Coulomb friction after the first move, over the second",
            "1",
            _std_ratio,
            low=_MORE,
        ),
    ),
    Row(
        "synergy",
        _PLACE,
        "Pulse control and energy-based estimation of friction work together.",
        "Feedback alone stops short where friction holds mass 1, and leaves mass 2 swinging; "
        "pulses alone need the friction.",
        Quantity(
            "larger of error and swing together, over the move",
            "1",
            lambda e: max(_worst(e.landings.exact)),
            high=BOUND,
        ),
        Quantity("error of feedback alone, over the move", "1", _alone, low=BOUND * _MORE),
    ),
)
