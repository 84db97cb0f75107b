"""Everything that the claims of the source are judged by."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation import PublishedEnergyEstimator
from stickslip.simulation import Sensors, SimulatedMotion, simulate
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.cases import published_estimator
from studies.van_de_wijdeven.part_a.expectations import AbsoluteValue
from studies.van_de_wijdeven.part_a.monte_carlo import Study
from studies.van_de_wijdeven.part_a.runs import Loop, one_run
from studies.van_de_wijdeven.part_a.sequences import Sequences

_FINER = 10  # how many times shorter the sampling time becomes
_LATE = 20.0  # of the run's end, in which the load's swing is measured [s]


@dataclass(frozen=True, kw_only=True)
class Rest:
    """How the bang-bang input leaves the arm."""

    time: float  #: When the first mass comes to rest for good [s].
    swing: float  #: Amplitude at which the second goes on [m].


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """Errors of Coulomb and viscous friction without noise, over the truth [-], shape (2,) each."""

    printed: Float[np.ndarray, " 2"]  #: Of the printed sums.
    finer: Float[np.ndarray, " 2"]  #: Of the same with a sampling time ten times shorter.
    exact: Float[np.ndarray, " 2"]  #: Of the exact sums at the first sampling time.


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Measurements of part A."""

    absolute_value: AbsoluteValue  #: Of the expectations of chapter 5.
    #: Of the arm without noise.
    rest: Rest
    sampling: Sampling
    #: Correlation of Coulomb and viscous friction (rows) with B and S (columns) [-].
    interaction: Float[np.ndarray, "2 2"]
    #: Of five consecutive runs each, by loop and case.
    sequences: Mapping[tuple[Loop, str], Sequences]
    study: Study  #: Of all variants by Monte Carlo.


def _motion(sampling_time: float) -> SimulatedMotion:
    return simulate(
        surrogate.surrogate_arm(),
        surrogate.bang_bang_effort(sampling_time),
        sampling_time=sampling_time,
    )


def rest_of_the_arm() -> Rest:
    """Return when the first mass rests under the bang-bang input, and how the second swings.

    Raises
    ------
    ValueError
        If the plant has no second mass.
    """
    motion = _motion(surrogate.SAMPLING_TIME)
    if motion.load_position is None:
        raise ValueError("the plant has no second mass")
    rests = motion.event_time[motion.event_mode == 0]
    late = motion.load_position[motion.time > motion.time[-1] - _LATE]
    return Rest(time=float(rests[-1]), swing=float(np.ptp(late)) / 2.0)


def sampling_errors() -> Sampling:
    """Return what the sums miss the truth by without noise."""
    printed, exact = published_estimator(), published_estimator(sums="settled")
    truth = np.array(list(surrogate.TRUTH.values()))

    def errors(
        estimator: PublishedEnergyEstimator, sampling_time: float
    ) -> Float[np.ndarray, " 2"]:
        log = Sensors().measure(_motion(sampling_time))
        _, values = estimator.run(estimator.init(sampling_time=sampling_time), log)
        return values[-1, :2] / truth - 1.0

    T = surrogate.SAMPLING_TIME
    return Sampling(
        printed=errors(printed, T), finer=errors(printed, T / _FINER), exact=errors(exact, T)
    )


def interaction_of_terms(generator: np.random.Generator) -> Float[np.ndarray, "2 2"]:
    """Return the correlation of Coulomb and viscous friction with B and S after one run, from P.

    In the feedforward, with the source's compensation of the true noise.
    """
    estimator = published_estimator(compensation="printed", error_terms=True)
    state = estimator.init(sampling_time=surrogate.SAMPLING_TIME)
    log = one_run("feedforward", 1.0, generator, estimator, state).log
    P = estimator.covariance(estimator.run(state, log)[0])
    spread = np.sqrt(np.diag(P))
    return (P / np.outer(spread, spread))[:2, 2:]
