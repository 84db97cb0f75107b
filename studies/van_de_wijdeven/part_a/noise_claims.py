"""Claims on noise in chapter 5, judged by measurements."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy import stats

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.effects import NoiseEffects
from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.judging import Quantity, Row
from studies.van_de_wijdeven.part_a.noise_compensation import (
    kinetic_energy_bias,
    potential_energy_bias,
    viscous_regressor_bias,
)
from studies.van_de_wijdeven.part_a.runs import Loop

_CONFIDENCE = 0.999  # of a mean over runs, so that a true expectation is hardly ever refused
_SPREADS = 3.5  # standard errors of a mean of very many draws that pass as chance
_FITTED = 0.02  # error of a good polynomial [sigma]
_REMOVED = 0.05  # of what noise adds, left by a good compensation [sigma]
_ORDER = 3.0  # factor up to which something is of the order of another

_KINETIC = kinetic_energy_bias(surrogate.MASS_1 + surrogate.MASS_2, surrogate.VELOCITY_NOISE)
_POTENTIAL = potential_energy_bias(
    surrogate.STIFFNESS, surrogate.POSITION_NOISE, surrogate.POSITION_NOISE
)
_VISCOUS = viscous_regressor_bias(
    surrogate.VELOCITY_NOISE,
    surrogate.SAMPLING_TIME,
    round(surrogate.DURATION / surrogate.SAMPLING_TIME) + 1,
)

Effect = Callable[[NoiseEffects], float]


def _mean(effects: Sequence[NoiseEffects], effect: Effect) -> float:
    return float(np.mean([effect(each) for each in effects]))


def deviation(effects: Sequence[NoiseEffects], effect: Effect, expected: float) -> float:
    """Return how far a mean is from what is expected, over how far chance may take it."""
    values = np.array([effect(each) for each in effects])
    wide = float(stats.t.ppf(0.5 * (1.0 + _CONFIDENCE), values.size - 1))
    range_ = wide * float(np.std(values, ddof=1)) / float(np.sqrt(values.size))
    return abs(float(np.mean(values)) - expected) / range_


def _expected(
    what: str, unit: str, effect: Effect, expected: float, loop: Loop = "feedforward"
) -> tuple[Quantity, Quantity]:
    """Return a mean over the runs, and its deviation from what is expected."""
    return (
        Quantity(
            f"{what}: deviation from {expected:.4g} {unit}, over its 99.9 % interval",
            "1",
            lambda e: deviation(e.study.effects[loop], effect, expected),
            high=1.0,
        ),
        Quantity(what, unit, lambda e: _mean(e.study.effects[loop], effect)),
    )


def _speed_ratio(evidence: Evidence) -> float:
    effects = evidence.study.effects["feedforward"]
    rest = _mean(effects, lambda each: each.speed_at_rest)
    return abs(rest) / abs(_mean(effects, lambda each: each.speed_in_motion))


def _regressor_ratio(evidence: Evidence) -> float:
    """Return what noise adds to the viscous regressor, over what it adds to W_c [m/s]."""
    effects = evidence.study.effects["feedforward"]
    viscous = _mean(effects, lambda each: each.viscous_regressor)
    return viscous / _mean(effects, lambda each: each.coulomb_regressor)


def _input_energy(loop: Loop, why: str) -> Row:
    return Row(
        f"input energy, {loop}",
        f"Eq. 5.5, {loop}",
        "Noise in the measurements has no effect on the input energy in expectation.",
        why,
        *_expected(
            "input energy at the end, measured less true",
            "J",
            lambda each: each.input_energy,
            0.0,
            loop,
        ),
        Quantity(
            "the same by the sum that is exact under a held input",
            "J",
            lambda e: _mean(e.study.effects[loop], lambda each: each.held_input_energy),
        ),
    )


NOISE_CLAIMS = (
    _input_energy(
        "feedforward",
        "The input is fixed beforehand, so the noise of the velocity that multiplies it averages "
        "out.",
    ),
    _input_energy(
        "feedback",
        "The controller makes the input from the measured velocity, so that E{u v} = −K_d σ_v² and "
        "the printed sum of Eq. 3.6 loses about K_d σ_v² T in every sample. The sum that is exact "
        "under a held input, of u(k−1) [x(k) − x(k−1)], is free of that, but the input is also "
        "made from the measured position, so that it gains about K_p σ_w² in every sample.",
    ),
    Row(
        "kinetic energy",
        "Eq. 5.6",
        "Noise adds ½ m₁ σ_v1² + ½ m₂ σ_v2² to the kinetic energy.",
        "The square of the noise has this mean whatever the motion.",
        *_expected(
            "kinetic energy, measured less true", "J", lambda each: each.kinetic_energy, _KINETIC
        ),
    ),
    Row(
        "potential energy",
        "Eq. 5.7",
        "Noise adds ½ k_s (σ_w1² + σ_w2²) to the potential energy (k₂ in print is k_s).",
        "The spring's length carries the noise of both positions.",
        *_expected(
            "potential energy, measured less true",
            "J",
            lambda each: each.potential_energy,
            _POTENTIAL,
        ),
        *_expected(
            "of it, what is quadratic in the noise",
            "J",
            lambda each: each.potential_square,
            _POTENTIAL,
        ),
    ),
    Row(
        "sign of the bracket",
        "Eq. 5.26",
        "The biases of the stored energies stand with a plus in the measured dissipation.",
        "Stored energy is subtracted from the input energy, so what noise adds to it is missing "
        "from the dissipation: the printed sign is wrong. A compensation has to add the bracket, "
        "as is done here.",
        *_expected(
            "measured dissipation, measured less true",
            "J",
            lambda each: -each.kinetic_energy - each.potential_energy,
            _KINETIC + _POTENTIAL,
        ),
    ),
    Row(
        "density",
        "Eq. 5.16, Fig. 5.1",
        "The density of |v| is zero below zero, and the part of the density of v there is folded "
        "over and added.",
        "It is the density of a folded normal.",
        Quantity(
            "largest distance of random draws, over their 95 % limit (Kolmogorov)",
            "1",
            lambda e: e.absolute_value.density_distance,
            high=1.1,
        ),
    ),
    Row(
        "expected absolute value",
        "Eq. 5.20, Fig. 5.2",
        "The expected absolute value of a noisy velocity is √(2/π) σ exp(−v²/2σ²) + v erf(v/√2σ).",
        "The integral of Eq. 5.18 is solved correctly.",
        Quantity(
            "largest deviation of means of random draws at five velocities",
            "standard errors",
            lambda e: e.absolute_value.mean_deviation,
            high=_SPREADS,
        ),
    ),
    Row(
        "polynomial of order six",
        "Eqs. 5.21, 5.22",
        "A polynomial of order six stands for Eq. 5.20 within ±3 σ_v (print: ±3 v).",
        "The expected value is even and smooth. It is a closed form, so no polynomial is needed.",
        Quantity("largest error", "σ", lambda e: e.absolute_value.sixth_order_error, high=_FITTED),
    ),
    Row(
        "polynomial of order four",
        "5, after Eq. 5.24",
        "A polynomial of order four in |v| stands for the final bias.",
        "With odd powers, as |v| itself is one, four orders are enough.",
        Quantity(
            "largest error against Eq. 5.24 less |v|, within 3 σ",
            "σ",
            lambda e: e.absolute_value.fourth_order_error,
            high=_FITTED,
        ),
    ),
    Row(
        "double expectation",
        "Eqs. 5.24, 5.27",
        "Subtracting the double expectation less |v| compensates the noise in |v|.",
        "The bias is a function of the true velocity. Taking the expectation once more at the "
        "measured velocity spreads it: too little is subtracted at rest, too much in slow motion. "
        "Averaging the polynomial of order six takes it beyond the 3 σ it holds for.",
        Quantity(
            "left in expectation at rest",
            "σ",
            lambda e: e.absolute_value.added_at_rest - e.absolute_value.removed_at_rest,
            -_REMOVED,
            _REMOVED,
        ),
        Quantity(
            "left in expectation at 2 σ",
            "σ",
            lambda e: e.absolute_value.added_in_motion - e.absolute_value.removed_in_motion,
            -_REMOVED,
            _REMOVED,
        ),
        Quantity(
            "largest error of Eq. 5.24 against its exact form, within 3 σ",
            "σ",
            lambda e: e.absolute_value.double_mean_error,
        ),
    ),
    Row(
        "viscous regressor",
        "Eq. 5.25",
        "Noise adds σ_v1² k T to the viscous regressor (its sum has k + 1 terms).",
        "The square of the noise has the mean σ² in every sample.",
        *_expected(
            "sum of squared velocities at the end, measured less true",
            "m²/s",
            lambda each: each.viscous_regressor,
            _VISCOUS,
        ),
    ),
    Row(
        "slow motion",
        "5, 6.1",
        "The bias of the Coulomb regressor depends on time and on the velocity, and is dominant "
        "when velocities are small.",
        "Where the sign of the velocity is certain, noise averages out of its absolute value; at "
        "rest all of it counts, sample after sample.",
        Quantity("noise added to |v| at rest, over that beyond 3 σ_v", "1", _speed_ratio, low=10.0),
    ),
    Row(
        "neglected term",
        "6.1, Eq. 6.2",
        "σ_v1² k T is an order σ_v1 smaller than W_c, and therefore neglected in f(kT).",
        "At rest W_c grows with 0.8 σ_v and the other with σ_v², so that their ratio is about 1.25 "
        "σ_v, and more as W_c does not grow while the mass is fast. At rest both grow with time "
        "alone, so S can stand for either.",
        Quantity(
            "ratio of what noise adds to both regressors in a run",
            "m/s",
            _regressor_ratio,
            surrogate.VELOCITY_NOISE / _ORDER,
            surrogate.VELOCITY_NOISE * _ORDER,
        ),
    ),
)
