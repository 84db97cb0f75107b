"""What sections 2 and 3.1 claim of a single pulse, judged by formulas and by simulation."""

import math
from dataclasses import replace

import numpy as np

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw
from stickslip.plants import SingleMass
from stickslip.simulation import simulate
from studies.van_de_wijdeven.part_b.judging import by_reading, judged, lengths, percent, ratios
from studies.van_de_wijdeven.part_b.numbers import FAR, NEAR, width_by_gain
from studies.van_de_wijdeven.part_b.setting import (
    COULOMB_FRICTION,
    LONGEST_PULSE,
    MASS,
    PULSE_EFFORT,
    SAMPLING_TIME,
    report_plant,
)
from studies.van_de_wijdeven.records import Claim

__all__ = ["law_claims"]

_SAME = 1e-9  # relative; of formulas and an exact simulation, whose rounding is far below
_WIDTHS = (1, 3, 9)  # samples
_COAST = 1.0  # after a pulse, long enough to come to rest [s]
_REASONABLE = 0.1  # error of an approximation that counts as reasonable, of the displacement
_WRONG = 0.2  # error from which it does not any more
_PULSES = 200
_CONVERGED = 1e-3  # of the first error
_UNKNOWN = 0.45  # b_hat/b for which K_c = 1 is beyond the limit
_STEADY, _TOO_MUCH = 1.9, 2.1  # K_c on either side of it


def law_claims(law: PulseLaw) -> tuple[Claim, ...]:
    """Return the claims on what a pulse does, with their verdicts.

    Parameters
    ----------
    law
        Of a pulse on the mass of Table 1.
    """
    return (
        _closed_forms(),
        _small_displacements(law),
        _stable_gains(law),
        _large_displacements(law),
        _range_of_gain(law),
        _depends_on_parameters(law),
        _longer_width(law),
    )


def _simulated(plant: SingleMass, samples: int, direction: float) -> float:
    """Return the displacement of a pulse of whole samples, from the event-driven simulation [m]."""
    effort = np.zeros(samples + round(_COAST / SAMPLING_TIME))
    effort[:samples] = direction * PULSE_EFFORT
    motion = simulate(plant, effort, sampling_time=SAMPLING_TIME)
    return float(motion.position[-1])


def _closed_forms() -> Claim:
    without = SingleMass(
        mass=MASS,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=COULOMB_FRICTION,
            viscous_friction=0.0,
            static_friction=report_plant().friction.static_friction_positive,
        ),
    )

    def worst(plant: SingleMass) -> float:
        formula = PulseLaw.of(plant)
        return max(
            abs(
                _simulated(plant, n, direction)
                / (direction * float(formula.displacement(PULSE_EFFORT, n * SAMPLING_TIME)))
                - 1.0
            )
            for n in _WIDTHS
            for direction in (1.0, -1.0)
        )

    with_viscous, without_viscous = worst(report_plant()), worst(without)
    return judged(
        place="2.1, Eqs. 2, 3",
        statement="The displacement of a single pulse is that of Eq. 3, and without viscous "
        "friction that of Eqs. 2 and 4, in the direction of the pulse.",
        criterion=f"the simulated one is the same within {_SAME:g} of itself, for pulses of "
        f"{', '.join(map(str, _WIDTHS))} samples in either direction",
        found=(
            max(with_viscous, without_viscous) <= _SAME,
            f"largest difference {with_viscous:.1e} with viscous friction, {without_viscous:.1e} "
            "without",
        ),
        why="Both are the balance of momentum up to the rest. They hold where the effort exceeds "
        "the static friction; below it nothing moves.",
        numbers={"with_viscous": with_viscous, "without_viscous": without_viscous},
    )


def _small_displacements(law: PulseLaw) -> Claim:
    widths = {"one sample": SAMPLING_TIME, "three samples": LONGEST_PULSE}
    b = law.gain(PULSE_EFFORT)
    error = {
        name: b * T**2 / float(law.displacement(PULSE_EFFORT, T)) - 1.0
        for name, T in widths.items()
    }
    return judged(
        place="2.1",
        statement="For small displacements viscous friction can be neglected against Coulomb "
        "friction: Eq. 2 is a reasonable approximation.",
        criterion=f"for the smallest pulse, one sample, it is within {100 * _REASONABLE:g} %",
        found=(
            error["one sample"] <= _REASONABLE,
            f"{percent(error['one sample'])} too far for one sample, "
            f"{percent(error['three samples'])} for three",
        ),
        why="What viscous friction takes away grows with c t_p/m, which is "
        f"{law.viscous_friction * SAMPLING_TIME / law.mass:.2g} for one sample; above three "
        "samples it is no longer small.",
        numbers={
            "one_sample": error["one sample"],
            "three_samples": error["three samples"],
        },
    )


def _left(law: PulseLaw, loop_gain: float, estimate: float) -> float:
    """Return what is left of an error after many pulses of unrounded widths (Eq. 10), over it."""
    b = estimate * law.gain(PULSE_EFFORT)
    first = error = 1e-3
    for _ in range(_PULSES):
        width = math.sqrt(loop_gain * abs(error) / b)
        error -= math.copysign(float(law.displacement(PULSE_EFFORT, width)), error)
    return abs(error) / first


def _stable_gains(law: PulseLaw) -> Claim:
    steady, too_much = _left(law, _STEADY, 1.0), _left(law, _TOO_MUCH, 1.0)
    guessed = _left(law, 1.0, _UNKNOWN)
    known = steady <= _CONVERGED < too_much
    return by_reading(
        place="2.2, Eq. 9",
        statement="The loop is stable for 0 < K_c < 2.",
        criterion=f"within {_PULSES} pulses of unrounded widths an error of 1 mm falls to "
        f"{_CONVERGED:g} of itself with a K_c below 2, and does not with one above",
        found={
            "b̂ = b": (
                known,
                f"{steady:.1e} left with K_c = {_STEADY:g}, {too_much:.2g} with {_TOO_MUCH:g}",
            ),
            f"b̂ = {_UNKNOWN:g} b": (
                guessed <= _CONVERGED,
                f"{guessed:.2g} left with K_c = 1",
            ),
        },
        why="The next error is (1 − K_c b/b̂) of this one, so that the condition is 0 < K_c b/b̂ < "
        "2: a b̂ below half of b makes even K_c = 1 unstable. Rounding widths up to samples adds "
        "a limit cycle that no K_c removes.",
        numbers={"steady": steady, "too_much": too_much, "guessed": guessed},
    )


def _large_displacements(law: PulseLaw) -> Claim:
    b = law.gain(PULSE_EFFORT)
    short, exact = width_by_gain(FAR, b), float(law.width_for(FAR, effort=PULSE_EFFORT))
    reached = float(law.displacement(PULSE_EFFORT, short))
    return judged(
        place="2.2, 3.1",
        statement="When the required displacement increases, the approximation is not accurate any "
        "more: 10 mm take 0.092 s, not 0.070 s.",
        criterion=f"the pulse of Eq. 4 falls short of 10 mm by more than {100 * _WRONG:g} %",
        found=(
            1.0 - reached / FAR > _WRONG,
            f"{short:.4f} s by Eq. 4 and {exact:.4f} s by Eq. 3; the shorter pulse goes "
            f"{lengths([reached])}",
        ),
        why="At its end the mass moves so fast that viscous friction is no longer small against "
        "Coulomb friction.",
        numbers={"short_s": short, "exact_s": exact, "reached_m": reached},
    )


def _fitted(law: PulseLaw, width: float) -> float:
    """Return the b_hat/b with which Eq. 4 meets Eq. 3 at this width."""
    return float(law.displacement(PULSE_EFFORT, width)) / (law.gain(PULSE_EFFORT) * width**2)


def _range_of_gain(law: PulseLaw) -> Claim:
    widths = np.linspace(1e-4, LONGEST_PULSE, 300)
    found = [_fitted(law, float(width)) for width in widths]
    lowest, highest = min(found), max(found)
    return judged(
        place="3.1",
        statement="With t_p,max = 0.03 s, b̂ is between 81 % and 100 % of b.",
        criterion="the b̂ with which Eq. 4 meets Eq. 3 is between 0.81 b (to its two digits) and b "
        "for every width up to 0.03 s",
        found=(
            0.805 <= lowest < 0.815 and highest <= 1.0,
            f"{percent(lowest)} to {percent(highest)}",
        ),
        why="The wider the pulse, the more viscous friction takes away. It is the range of what "
        "one pulse teaches; b̂ itself comes down from the first guess, 1.375 b, and takes several "
        "runs for it in all readings but P(0) = 1e5 I.",
        numbers={"lowest": lowest, "highest": highest},
    )


def _depends_on_parameters(law: PulseLaw) -> Claim:
    here = _fitted(law, LONGEST_PULSE)
    half = _fitted(replace(law, viscous_friction=0.5 * law.viscous_friction), LONGEST_PULSE)
    return judged(
        place="3.1",
        statement="The lower percentage is a function of the parameters of the system.",
        criterion="it moves with the viscous friction",
        found=(half != here, f"{percent(here)} with c of Table 1, {percent(half)} with half of it"),
        why="It depends on c t_p/m and f_p/f_c.",
        numbers={"here": here, "half": half},
    )


def _longer_width(law: PulseLaw) -> Claim:
    fitted = FAR / float(law.width_for(FAR, effort=PULSE_EFFORT)) ** 2
    long, right = width_by_gain(NEAR, fitted), float(law.width_for(NEAR, effort=PULSE_EFFORT))
    reached = float(law.displacement(PULSE_EFFORT, long))
    return judged(
        place="3.1",
        statement="With the b̂ of 10 mm, a residual error of 2.0 mm is overshot: 41 ms instead of "
        "36 ms, 2.5 mm instead of 2.0 mm.",
        criterion="the pulse goes too far, by 0.4 to 0.6 mm",
        found=(
            0.4e-3 <= reached - NEAR <= 0.6e-3,
            f"{1e3 * long:.1f} ms instead of {1e3 * right:.1f} ms, {lengths([reached])}",
        ),
        why=f"b̂ = {ratios([fitted / law.gain(PULSE_EFFORT)])} b has viscous friction of a long "
        "pulse in it, of which a short one has less.",
        numbers={"long_s": long, "right_s": right, "reached_m": reached},
    )
