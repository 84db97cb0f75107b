"""What the source's concluding remarks say, each statement with a criterion and a verdict."""

from stickslip.presentation.words import prefixed
from stickslip.records import PositioningOutcome
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.conjunction.cases import BOUND
from studies.van_de_wijdeven.conjunction.landings import (
    FEEDBACK,
    RIGID,
    Landing,
    LandingEvidence,
)
from studies.van_de_wijdeven.conjunction.series import SeriesEvidence
from studies.van_de_wijdeven.conjunction.setting import MOVE, TARGETS
from studies.van_de_wijdeven.records import Claim, SuccessiveSeries

__all__ = ["conjunction_claims"]

_PLACE = "Concluding remarks"
_SAME = 1e-9  # of the move; an exact simulation rounds far below
_VICINITY = 0.05  # of the move
_FOUND = 0.01  # of the truth
_SURELY = 4.0  # standard deviations: two estimates, at several seeds
_IN_THREE = 1e-6  # of the move, what three series leave


def conjunction_claims(landings: LandingEvidence, series: SeriesEvidence) -> tuple[Claim, ...]:
    """Return the claims in the order of the remarks.

    Parameters
    ----------
    landings, series
        What was measured.
    """
    return (
        _rigid(landings),
        _pulses_for_precision(landings),
        _rest_to_rest(series),
        _knowledge_needed(series),
        _near_by_feedback(landings),
        _estimated_meanwhile(landings),
        _new_series(series),
        _new_target(landings),
        _synergy(landings),
    )


def _claim(
    statement: str,
    *,
    criterion: str,
    agrees: bool,
    measured: str,
    why: str,
    numbers: dict[str, float],
) -> Claim:
    return Claim(
        place=_PLACE,
        statement=statement,
        criterion=criterion,
        measured=measured.replace("-", "−"),
        agrees=agrees,
        why=why,
        numbers=numbers,
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"


def _length(value: float) -> str:
    return prefixed(value, "m")


def _rigid(landings: LandingEvidence) -> Claim:
    left = landings.rivals[RIGID]
    return _claim(
        "For systems more complex than a single mass, pulse width control is not useful any more.",
        criterion=f"PAPWC, which takes the arm for a rigid mass, leaves mass 2 swinging more than "
        f"{BOUND:g} of the move",
        agrees=left.swing > BOUND,
        measured=f"mass 1 ends within {_percent(left.error_1)} of the move, mass 2 swings by "
        f"{_percent(left.swing)} of it",
        why="Pulses calculated for mass 1 alone bring it to rest where it should be, but whatever "
        "they put into the spring stays in mass 2, which nothing damps while mass 1 sticks.",
        numbers={"error_1": left.error_1, "swing": left.swing},
    )


def _worst(landing: Landing) -> tuple[float, float]:
    errors, swings = zip(*(landing.left(k) for k in range(len(TARGETS))), strict=True)
    return max(map(abs, errors)), max(swings)


def _pulses_for_precision(landings: LandingEvidence) -> Claim:
    error, swing = _worst(landings.exact)
    bound = BOUND * MOVE
    return _claim(
        "The idea of using pulses for precise positioning is useful for a flexible arm as well.",
        criterion=f"without noise both masses end within {BOUND:g} of the move, there and back",
        agrees=error <= bound and swing <= bound,
        measured=f"mass 1 within {_length(error)}, mass 2 swings by at most {_length(swing)} "
        "about it, of 1 m",
        why="The last effort ends with both masses at rest and the spring relaxed, so that mass 1 "
        "sticks and nothing is left to move mass 2.",
        numbers={"error_m": error, "swing_m": swing},
    )


def _rest_to_rest(series: SeriesEvidence) -> Claim:
    residual = max(each.numbers.residual for each in series.planned)
    late = max(
        abs(each.numbers.duration - each.numbers.expected_duration) for each in series.planned
    )
    return _claim(
        "Multiple pulses move a flexible arm under Coulomb and viscous friction from rest to rest.",
        criterion=f"each series planned for the reference points leaves less than {_SAME:g} of "
        "the move in the exact simulation",
        agrees=residual < _SAME * MOVE,
        measured=f"{len(series.planned)} series leave at most {residual:.1e} m, in the shortest "
        f"durations that are known (largest difference {late:.0e} s)",
        why="While mass 1 moves one way its friction is a constant force, so that the arm is "
        "linear, and the four states at the end are four linear equations for the pulses.",
        numbers={"residual_m": residual, "duration_difference_s": late},
    )


def _knowledge_needed(series: SeriesEvidence) -> Claim:
    every = {each.friction_error: each for each in series.effects}
    numbers = {
        f"{name}_{share:+.2f}_m": value
        for share, each in every.items()
        for name, value in (("error", each.error), ("swing", each.swing))
    }
    worst = {
        size: max(abs(every[sign * size].error) for sign in (1.0, -1.0)) for size in (0.01, 0.05)
    }
    return _claim(
        "To calculate the series, knowledge of the friction parameters is needed.",
        criterion=f"a Coulomb friction 1 % off leaves more than {BOUND:g} of the move",
        agrees=worst[0.01] > BOUND * MOVE,
        measured=f"1 % leaves up to {_percent(worst[0.01] / MOVE)} of the move, 5 % up to "
        f"{_percent(worst[0.05] / MOVE)}",
        why="A friction that is wrong is a force that acts on both masses for the whole duration. "
        "It depends on that duration, and not on the pulses nor on how short the move is.",
        numbers=numbers,
    )


def _near_by_feedback(landings: LandingEvidence) -> Claim:
    errors = landings.feedback_errors
    return _claim(
        "A simple feedback controller moves the system to the vicinity of the desired position.",
        criterion=f"feedback alone, sent to the target, leaves mass 1 within {_percent(_VICINITY)} "
        "of the move",
        agrees=max(errors) <= _VICINITY * MOVE,
        measured=f"at most {_percent(max(errors) / MOVE)} of the move off, without and with noise",
        why="With its friction compensated, mass 1 follows a smooth reference, until it sticks "
        "where the effort no longer frees it. Mass 2 swings on. In a landing feedback is sent to a "
        "place short of the target, as a series needs a way longer than the swing that it stills.",
        numbers={"error_m": max(errors)},
    )


def _estimated_meanwhile(landings: LandingEvidence) -> Claim:
    shares: list[float] = []
    spreads: list[float] = []
    for landing in (landings.exact, landings.noisy):
        found = landing.at(landing.of_move(0)[1].start)
        errors = (
            found.coulomb - surrogate.COULOMB_FRICTION,
            found.viscous - surrogate.VISCOUS_FRICTION,
        )
        shares += [
            abs(error) / truth
            for error, truth in zip(
                errors, (surrogate.COULOMB_FRICTION, surrogate.VISCOUS_FRICTION), strict=True
            )
        ]
        if landing is landings.noisy:
            stds = (found.coulomb_std, found.viscous_std)
            spreads = [abs(error) / std for error, std in zip(errors, stds, strict=True)]
    return _claim(
        "The energy-based algorithm estimates the friction while the feedback moves the system.",
        criterion=f"when the first feedback ends, both are within {_percent(_FOUND)} of the truth, "
        f"and with noise within {_SURELY:g} of their standard deviations",
        agrees=max(shares) <= _FOUND and max(spreads) <= _SURELY,
        measured=f"without noise off by {shares[0]:.1g} (Coulomb) and {shares[1]:.1g} (viscous) of "
        f"the truth; with noise by {_percent(shares[2])} and {_percent(shares[3])}, "
        f"{spreads[0]:.1f} and {spreads[1]:.1f} standard deviations",
        why="It began with no friction at all. It needs no more than that the mass moves.",
        numbers={
            "coulomb_exact": shares[0],
            "viscous_exact": shares[1],
            "coulomb_noisy": shares[2],
            "viscous_noisy": shares[3],
            "coulomb_standard_deviations": spreads[0],
            "viscous_standard_deviations": spreads[1],
        },
    )


def _new_series(series: SeriesEvidence) -> Claim:
    learning = [each for each in series.successive if each.learning]
    stays = [each for each in series.successive if not each.learning and each.friction_error > 0]

    def left(each: SuccessiveSeries, k: int) -> float:
        return float(max(abs(each.error[k]), each.swing[k]))

    falls = [
        left(each, k) / left(each, k + 1) for each in learning for k in range(each.error.size - 1)
    ]
    last = max(left(each, -1) for each in learning)
    kept = max(left(each, -1) for each in stays)
    count = learning[0].error.size
    return _claim(
        "If the error is too large, a new series drives the system closer to the desired position.",
        criterion="with an estimator that learns from each series, from a Coulomb friction first "
        f"believed up to 5 % wrong, each leaves less than the one before, and three leave at most "
        f"{_IN_THREE:g} of the move",
        agrees=min(falls) > 1.0 and last <= _IN_THREE * MOVE,
        measured=f"each at least {min(falls):.3g} times less; after {count} series "
        f"{last / MOVE:.1e} of the move. With a belief that stays too large, "
        f"{_percent(kept / MOVE)} are left after as many",
        why="Each series is a motion of its own, from which friction is learned. Without that, "
        "and with a friction lower than believed, a new series repeats the error of the old one: "
        "what wrong friction leaves depends on the duration, not on the way.",
        numbers={"least_fall": min(falls), "last_m": last, "last_without_learning_m": kept},
    )


def _new_target(landings: LandingEvidence) -> Claim:
    both = (landings.exact, landings.noisy)
    begins = [landing.of_move(1)[0].name for landing in both]
    noisy = landings.noisy
    first, second = (
        noisy.at(noisy.of_move(move)[-1].start).coulomb_std for move in range(len(TARGETS))
    )
    landed = all(landing.outcomes[1] is PositioningOutcome.REACHED for landing in both)
    return _claim(
        "With a new desired position, feedback takes over again and the estimation continues.",
        criterion="the second move begins with feedback and lands, and the standard deviation of "
        "the Coulomb friction is smaller after it than after the first",
        agrees=set(begins) == {"feedback"} and landed and second < first,
        measured=f"begins with {begins[0]}; both land; standard deviation {1e6 * first:.3g} µN "
        f"after the first move, {1e6 * second:.3g} µN after the second",
        why="The state of the estimator is handed from phase to phase and from move to move.",
        numbers={"first_std_N": first, "second_std_N": second},
    )


def _synergy(landings: LandingEvidence) -> Claim:
    alone = landings.rivals[FEEDBACK]
    error, swing = _worst(landings.exact)
    both = max(abs(error), swing) / MOVE
    without = max(alone.error_1, alone.error_2)
    return _claim(
        "Pulse control and energy-based estimation of friction work together.",
        criterion=f"together they land the arm within {BOUND:g} of the move, where the same "
        "feedback alone does not",
        agrees=both <= BOUND < without,
        measured=f"{both:.1e} of the move, against {_percent(without)} by feedback alone",
        why="Feedback alone stops short where friction holds mass 1, and leaves mass 2 swinging; "
        "pulses alone would not know the friction.",
        numbers={"together": both, "feedback_alone": without},
    )
