"""``python -m studies.mismatch.bound``: smallest errors of an estimator in the noise cases.

The effort of an axis is ``u = m a + c v + f_c sign(v) + f_0 + d``. The true motion is known here,
and so are the mean square and the correlation of d (white noise on the logged effort, white and
AR(1) disturbance forces). The efficient unbiased estimator is then generalised least squares. Its
covariance is ``(X^T S^-1 X)^-1`` (Aitken 1936). The feedback loop makes the motion depend on d; the
bound ignores that dependence, as any fit of the effort over the motion does.

An interval of exactly 95 % misses the truth in 5 % of logs. The miss is critical if the error is
also larger than `LARGE_ERROR`. The rate of critical results of that estimator follows from the
standard deviations alone.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from rich.console import Console
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import norm

from studies.markdown import table
from studies.mismatch.axes import CYCLE, physical
from studies.mismatch.cases import Recorded, record
from studies.mismatch.judgement import LARGE_ERROR

CASES = ("noise", "noise_double", "noise_fourfold", "correlated_098", "correlated_0998")
EVERY = 4
"""Samples from one row to the next [-]: the covariance of all samples would not fit into a
cache."""
SLOW = 0.02
"""Share of the largest speed [-] below which friction may not oppose the velocity."""
NORMAL_95 = 1.959963984540054


def relative_bounds(recorded: Recorded) -> Float[np.ndarray, " 4"]:
    """Return the standard deviations of mass, viscous, Coulomb friction and offset over the truth.

    The log is one of a noise case. The offset is compared with Coulomb friction.
    """
    run, setup, plant = recorded.run, recorded.setup, physical(recorded.setup)
    velocity = 0.5 * (run.velocity[1:] + run.velocity[:-1])
    time = 0.5 * (run.time[1:] + run.time[:-1])
    acceleration = np.diff(run.velocity) / np.diff(run.time)
    rows = np.arange(0, velocity.size, EVERY)
    rows = rows[np.abs(velocity[rows]) > SLOW * np.max(np.abs(velocity))]
    v = velocity[rows]
    columns = np.column_stack([acceleration[rows], v, np.sign(v), np.ones(v.size)])
    apart = np.abs(time[rows, None] - time[None, rows]) / CYCLE
    size = setup.correlated_disturbance * setup.coulomb * plant.limit
    white = (setup.noise**2 + setup.white_disturbance**2) * plant.limit**2 / EVERY
    covariance = size**2 * setup.correlation**apart + white * np.eye(v.size)
    information = columns.T @ cho_solve(cho_factor(covariance), columns)
    deviations = np.sqrt(np.diag(np.linalg.inv(information)))
    truth = recorded.truth
    friction = truth["coulomb_friction"]
    return deviations / np.array([setup.mass, truth["viscous_friction"], friction, friction])


def unavoidable_rate(bounds: Sequence[Float[np.ndarray, " 4"]]) -> float:
    """Return the mean rate of critical results with exact 95 % intervals [-].

    The bounds are those of each log.
    """
    beyond = np.maximum(NORMAL_95, LARGE_ERROR / np.array(bounds))
    return float(np.mean(1.0 - np.prod(1.0 - 2.0 * norm.sf(beyond), axis=1)))


def main() -> None:
    """Print the table of the noise cases."""
    parser = argparse.ArgumentParser(prog="python -m studies.mismatch.bound", description=__doc__)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=CASES, metavar="CASE")
    parser.add_argument("--runs", type=int, default=20, help="recordings a case (default 20)")
    given = parser.parse_args()
    rows: list[list[str]] = []
    for case in given.cases:
        bounds = [relative_bounds(record(case, seed)) for seed in range(given.runs)]
        medians = [f"{100 * value:.2g}" for value in np.median(bounds, axis=0)]
        rows.append([case, str(given.runs), *medians, f"{100 * unavoidable_rate(bounds):.1f}"])
    quantities = (f"{name} [%]" for name in ("mass", "viscous", "Coulomb", "offset", "critical"))
    Console(width=120).print(table(["case", "runs", *quantities], rows, words=1), markup=False)


if __name__ == "__main__":
    main()
