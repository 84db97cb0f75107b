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
from stickslip.records import LogDeviation, quantity_name

_OF_EVERY_AXIS = ("mass", "inertia", "viscous_friction", "coulomb_friction")
"""Quantities that differ together in a log of another axis, or with an effort in another unit."""


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
    It is tested as a term of the model is, robust to correlated residuals. A log of another axis
    differs in inertia and all friction, where one difference alone leaves the residual of the
    others; each of these is therefore also tested beside the others of its log. A p-value is
    multiplied by the number of tests (Bonferroni). The difference that explains most joins the
    model before the search continues; if none is significant alone, those of one log that are
    significant beside each other. Of two logs, the second is compared with the first.
    """
    if rows.log is None or not common:
        none = np.zeros((0, len(rows.names)))
        return Consistency(p_value=None, deviations=(), shifts=none, rows=rows)
    pairs = [(k, rows.names.index(name)) for k in compared_logs(len(logs)) for name in common]
    columns, overall = rows.columns, None
    found: list[tuple[_Trial, float]] = []  # with p-values over all tests
    while pairs:
        basis = Basis.of(columns, rows.target, rows.log)
        alone = [_tried(rows, basis, columns, *pair, tuning) for pair in pairs]
        alone = [trial for trial in alone if trial is not None]
        beside = _tried_beside(rows, columns, pairs, tuning)
        tests = len(alone) + len(beside)
        if overall is None and tests:
            overall = min(tests * min(trial.p_value for trial in (*alone, *beside)), 1.0)
        joining = _joining(
            [trial for trial in alone if trial.p_value * tests < tuning.error_rate],
            [trial for trial in beside if trial.p_value * tests < tuning.error_rate],
        )
        if not joining:
            break
        for trial in joining:
            found.append((trial, min(trial.p_value * tests, 1.0)))
            columns = np.column_stack([columns, _lighter(rows, trial.log, trial.parameter)])
            pairs.remove((trial.log, trial.parameter))
    p = len(rows.names)
    every = [trial for trial, _ in found]
    values, differences = _solution(rows, every)
    deviations: list[LogDeviation] = []
    shifts: list[Float[np.ndarray, " p"]] = []
    # Each difference beside all the others: the first ones changed as more were found
    for place, (trial, p_value) in enumerate(found):
        others = np.delete(columns, p + place, axis=1)
        basis = Basis.of(others, rows.target, rows.log)
        partial = basis.partial(columns[:, p + place : p + place + 1]) or trial.partial
        final = replace(trial, partial=partial, p_value=p_value)
        value, difference = float(values[trial.parameter]), float(differences[place])
        deviations.append(_deviation(rows, basis, final, (value, difference), logs, tuning))
        shift = values - _solution(rows, every[:place] + every[place + 1 :])[0]
        shift[trial.parameter] = difference
        shifts.append(shift)
    explained = np.zeros(rows.target.size)
    for trial, difference in zip(every, differences, strict=True):
        explained += difference * _column(rows, trial.log, trial.parameter)
    return Consistency(
        p_value=overall,
        deviations=tuple(deviations),
        shifts=np.array(shifts).reshape(-1, p),
        rows=replace(rows, target=rows.target - explained),
    )


def _joining(alone: Sequence[_Trial], beside: Sequence[_Trial]) -> list[_Trial]:
    """Return which significant differences join the model: one alone, else those of one log."""
    if alone:
        return [max(alone, key=lambda trial: trial.explained)]
    if not beside:
        return []
    log = max(beside, key=lambda trial: trial.explained).log
    return [trial for trial in beside if trial.log == log]


def _solution(
    rows: ModelRows, trials: Sequence[_Trial]
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " k"]]:
    """Return the common parameters beside differences, and the differences [SI].

    The column of a common parameter is zero in the rows of a log with its own value, so that the
    columns are independent whatever the weights of the logs are.
    """
    columns, own = rows.columns.copy(), [_column(rows, t.log, t.parameter) for t in trials]
    for trial, column in zip(trials, own, strict=True):
        columns[:, trial.parameter] -= column
    values = least_squares(np.column_stack([columns, *own]), rows.target)
    common = values[: len(rows.names)]
    return common, values[len(rows.names) :] - common[[t.parameter for t in trials]]


def _column(rows: ModelRows, log: int, parameter: int) -> Float[np.ndarray, " n"]:
    return np.where(rows.log == log, rows.columns[:, parameter], 0.0)


def _lighter(rows: ModelRows, log: int, parameter: int) -> Float[np.ndarray, " n"]:
    """Return the column of a difference, or minus that of the other logs if it is smaller.

    Both have the same coefficient beside the column of the parameter. The larger one is nearly
    equal to that column if the log has a far higher weight than the others.
    """
    own = _column(rows, log, parameter)
    others = rows.columns[:, parameter] - own
    return own if np.linalg.norm(own) <= np.linalg.norm(others) else -others


def _tried_beside(
    rows: ModelRows,
    columns: Float[np.ndarray, "n q"],
    pairs: Sequence[tuple[int, int]],
    tuning: ConsistencyTuning,
) -> list[_Trial]:
    """Return the differences of inertia and friction, each beside the others of its log."""
    found: list[_Trial | None] = []
    for log in dict.fromkeys(log for log, _ in pairs):
        own = [p for k, p in pairs if k == log and quantity_name(rows.names[p]) in _OF_EVERY_AXIS]
        if len(own) < 2:  # it is tested alone
            continue
        for one in own:
            others = [_lighter(rows, log, other) for other in own if other != one]
            wider = np.column_stack([columns, *others])
            basis = Basis.of(wider, rows.target, rows.log)
            found.append(_tried(rows, basis, wider, log, one, tuning))
    return [trial for trial in found if trial is not None]


def _tried(
    rows: ModelRows,
    basis: Basis,
    columns: Float[np.ndarray, "n q"],
    log: int,
    parameter: int,
    tuning: ConsistencyTuning,
) -> _Trial | None:
    """Return the difference of a parameter in a log; None if the rows do not determine it."""
    column = _lighter(rows, log, parameter)[:, None]
    if smallest_ratio(np.column_stack([columns, column])) < tuning.smallest_ratio:
        return None
    partial = basis.partial(column)
    if partial is None:
        return None
    p_value = significance(basis, partial)
    return _Trial(log=log, parameter=parameter, partial=partial, p_value=p_value)


def _deviation(
    rows: ModelRows,
    basis: Basis,
    trial: _Trial,
    values: tuple[float, float],
    logs: Sequence[str],
    tuning: ConsistencyTuning,
) -> LogDeviation:
    """Return a difference in the parameter's unit, and relative to the value of the other logs.

    ``values`` are that value and the difference [SI]; the basis is that of all other columns.
    """
    value, difference = values
    vectors = np.column_stack([basis.vectors, trial.partial.vectors])
    residual = basis.residual - trial.partial.vectors @ trial.partial.coordinates
    found = robust_uncertainty(vectors, np.eye(vectors.shape[1])[-1:], residual, log=rows.log)
    # From coordinates to values
    ratio = abs(float(trial.partial.values[0]) / float(trial.partial.coordinates[0]))
    relative = difference / (value or float(np.finfo(float).tiny))
    own = rows.log == trial.log
    column = _column(rows, trial.log, trial.parameter)
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
