"""Which series of pulses comes next in a landing."""

from dataclasses import replace

from stickslip.control.landing.swing import Swing
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw, PulseSeries, PulseSeriesPlanner
from stickslip.plants import FlexibleArm
from stickslip.records import InputError, StickslipError

__all__ = ["next_series"]

_DIRECT = 0.8  # of the way left: a swing below it can be taken up on the way
_BEYOND = (1.5, 3.0)  # of the way left and the swing, to a place to come back from
_SMALLEST = 4.0  # smallest steps there at least
_EXCESS, _GAP = 0.1, 0.3  # over the shortest time and the least impulse: found with little work


def next_series(
    arm: FlexibleArm,
    swing: Swing,
    target: float,
    *,
    coulomb_friction: float,
    viscous_friction: float,
    static_friction: float,
    sampling_time: float,
    effort_limit: float,
) -> PulseSeries | str:
    """Return the series to fire, or why there is none.

    Mass 1 moves one way only, so that a series of way d takes up a swing of amplitude A < d at
    most: mass 2 is driven by the spring as x1 moves from 0 to d, and the component at its frequency
    of a velocity that never turns is at most that way. Otherwise, and where the way is too short
    for a pulse that frees mass 1, mass 1 is first taken to a place beyond, from where another
    series comes back without a swing to take up.

    Parameters
    ----------
    arm
        Masses and spring as they are believed to be; of its friction only the offset counts.
    swing
        What the arm does while mass 1 rests.
    target
        Of the landing [m or rad].
    coulomb_friction, viscous_friction, static_friction
        As estimated [N or N m, N s/m or N m s/rad, N or N m].
    sampling_time
        [s].
    effort_limit
        [N or N m].
    """
    error, amplitude = target - swing.position, swing.amplitude
    way = 1.0 if error > 0.0 else -1.0
    try:
        friction = CoulombViscousFriction.symmetric(
            coulomb_friction=coulomb_friction,
            viscous_friction=viscous_friction,
            static_friction=static_friction,
            offset=arm.friction.offset,
        )
        planner = PulseSeriesPlanner(
            arm=replace(arm, friction=friction),
            sampling_time=sampling_time,
            effort_limit=effort_limit,
            excess=_EXCESS,
            impulse_gap=_GAP,
            rest_on_the_way=True,
        )
        alone = PulseLaw(
            mass=arm.mass_1,
            coulomb_friction=coulomb_friction,
            viscous_friction=viscous_friction,
            static_friction=static_friction,
            kind=arm.kind,
        )
    except InputError as refusal:  # what is estimated may be no arm that could rest
        return str(refusal)
    least = max(
        abs(error) + amplitude, _SMALLEST * float(alone.smallest_displacement(sampling_time))
    )
    places = [target] if amplitude < _DIRECT * abs(error) else []
    places += [swing.position + side * share * least for share in _BEYOND for side in (way, -way)]
    why = ""
    for place in places:
        try:
            return planner.plan(swing.state(), place)
        except StickslipError as refusal:
            why = why or str(refusal)
    return why
