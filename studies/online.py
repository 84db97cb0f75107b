"""Coverage and fault recovery of the online estimators on the plant of the mismatch study.

``python -m studies.online --runs 100`` prints two tables. The estimators get the true inertia,
and the settings of a drive: encoder resolution, largest effort, highest speed. They do not get the
force noise. The plant shares no code with `stickslip.simulation`.

The recordings begin with seed 1000: the constants of the intervals were chosen on seeds below 100.

Coverage is the share of runs in which the true value lies inside the 95 % interval at the end of
the log. In the second table a fault is put into the case ``noise`` in the middle of a move; the
interval is judged two moves later, and coverage there is compared with that of the same runs
without a fault at the same time.
"""

from argparse import ArgumentParser
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation import EnergyEstimator, ExtendedKalmanFilter
from studies.mismatch.axes import moves, physical
from studies.mismatch.cases import Recorded, record

ESTIMATORS = ("ekf", "energy", "energy, inertia unknown")
PARAMETERS = ("viscous_friction", "coulomb_friction", "offset")
COVERAGE_CASES = (
    "ideal",
    "noise_half",
    "noise",
    "noise_double",
    "noise_fourfold",
    "quantized",
    "white_force",
    "correlated_098",
    "correlated_0998",
    "velocity",
    "spikes",
    "glitches",
)
MISMATCH_CASES = ("stribeck", "presliding", "delay_2", "friction_drift")
"""Errors of the model, which no interval from the same model covers."""

FAULTS = (
    "none",
    "position, 1 sample",
    "position, 5 samples",
    "position 1e200",
    "position small",
    "effort x 20",
    "effort peak, 3 samples",
    "effort 1e200",
    "position missing, 5 samples",
    "effort missing, 5 samples",
    "encoder homed again",
)

Samples = Float[np.ndarray, "n 5"]
Estimator = ExtendedKalmanFilter | EnergyEstimator


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of one run."""

    #: Whether each true value lies inside its interval, in the order of `PARAMETERS`.
    inside: Bool[np.ndarray, " 3"]
    #: Over the true value's size [-].
    error: Float[np.ndarray, " 3"]
    half_width: Float[np.ndarray, " 3"]
    finite: bool  #: Whether estimates were finite after every sample.


def estimator_for(name: str, recorded: Recorded, *, delay: float = 0.0) -> Estimator:
    """Return one of `ESTIMATORS` with the settings of the drive, and a delay [samples]."""
    mass = recorded.setup.mass
    if name != "ekf":
        inertia = mass if name == "energy" else None
        return EnergyEstimator(inertia=inertia, offset=True, effort_delay=delay)
    plant, T = physical(recorded.setup), recorded.log.sampling_time
    speed, limit = max(recorded.speed_range), plant.limit
    measured = recorded.log.measured_velocity
    return ExtendedKalmanFilter(
        inertia=mass,
        offset=True,
        position_noise=plant.encoder_step / np.sqrt(12.0),
        velocity_noise=None if measured is None else _velocity_noise(measured),
        rest_speed=max(2.0 * limit / mass * T, 0.01 * speed),
        rest_force=0.5 * limit,
        effort_delay=delay,
        initial_deviations={
            "viscous_friction": limit / speed,
            "coulomb_friction": 0.5 * limit,
            "offset": 0.5 * limit,
        },
    )


def _velocity_noise(velocity: Float[np.ndarray, " n"]) -> float:
    """Return the standard deviation of white noise by third differences (a data sheet's value)."""
    return float(np.median(np.abs(np.diff(velocity, 3)))) / 0.6745 / np.sqrt(20.0)


def samples_of(recorded: Recorded) -> Samples:
    """Return the longest part without gaps: effort, position, velocity; 0 where not measured."""
    log = max(recorded.log.segments(), key=len)
    zero = np.zeros(len(log))
    velocity = zero if log.measured_velocity is None else log.measured_velocity
    return np.column_stack([log.effort, log.measured_position, velocity, zero, zero])


def faulty(samples: Samples, fault: str, k: int) -> Samples:
    """Return samples with a fault that begins at sample k."""
    changed = samples.copy()
    travel, peak = float(np.ptp(samples[:, 1])), float(np.max(np.abs(samples[:, 0])))
    if fault == "position, 1 sample":
        changed[k, 1] += 4.0 * travel
    elif fault == "position, 5 samples":
        changed[k : k + 5, 1] += 4.0 * travel
    elif fault == "position 1e200":
        changed[k, 1] = 1e200
    elif fault == "position small":
        changed[k, 1] += 0.01 * travel
    elif fault == "effort x 20":
        changed[k, 0] = 20.0 * peak
    elif fault == "effort peak, 3 samples":
        changed[k : k + 3, 0] = peak
    elif fault == "effort 1e200":
        changed[k, 0] = 1e200
    elif fault == "position missing, 5 samples":
        changed[k : k + 5, 1] = np.nan
    elif fault == "effort missing, 5 samples":
        changed[k : k + 5, 0] = np.nan
    elif fault == "encoder homed again":
        changed[k:, 1] += 0.37 * travel
    elif fault != "none":
        raise ValueError(fault)
    return changed


def outcome_of(estimator: Estimator, recorded: Recorded, samples: Samples) -> Outcome:
    """Return what an estimator makes of the samples."""
    state = estimator.init(
        sampling_time=recorded.log.sampling_time,
        velocity_measured=recorded.log.measured_velocity is not None,
    )
    values = estimator.values_at
    kernel, finite = estimator.kernel, True
    for sample in samples.tolist():
        kernel(state, *sample)
        finite = finite and bool(np.isfinite(state[values]).all())
    low, high = estimator.intervals(state)[-len(PARAMETERS) :].T  # a mass comes first
    first = min(values.start, values.stop + 1)
    estimates = state[first : first + len(PARAMETERS)]
    truth = np.array([recorded.truth[name] for name in PARAMETERS])
    size = np.abs(truth)
    return Outcome(
        inside=(low <= truth) & (truth <= high),
        error=np.abs(estimates - truth) / size,
        half_width=0.5 * (high - low) / size,
        finite=finite,
    )


def _fault_place(recorded: Recorded) -> tuple[int, int]:
    """Return the middle of a move in mid-log, and the end of the second move after it [samples]."""
    T = recorded.log.sampling_time
    strokes = moves(recorded.setup)
    k = len(strokes) // 2
    middle = strokes[k].start + 0.5 * strokes[k].duration
    last = strokes[min(k + 2, len(strokes) - 1)]
    return round(middle / T), round((last.start + last.duration) / T)


def study(
    estimator: str,
    case: str,
    runs: int,
    *,
    fault: str | None = None,
    delay: float = 0.0,
    first_seed: int = 0,
) -> list[Outcome]:
    """Return the outcomes of runs of a mismatch case; with one of `FAULTS`, two moves after it.

    The delay of the effort [samples] is known to the estimator.
    """
    outcomes: list[Outcome] = []
    for seed in range(first_seed, first_seed + runs):
        recorded = record(case, seed)
        samples = samples_of(recorded)
        if fault is not None:
            k, end = _fault_place(recorded)
            samples = faulty(samples, fault, k)[:end]
        outcomes.append(
            outcome_of(estimator_for(estimator, recorded, delay=delay), recorded, samples)
        )
    return outcomes


def _row(title: str, estimator: str, outcomes: Sequence[Outcome]) -> str:
    inside = np.mean([each.inside for each in outcomes], axis=0)
    error = np.median([each.error for each in outcomes], axis=0)
    width = np.median([each.half_width for each in outcomes], axis=0)
    broken = sum(not each.finite for each in outcomes)
    cells = [f"{100 * share:5.1f}" for share in (*inside, np.mean(inside))]
    cells += [f"{100 * e:7.2f}" for e in error] + [f"{100 * w:7.2f}" for w in width]
    return f"{title:28} {estimator:23} " + " ".join(cells) + f" {broken:4d}"


_HEADER = (
    f"{'':28} {'':23} coverage [%]            median |error| [%]      median half width [%]   not\n"
    f"{'':28} {'':23}  visc  coul   off  mean    visc    coul     off    visc    coul     off "
    "finite"
)


def main() -> None:
    """Print the tables."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100, help="recordings a case")
    parser.add_argument("--first-seed", type=int, default=1000, help="seed of the first recording")
    parser.add_argument("--cases", nargs="*", default=(*COVERAGE_CASES, *MISMATCH_CASES))
    parser.add_argument("--faults", nargs="*", default=FAULTS)
    parser.add_argument("--estimators", nargs="*", default=ESTIMATORS)
    asked = parser.parse_args()
    print(f"{asked.runs} runs a case\n{_HEADER}")  # noqa: T201
    for case in asked.cases:
        for name in asked.estimators:
            outcomes = study(name, case, asked.runs, first_seed=asked.first_seed)
            print(_row(case, name, outcomes), flush=True)  # noqa: T201
    for fault in asked.faults:
        for name in asked.estimators:
            outcomes = study(name, "noise", asked.runs, fault=fault, first_seed=asked.first_seed)
            print(_row(fault, name, outcomes), flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
