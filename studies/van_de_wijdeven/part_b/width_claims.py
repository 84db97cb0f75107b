"""Claims on pulse width control (PWC), judged by ten runs of each case."""

import math

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_b.cases import APPLIED, CALCULATED, PWC, UNBOUNDED
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import (
    FIRST,
    LAST,
    RUNS,
    Quantity,
    Row,
    by_controller,
    by_reading,
    largest_final_error,
    relative_gains,
)
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import PULSE_EFFORT, SAMPLING_TIME, TOLERANCE

_CYCLE = 4  # last pulses of a run, over which a limit cycle goes to and fro
_LEAST = 1e-9  # a length or share below every one here


def _cycles(series: Series, run: int) -> bool:
    """Return whether the last pulses of a run go to and fro."""
    last = np.sign(series.efforts(run)[-_CYCLE:])
    return bool(last.size == _CYCLE and np.all(last[1:] == -last[:-1]))


def _cycling(series: Series) -> int:
    return sum(_cycles(series, run) for run in RUNS)


def _samples(series: Series) -> int:
    """Return how many samples the last pulse of the last run lasts."""
    return round(series.runs[LAST].pulses[-1].duration / SAMPLING_TIME)


def _rests(series: Series, run: int) -> tuple[float, float]:
    """Return the errors at rest before and after the last pulse of a run [m]."""
    last = series.runs[run].pulses[-1]
    return last.error, last.error - last.achieved_displacement


def _last_gain(evidence: Evidence, series: Series) -> float:
    return float(relative_gains(evidence, series, LAST)[-1])


def _surplus(evidence: Evidence) -> Float[np.ndarray, " k"]:
    """Return by how much the pulses of run 1 are longer than calculated [samples]."""
    series = evidence.series[PWC, CALCULATED, UNBOUNDED]
    pulses, gains = series.runs[FIRST].pulses, series.estimate(FIRST, "pulse_gain")
    calculated = np.sqrt([abs(p.error) / b for p, b in zip(pulses, gains, strict=False)])
    return (np.array([p.duration for p in pulses]) - calculated) / SAMPLING_TIME


def _last_step(evidence: Evidence, free: Series, _: Series) -> float:
    steps = np.abs(np.diff(relative_gains(evidence, free, FIRST)))
    return float(steps[-1] / steps[0])


def _closer(evidence: Evidence, free: Series, bound: Series) -> float:
    """Return by how much b_hat of run 10 is closer to b with the bound than without [b]."""
    without, with_it = (abs(_last_gain(evidence, each) - 1.0) for each in (free, bound))
    return without - with_it


def _overshooting(series: Series) -> int:
    return sum(float(np.min(series.error(run))) < -TOLERANCE for run in RUNS)


def _overshoot(series: Series, run: int) -> float:
    return float(-np.min(series.error(run)))


def _smallest(evidence: Evidence) -> float:
    return float(evidence.law.displacement(PULSE_EFFORT, SAMPLING_TIME))


def _true_gain_samples(evidence: Evidence) -> int:
    """Return the samples of a pulse for the smaller error of the cycle, with the true b."""
    error = min(map(abs, _rests(evidence.series[PWC, APPLIED, UNBOUNDED], LAST)))
    return math.ceil(math.sqrt(error / evidence.gain) / SAMPLING_TIME)


def _efforts(evidence: Evidence) -> Float[np.ndarray, " k"]:
    """Return the magnitudes of all pulses of PWC [N]."""
    every = [
        series.efforts(run)
        for (controller, *_), series in evidence.series.items()
        if controller == PWC
        for run in RUNS
    ]
    return np.abs(np.concatenate(every))


def _signs(evidence: Evidence) -> int:
    """Return the fewest signs of the efforts in a run that is drawn."""
    return min(
        len(set(np.sign(series.efforts(run)).tolist()))
        for series in evidence.by_bound(PWC, CALCULATED)
        for run in (FIRST, LAST)
    )


WIDTH_CLAIMS = (
    Row(
        "limit cycle",
        "1; 4, Fig. 3",
        "PWC in discrete time ends in a limit cycle around the reference, as the required width "
        "and the permitted one differ.",
        "One sample at full effort is the smallest pulse, and its displacement is far more than "
        "the tolerance. PWC never gives up.",
        Quantity(
            "runs whose last four pulses go to and fro, of 20 with and without a bound",
            "runs",
            by_reading(PWC, lambda _, free, bound: _cycling(free) + _cycling(bound)),
            low=2.0 * len(RUNS),
        ),
    ),
    Row(
        "rounded up",
        "2.2",
        "The pulse width is rounded up to whole samples, so that the calculated pulse is not the "
        "real input.",
        "Displacement goes with the square of the width: the surplus is small for a wide pulse, "
        "and large for the last one, which keeps up the limit cycle.",
        Quantity(
            "least surplus of a width in run 1",
            "samples",
            lambda e: float(np.min(_surplus(e))),
            _LEAST,
            1.0,
        ),
        Quantity("largest", "samples", lambda e: float(np.max(_surplus(e))), _LEAST, 1.0),
    ),
    Row(
        "minimal adaptation",
        "3.1",
        "As the residual error decreases with subsequent pulses, b̂ is hardly adapted any more.",
        "The correction goes with the fourth power of the width, which has become small; not "
        "because b̂ predicts small displacements well.",
        Quantity(
            "change of b̂ by the last pulse of run 1, over that by the first",
            "1",
            by_reading(PWC, _last_step),
            high=0.05,
        ),
    ),
    Row(
        "closer estimate with the bound",
        "3.1; 4, Fig. 7",
        "With a finite t_p,max, b̂ of PWC is closer to the theoretical b.",
        "Its pulses are shorter, and the effect of viscous friction is smaller.",
        Quantity(
            "reduction of the error of b̂/b by the bound, at the end of run 10",
            "1",
            by_reading(PWC, _closer),
            low=_LEAST,
        ),
    ),
    Row(
        "less overshoot with the bound",
        "3.1",
        "With a finite t_p,max, overshoot is less likely.",
        "PAPWC with the bound comes from one side, in small steps. PWC overshoots with either, as "
        "its last pulses, of one or two samples, go too far whatever precedes them.",
        Quantity(
            "runs of ten that overshoot by more than the tolerance, fewer with the bound",
            "runs",
            by_controller(lambda _, free, bound: _overshooting(free) - _overshooting(bound)),
            low=1.0,
        ),
    ),
    Row(
        "gain in range",
        "3.1; 4, Figs. 7, 8",
        "With t_p,max = 0.03 s the estimate b̂ of the controllers is between 81 % and 100 % of b.",
        "PWC that learns from the calculated width attributes the surplus of the whole samples to "
        "b, so that its b̂ is too large for a width that is applied.",
        Quantity(
            "b̂/b at the end of run 10 with the bound",
            "1",
            by_controller(lambda e, _, bound: _last_gain(e, bound)),
            0.805,
            1.0,
        ),
    ),
    Row(
        "overshoot without a bound",
        "4, Fig. 3",
        "PWC overshoots when t_p,max is not bounded, as predicted.",
        "In run 1 b̂ is still too large, so the pulses are too short and only the last ones, "
        "rounded up, go too far; later b̂ is too small for short pulses, as section 3.1 predicts.",
        Quantity(
            "smaller overshoot of runs 1 and 10",
            "m",
            by_reading(
                PWC, lambda _, free, __: min(_overshoot(free, run) for run in (FIRST, LAST))
            ),
            low=_LEAST,
        ),
    ),
    Row(
        "overshoot with the bound",
        "4, Fig. 3",
        "It overshoots with the bound too, because of the least width of one sample.",
        "It overshoots, but not for the reason given: an error above b̂ T² takes two samples, which "
        "move the mass much farther than one.",
        Quantity(
            "overshoot of run 10",
            "m",
            by_reading(PWC, lambda _, __, bound: _overshoot(bound, LAST)),
            low=_LEAST,
        ),
        Quantity(
            "width of the pulses of the limit cycle",
            "samples",
            by_reading(PWC, lambda _, __, bound: _samples(bound)),
            1.0,
            1.0,
        ),
    ),
    Row(
        "largest final error of PWC",
        "4, Eq. 23",
        "d_min is the maximum final error.",
        "It bounds a limit cycle of single samples only. Rounding up gives errors above b̂ T² two "
        "samples, and a cycle of two samples is stable as well.",
        Quantity(
            "largest final error of any run, over d_min",
            "1",
            by_reading(PWC, lambda e, free, bound: largest_final_error(free, bound) / _smallest(e)),
            high=1.0,
        ),
        Quantity("d_min", "m", _smallest),
    ),
    Row(
        "two samples in run 10",
        "4, Fig. 3",
        "In run 10 without a bound the overshoot exceeds d_min, as pulses last two samples now.",
        "The first pulses leave it in the cycle of two samples, in which it remains.",
        Quantity(
            "error at rest in the cycle, over d_min",
            "1",
            by_reading(PWC, lambda e, free, _: max(map(abs, _rests(free, LAST))) / _smallest(e)),
            low=1.0 + _LEAST,
        ),
        Quantity(
            "width of the last pulse",
            "samples",
            by_reading(PWC, lambda _, free, __: _samples(free)),
            2.0,
            2.0,
        ),
    ),
    Row(
        "poor estimate",
        "4, Fig. 3",
        "That the pulses last two samples is the result of the poor estimate b̂.",
        "Rounding up is the cause: no estimate, however good, leads out of this cycle.",
        Quantity(
            "width for the smaller error of the cycle, with the true b",
            "samples",
            _true_gain_samples,
            1.0,
            1.0,
        ),
    ),
    Row(
        "full effort",
        "4, Fig. 5",
        "The input of PWC contains only maximum positive and negative pulses, which the limit "
        "cycle switches between.",
        "The effort is not a variable of PWC.",
        Quantity(
            "least effort of a pulse",
            "N",
            lambda e: float(np.min(_efforts(e))),
            PULSE_EFFORT,
            PULSE_EFFORT,
        ),
        Quantity(
            "largest effort of a pulse",
            "N",
            lambda e: float(np.max(_efforts(e))),
            PULSE_EFFORT,
            PULSE_EFFORT,
        ),
        Quantity("signs of the efforts in every run drawn", "signs", _signs, 2.0, 2.0),
    ),
)
