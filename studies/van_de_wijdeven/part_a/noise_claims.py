"""What the source claims of noise in chapter 5, judged by measurements."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.effects import NoiseEffects
from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.noise_compensation import (
    kinetic_energy_bias,
    potential_energy_bias,
    viscous_regressor_bias,
)
from studies.van_de_wijdeven.part_a.runs import Loop
from studies.van_de_wijdeven.records import Claim

__all__ = ["noise_claims"]

_CONFIDENCE = 0.999  # of a mean over runs, so that a true expectation is hardly ever refused
_SPREADS = 3.5  # standard errors of a mean of very many draws that pass as chance
_FITTED = 0.02  # error of a good polynomial [sigma]
_REMOVED = 0.05  # of what noise adds, left by a good compensation [sigma]
_DOMINANT = 10.0  # times as much noise at rest as in motion
_ORDER = 3.0  # factor up to which something is of the order of another

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

_BY_CHANCE = f"as chance lets it be in {100 * _CONFIDENCE:g} % of all cases"


def noise_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims of chapter 5 with their verdicts."""
    open_loop, closed = (evidence.study.effects[loop] for loop in ("feedforward", "feedback"))
    return (
        input_energy("feedforward", open_loop),
        input_energy("feedback", closed),
        kinetic_energy(open_loop),
        potential_energy(open_loop),
        sign_of_the_bracket(open_loop),
        density(evidence),
        expected_absolute_value(evidence),
        polynomial_of_order_six(evidence),
        polynomial_of_order_four(evidence),
        double_expectation(evidence),
        viscous_regressor(open_loop),
        slow_motion(open_loop),
        neglected_term(open_loop),
    )


@dataclass(frozen=True, kw_only=True)
class _Mean:
    """A mean over runs, and how far chance may take it from what is expected."""

    value: float
    range: float

    def __str__(self) -> str:
        return f"{_number(self.value, 4)} ± {_number(self.range, 2)}"


def _number(value: float, digits: int) -> str:
    """Return a number as it is printed, with its power of ten raised if it needs one."""
    mantissa, _, power = f"{value:.{digits}g}".partition("e")
    raised = f"·10{str(int(power)).translate(_RAISED)}" if power else ""
    return mantissa.replace("-", "−") + raised


def _mean(effects: Sequence[NoiseEffects], effect: Callable[[NoiseEffects], float]) -> _Mean:
    values = np.array([effect(each) for each in effects])
    wide = float(stats.t.ppf(0.5 * (1.0 + _CONFIDENCE), values.size - 1))
    return _Mean(
        value=float(np.mean(values)),
        range=wide * float(np.std(values, ddof=1)) / float(np.sqrt(values.size)),
    )


def _expected(
    place: str, statement: str, what: str, found: _Mean, expected: float, unit: str, why: str
) -> Claim:
    return Claim(
        place=place,
        statement=statement,
        criterion=f"the mean over the runs is as near to {_number(expected, 4)} {unit} "
        f"{_BY_CHANCE}",
        measured=f"{what}: {found} {unit}",
        agrees=abs(found.value - expected) <= found.range,
        why=why,
        numbers={"mean": found.value, "range": found.range, "expected": expected},
    )


def input_energy(loop: Loop, effects: Sequence[NoiseEffects]) -> Claim:
    """Judge Eq. 5.5 in one loop."""
    why = {
        "feedforward": "The input is fixed beforehand, so the noise of the velocity that "
        "multiplies it averages out.",
        "feedback": "The controller makes the input from the measured velocity, so that "
        "E{u v} = −K_d σ_v² and the printed sum of Eq. 3.6 loses about K_d σ_v² T in every sample. "
        "The sum that is exact under a held input, of u(k−1) [x(k) − x(k−1)], is free of that, but "
        "the input is also made from the measured position, so that it gains about K_p σ_w² in "
        "every sample.",
    }
    held = _mean(effects, lambda each: each.held_input_energy)
    claim = _expected(
        f"Eq. 5.5, {loop}",
        "Noise in the measurements has no effect on the input energy in expectation.",
        "input energy at the end, measured less true",
        _mean(effects, lambda each: each.input_energy),
        0.0,
        "J",
        why[loop],
    )
    return replace(
        claim,
        measured=f"{claim.measured} (by the sum exact under a held input: {held} J)",
        numbers={**claim.numbers, "held_mean": held.value, "held_range": held.range},
    )


def kinetic_energy(effects: Sequence[NoiseEffects]) -> Claim:
    """Judge Eq. 5.6."""
    masses = surrogate.MASS_1 + surrogate.MASS_2
    return _expected(
        "Eq. 5.6",
        "Noise adds ½ m₁ σ_v1² + ½ m₂ σ_v2² to the kinetic energy.",
        "kinetic energy, measured less true",
        _mean(effects, lambda each: each.kinetic_energy),
        kinetic_energy_bias(masses, surrogate.VELOCITY_NOISE),
        "J",
        "The square of the noise has this mean whatever the motion.",
    )


def potential_energy(effects: Sequence[NoiseEffects]) -> Claim:
    """Judge Eq. 5.7."""
    expected = potential_energy_bias(
        surrogate.STIFFNESS, surrogate.POSITION_NOISE, surrogate.POSITION_NOISE
    )
    square = _mean(effects, lambda each: each.potential_square)
    claim = _expected(
        "Eq. 5.7",
        "Noise adds ½ k_s (σ_w1² + σ_w2²) to the potential energy (k₂ in print is k_s).",
        "potential energy, measured less true",
        _mean(effects, lambda each: each.potential_energy),
        expected,
        "J",
        "The spring's length carries the noise of both positions.",
    )
    return replace(
        claim,
        criterion=f"{claim.criterion}, and so is that of what is quadratic in the noise",
        measured=f"{claim.measured} (of it, what is quadratic in the noise: {square} J)",
        agrees=claim.agrees and abs(square.value - expected) <= square.range,
        numbers={**claim.numbers, "square_mean": square.value, "square_range": square.range},
    )


def sign_of_the_bracket(effects: Sequence[NoiseEffects]) -> Claim:
    """Judge the sign in Eq. 5.26."""
    added = kinetic_energy_bias(
        surrogate.MASS_1 + surrogate.MASS_2, surrogate.VELOCITY_NOISE
    ) + potential_energy_bias(
        surrogate.STIFFNESS, surrogate.POSITION_NOISE, surrogate.POSITION_NOISE
    )
    return _expected(
        "Eq. 5.26",
        "The biases of the stored energies stand with a plus in the measured dissipation.",
        "measured dissipation, measured less true",
        _mean(effects, lambda each: -each.kinetic_energy - each.potential_energy),
        added,
        "J",
        "Stored energy is subtracted from the input energy, so what noise adds to it is missing "
        "from the dissipation: the printed sign is wrong. A compensation has to add the bracket, "
        "as is done here.",
    )


def density(evidence: Evidence) -> Claim:
    """Judge Eq. 5.16 and Figure 5.1."""
    found = evidence.absolute_value.density_distance
    return Claim(
        place="Eq. 5.16, Fig. 5.1",
        statement="The density of |v| is zero below zero, and the part of the density of v there "
        "is folded over and added.",
        criterion="random draws lie no further from it than their 95 % limit (Kolmogorov) allows, "
        "with a tenth to spare",
        measured=f"largest distance {found:.2f} of that limit, for both means of the figure",
        agrees=found <= 1.1,
        why="It is the density of a folded normal.",
        numbers={"distance": found},
    )


def expected_absolute_value(evidence: Evidence) -> Claim:
    """Judge Eq. 5.20 and Figure 5.2."""
    found = evidence.absolute_value.mean_deviation
    return Claim(
        place="Eq. 5.20, Fig. 5.2",
        statement="The expected absolute value of a noisy velocity is "
        "√(2/π) σ exp(−v²/2σ²) + v erf(v/√2σ).",
        criterion=f"means of random draws at five velocities lie within {_SPREADS:g} standard "
        "errors of it",
        measured=f"largest deviation {found:.2f} standard errors",
        agrees=found <= _SPREADS,
        why="The integral of Eq. 5.18 is solved correctly.",
        numbers={"standard_errors": found},
    )


def polynomial_of_order_six(evidence: Evidence) -> Claim:
    """Judge Eqs. 5.21 and 5.22."""
    found = evidence.absolute_value.sixth_order_error
    return Claim(
        place="Eqs. 5.21, 5.22",
        statement="A polynomial of order six stands for Eq. 5.20 within ±3 σ_v (print: ±3 v).",
        criterion=f"its error there is at most {_FITTED:g} σ",
        measured=f"largest error {found:.4f} σ",
        agrees=found <= _FITTED,
        why="The expected value is even and smooth. It is a closed form, so no polynomial is "
        "needed.",
        numbers={"error": found},
    )


def polynomial_of_order_four(evidence: Evidence) -> Claim:
    """Judge the polynomial before Eq. 5.25."""
    found = evidence.absolute_value.fourth_order_error
    return Claim(
        place="5, after Eq. 5.24",
        statement="A polynomial of order four in |v| stands for the final bias.",
        criterion=f"its error against Eq. 5.24 less |v| is at most {_FITTED:g} σ within 3 σ",
        measured=f"largest error {found:.4f} σ",
        agrees=found <= _FITTED,
        why="With odd powers, as |v| itself is one, four orders are enough.",
        numbers={"error": found},
    )


def double_expectation(evidence: Evidence) -> Claim:
    """Judge Eq. 5.24 as a compensation."""
    found = evidence.absolute_value
    left = (
        found.added_at_rest - found.removed_at_rest,
        found.added_in_motion - found.removed_in_motion,
    )
    return Claim(
        place="Eqs. 5.24, 5.27",
        statement="Subtracting the double expectation less |v| compensates the noise in |v|.",
        criterion=f"what is left in expectation is at most {_REMOVED:g} σ at rest and at 2 σ",
        measured=(
            f"at rest noise adds {found.added_at_rest:.3f} σ and {found.removed_at_rest:.3f} σ are "
            f"taken off; at 2 σ it adds {found.added_in_motion:.3f} σ and "
            f"{found.removed_in_motion:.3f} σ are taken off. Eq. 5.24 is off its exact form by up "
            f"to {found.double_mean_error:.2f} σ within 3 σ"
        ),
        agrees=max(map(abs, left)) <= _REMOVED,
        why="The bias is a function of the true velocity. Taking the expectation once more at the "
        "measured velocity spreads it: too little is taken off at rest, too much in slow motion. "
        "Averaging the polynomial of order six takes it beyond the 3 σ it holds for.",
        numbers={"left_at_rest": left[0], "left_in_motion": left[1]},
    )


def viscous_regressor(effects: Sequence[NoiseEffects]) -> Claim:
    """Judge Eq. 5.25."""
    samples = round(surrogate.DURATION / surrogate.SAMPLING_TIME) + 1
    return _expected(
        "Eq. 5.25",
        "Noise adds σ_v1² k T to the viscous regressor (its sum has k + 1 terms).",
        "sum of squared velocities at the end, measured less true",
        _mean(effects, lambda each: each.viscous_regressor),
        viscous_regressor_bias(surrogate.VELOCITY_NOISE, surrogate.SAMPLING_TIME, samples),
        "m²/s",
        "The square of the noise has the mean σ² in every sample.",
    )


def slow_motion(effects: Sequence[NoiseEffects]) -> Claim:
    """Judge where noise matters in the Coulomb regressor."""
    rest = _mean(effects, lambda each: each.speed_at_rest)
    motion = _mean(effects, lambda each: each.speed_in_motion)
    return Claim(
        place="5, 6.1",
        statement="The bias of the Coulomb regressor depends on time and on the velocity, and is "
        "dominant when velocities are small.",
        criterion=f"noise adds at least {_DOMINANT:g} times as much to |v| at rest as beyond 3 σ_v",
        measured=f"{rest} m/s at rest, {motion} m/s beyond 3 σ_v",
        agrees=abs(rest.value) >= _DOMINANT * abs(motion.value),
        why="Where the sign of the velocity is certain, noise averages out of its absolute value; "
        "at rest all of it counts, sample after sample.",
        numbers={"at_rest": rest.value, "in_motion": motion.value},
    )


def neglected_term(effects: Sequence[NoiseEffects]) -> Claim:
    """Judge what Eq. 6.2 leaves out."""
    coulomb = _mean(effects, lambda each: each.coulomb_regressor).value
    viscous = _mean(effects, lambda each: each.viscous_regressor).value
    ratio, sigma = viscous / coulomb, surrogate.VELOCITY_NOISE
    energy = (
        surrogate.COULOMB_FRICTION * coulomb,
        surrogate.VISCOUS_FRICTION * viscous,
    )
    return Claim(
        place="6.1, Eq. 6.2",
        statement="σ_v1² k T is an order σ_v1 smaller than W_c, and therefore neglected in f(kT).",
        criterion=f"their ratio is within a factor {_ORDER:g} of σ_v1 in m/s",
        measured=(
            f"ratio {ratio:.3f} m/s of what noise adds to both regressors in a run, σ_v1 = "
            f"{sigma:g} m/s; as energies {energy[1]:.3f} J against {energy[0]:.3f} J"
        ),
        agrees=sigma / _ORDER <= ratio <= _ORDER * sigma,
        why="At rest W_c grows with 0.8 σ_v and the other with σ_v², so that their ratio is about "
        "1.25 σ_v, and more as W_c does not grow while the mass is fast. At rest both grow with "
        "time alone, so S can stand for either.",
        numbers={"ratio": ratio, "sigma": sigma},
    )
