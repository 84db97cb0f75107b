"""Test whether several logs show the same axis."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import robust_uncertainty
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.selection.model import smallest_ratio
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.significance import Basis, Partial, significance
from stickslip.records import LogDeviation


@dataclass(frozen=True, kw_only=True)
class ConsistencyTuning:
    """Tuning of the test whether logs are consistent."""

    error_rate: float = 0.01  #: Share of consistent sets of logs that are called inconsistent [-].
    smallest_difference: float = 0.02
    """Relative difference of a parameter that matters [-]: data sheets are as exact."""
    smallest_share: float = 1e-3
    """Share of the log's effort that a difference must explain to matter [-]: errors of a sampled
    motion can be as large."""
    smallest_ratio: float = 0.01
    """Smallest over largest singular value of the columns with the difference, scaled to unit norm
    [-]: below it parameters count as not identifiable."""


@dataclass(frozen=True, kw_only=True)
class Consistency:
    """Result of the comparison of the logs.

    Each deviation has a row of shifts [SI]: the difference of its parameter, and the change of the
    others if that log has its own value. The rows are those given, without what the differences
    explain: their least-squares solution is that of the other logs.
    """

    p_value: float | None  # of no difference at all; None if nothing could be compared
    deviations: tuple[LogDeviation, ...]  # the significant ones, the clearest first
    shifts: Float[np.ndarray, "k p"]
    rows: ModelRows


@dataclass(frozen=True, kw_only=True)
class _Trial:
    """The difference of one parameter in one log."""

    log: int
    parameter: int
    partial: Partial
    p_value: float

    @property
    def explained(self) -> float:
        return float(np.sum(self.partial.coordinates**2))


def compared_logs(logs: int) -> range:
    """Return the numbers of the logs that are compared with the others: of two, the second."""
    return range(logs) if logs > 2 else range(1, logs)


def compared(
    rows: ModelRows, logs: Sequence[str], common: Sequence[str], tuning: ConsistencyTuning
) -> Consistency:
    """Compare the common parameters of the named logs.

    Each difference is a column: that of the parameter in the rows of one log, zero in the others.
    It is tested as a term of the model is, robust to correlated residuals, and its p-value is
    multiplied by the number of differences (Bonferroni). The clearest difference joins the model
    before the search continues. Of two logs, the second is compared with the first.
    """
    if rows.log is None or not common:
        none = np.zeros((0, len(rows.names)))
        return Consistency(p_value=None, deviations=(), shifts=none, rows=rows)
    pairs = [(k, rows.names.index(name)) for k in compared_logs(len(logs)) for name in common]
    columns, overall = rows.columns, None
    found: list[tuple[_Trial, float]] = []  # with p-values over all differences tried
    while pairs:
        basis = Basis.of(columns, rows.target, rows.log)
        trials = [_tried(rows, basis, columns, *pair, tuning) for pair in pairs]
        trials = [trial for trial in trials if trial is not None]
        if overall is None and trials:
            overall = min(len(trials) * min(trial.p_value for trial in trials), 1.0)
        clear = [each for each in trials if each.p_value * len(trials) < tuning.error_rate]
        if not clear:
            break
        best = max(clear, key=lambda trial: trial.explained)
        found.append((best, min(best.p_value * len(trials), 1.0)))
        columns = np.column_stack([columns, _column(rows, best.log, best.parameter)])
        pairs.remove((best.log, best.parameter))
    p = len(rows.names)
    values = least_squares(columns, rows.target)
    deviations: list[LogDeviation] = []
    shifts: list[Float[np.ndarray, " p"]] = []
    # Each difference beside all the others: the first ones changed as more were found
    for place, (trial, p_value) in enumerate(found, p):
        others = np.delete(columns, place, axis=1)
        basis = Basis.of(others, rows.target, rows.log)
        partial = basis.partial(columns[:, place : place + 1]) or trial.partial
        final = replace(trial, partial=partial, p_value=p_value)
        deviations.append(_deviation(rows, others, basis, final, logs, tuning))
        shift = values[:p] - least_squares(others, rows.target)[:p]
        shift[trial.parameter] = partial.values[0]
        shifts.append(shift)
    explained = columns[:, p:] @ values[p:]
    return Consistency(
        p_value=overall,
        deviations=tuple(deviations),
        shifts=np.array(shifts).reshape(-1, len(rows.names)),
        rows=replace(rows, target=rows.target - explained),
    )


def _column(rows: ModelRows, log: int, parameter: int) -> Float[np.ndarray, " n"]:
    return np.where(rows.log == log, rows.columns[:, parameter], 0.0)


def _tried(
    rows: ModelRows,
    basis: Basis,
    columns: Float[np.ndarray, "n q"],
    log: int,
    parameter: int,
    tuning: ConsistencyTuning,
) -> _Trial | None:
    """Return the difference of a parameter in a log; None if the rows do not determine it."""
    column = _column(rows, log, parameter)[:, None]
    if smallest_ratio(np.column_stack([columns, column])) < tuning.smallest_ratio:
        return None
    partial = basis.partial(column)
    if partial is None:
        return None
    p_value = significance(basis, partial)
    return _Trial(log=log, parameter=parameter, partial=partial, p_value=p_value)


def _deviation(
    rows: ModelRows,
    columns: Float[np.ndarray, "n q"],
    basis: Basis,
    trial: _Trial,
    logs: Sequence[str],
    tuning: ConsistencyTuning,
) -> LogDeviation:
    """Return a difference in the parameter's unit, over the value of the other logs."""
    difference = float(trial.partial.values[0])
    vectors = np.column_stack([basis.vectors, trial.partial.vectors])
    residual = basis.residual - trial.partial.vectors @ trial.partial.coordinates
    found = robust_uncertainty(vectors, np.eye(vectors.shape[1])[-1:], residual, log=rows.log)
    ratio = abs(difference / float(trial.partial.coordinates[0]))  # from coordinates to values
    column = _column(rows, trial.log, trial.parameter)
    joined = np.column_stack([columns, column])
    value = float(least_squares(joined, rows.target)[trial.parameter])
    relative = difference / (value or float(np.finfo(float).tiny))
    own = rows.log == trial.log
    effect = float(np.linalg.norm(column[own])) * abs(difference)
    share = effect / max(float(np.linalg.norm(rows.target[own])), np.finfo(float).tiny)
    return LogDeviation(
        log=logs[trial.log],
        parameter=rows.names[trial.parameter],
        difference=difference,
        std=ratio * float(np.sqrt(found.covariance[0, 0])),
        relative=relative,
        p_value=trial.p_value,
        material=abs(relative) > tuning.smallest_difference and share > tuning.smallest_share,
    )
