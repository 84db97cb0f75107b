"""Why there is no pulse series: which limit binds, and what would help."""

import math
from dataclasses import replace
from typing import Literal

from stickslip.planning.series.move import FEWEST_PULSES, Move
from stickslip.planning.series.pulse_series import NoPulseSeriesError, SeriesLimit
from stickslip.planning.series.search import solve
from stickslip.records import AxisKind, count_of, unit_of

__all__ = ["refusal"]

_STRONGER = 128.0  # times the effort limit: no more is tried
_WORK = 2e4  # of each trial here, as of `Programme.solve`: the limit is guessed, not proven
_STRONGER_TO = 1.05  # so exactly the effort that would do is said


def refusal(move: Move, pulses: int, *, at_most: bool, kind: AxisKind) -> NoPulseSeriesError:
    """Return the error that says which limit, lifted alone, would allow a series.

    Parameters
    ----------
    move
        What was asked for.
    pulses
        How many.
    at_most
        Whether fewer would have done.
    kind
        Of the axis.
    """
    effort = unit_of("effort", kind)
    asked = (
        f"no series of {'at most ' if at_most else ''}{count_of(pulses, 'pulse')} "
        f"({pulses * move.pulse_width:g} s) brings both masses to rest "
        f"{move.way:g} {unit_of('position', kind)} away"
    )
    if pulses < FEWEST_PULSES:
        limit, why = SeriesLimit.PULSES, "four states are to be met"
    elif not move.frees:
        limit = SeriesLimit.BREAKAWAY
        why = (
            f"it takes more than {move.breakaway:.6g} {effort} to free mass 1, and the limit is "
            f"{move.effort_limit:g} {effort}"
        )
    elif move.fewest == 0:
        limit = SeriesLimit.DIRECTION
        why = "mass 2 swings farther than mass 1 may move, which would have to turn back"
    elif (enough := _enough_effort(move, pulses)) is not None:
        limit = SeriesLimit.EFFORT
        why = (
            f"it would take efforts of up to {enough:.3g} {effort}, and the limit is "
            f"{move.effort_limit:g} {effort}"
        )
    elif move.frees_too_far or _possible_without("breakaway", move, pulses):
        limit = SeriesLimit.BREAKAWAY
        why = (
            f"the first effort must exceed {move.breakaway:.6g} {effort} to free mass 1, which is "
            "too much for this move"
        )
    elif _possible_without("direction", move, pulses):
        limit, why = SeriesLimit.DIRECTION, "mass 1 would have to stop or turn back on the way"
    else:
        limit, why = SeriesLimit.TOGETHER, "several limits bind at once"
    remedy = limit.text
    if not at_most and limit not in (SeriesLimit.PULSES,) and move.frees:
        search = move.shortest()
        if search.solution is not None and search.pulses != pulses:
            enough = f"{search.pulses} pulses ({search.pulses * move.pulse_width:g} s)"
            remedy = f"{enough} are enough; or {remedy}"
    return NoPulseSeriesError(f"{asked}: {why}", limit=limit, remedy=remedy)


def _enough_effort(move: Move, pulses: int) -> float | None:
    """Return about the least effort limit with which there is a series, None if there is none."""

    def does(times: float) -> bool:
        return (
            replace(move, effort_limit=times * move.effort_limit).solved(pulses, work=_WORK)
            is not None
        )

    if not does(_STRONGER):
        return None
    low, high = 1.0, 2.0
    while high < _STRONGER and not does(high):
        low, high = high, 2.0 * high
    while high > _STRONGER_TO * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if does(middle) else (middle, high)
    return high * move.effort_limit


def _possible_without(limit: Literal["breakaway", "direction"], move: Move, pulses: int) -> bool:
    programme = move.programme(pulses)
    if limit == "breakaway":
        lowest = programme.lowest.copy()
        lowest[0] = lowest[1]
        programme = replace(programme, lowest=lowest)
    else:
        fastest = move.effort_limit * pulses * move.pulse_width / move.arm.mass_1
        programme = replace(programme, least_velocity=-10.0 * fastest)
    return solve(programme, gap=1.0, work=_WORK).effort is not None
