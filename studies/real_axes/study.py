"""Judge estimates on a log: agreement of halves, of repeats, with a reference, and prediction."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Float

import stickslip
from stickslip.records import AxisLog, InputError
from studies.real_axes.logs import RealLog, ReferenceValue
from studies.real_axes.reference import (
    PLAIN_TERMS,
    FilteredLog,
    MotionRows,
    find_delay,
    fit_rows,
    relative_error,
)

__all__ = [
    "NO_WORSE",
    "Agreement",
    "Judgement",
    "Outcome",
    "judge",
    "repeats_agree",
    "split_index",
]

NO_WORSE = 1.05
"""Largest ratio of an estimate's prediction error to that of least squares with the same terms that
counts as "no worse" [-]; 5 % is about what the choice of the reference's cutoff moves it by."""

TRUSTED = "ok"

_REST = 0.02
_REST_SEARCH = 0.15
_TOLERANCE = 0.05
_LARGEST_TOLERANCE = 0.5
_BOTH_WAYS = 0.02


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What `stickslip.identify` returned for a log.

    Attributes
    ----------
    status
        Status of the estimate; ``"refused"`` after an input error, ``"crash"`` after any other.
    message
        The error, or empty.
    values
        Value of each parameter [SI]; those that are not identified are absent.
    half_widths
        Half of each 95 % interval [same unit].
    units
        Unit of each parameter.
    notes
        Notes of the diagnostics.
    seconds
        Time of the call [s].
    """

    status: str
    message: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    half_widths: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    seconds: float = math.nan


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Two values of one parameter and whether they agree.

    Attributes
    ----------
    first, second
        The values [SI].
    allowed
        Largest difference that counts as agreement [same unit].
    """

    first: float
    second: float
    allowed: float

    @property
    def agree(self) -> bool:
        """Whether the difference is within what is allowed."""
        return abs(self.first - self.second) <= self.allowed


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """Everything that the study says about one log.

    Attributes
    ----------
    log
        The log.
    whole, first, second
        Outcome for the whole log and for its halves.
    halves
        Agreement of the halves by parameter.
    reference
        Reference values by parameter.
    inside
        Agreement of the whole log's estimate with the reference.
    delay
        Delay of the effort that suits the reference fit of the whole log best [s].
    terms
        Terms of the law that the estimate returned, for the reference with the same terms.
    prediction
        Relative error of the effort on the other half, mean of both ways [-]: ``"estimate"``,
        ``"same_terms"`` for least squares with the same terms, ``"own_terms"`` for least squares
        with the terms that the machine needs.
    """

    log: RealLog
    whole: Outcome
    first: Outcome
    second: Outcome
    halves: Mapping[str, Agreement]
    reference: Mapping[str, ReferenceValue]
    inside: Mapping[str, Agreement]
    delay: float
    terms: tuple[str, ...]
    prediction: Mapping[str, float]

    @property
    def trusted(self) -> bool:
        """Whether the whole log has status ``ok``."""
        return self.whole.status == TRUSTED

    @property
    def prediction_ratio(self) -> float:
        """Prediction error of the estimate over that of least squares with the same terms [-]."""
        return self.prediction["estimate"] / self.prediction["same_terms"]

    @property
    def faults(self) -> tuple[str, ...]:
        """What is wrong with a result that claims to be right; empty without status ``ok``."""
        if not self.trusted:
            return ()
        found = [] if self.log.usable else ["no effort law fits this log"]
        both = self.first.status == self.second.status == TRUSTED
        if both:
            found += [f"halves differ: {name}" for name, a in self.halves.items() if not a.agree]
        found += [f"reference outside: {name}" for name, a in self.inside.items() if not a.agree]
        if both and self.prediction_ratio > NO_WORSE:
            found.append(f"predicts worse, x {self.prediction_ratio:.2f}")
        return tuple(found)

    def to_dict(self) -> dict[str, Any]:
        """Return the judgement as plain JSON types."""
        return {
            "name": self.log.name,
            "machine": self.log.machine,
            "group": self.log.group,
            "usable": self.log.usable,
            "samples": len(self.log.log),
            "sampling_time": self.log.log.sampling_time,
            "segments": int(self.log.log.segment_starts.size),
            "timing_jitter": self.log.log.timing_jitter,
            "effort_unit": self.log.effort_unit,
            "remark": self.log.remark,
            "whole": asdict(self.whole),
            "first_half": asdict(self.first),
            "second_half": asdict(self.second),
            "halves": {name: asdict(a) | {"agree": a.agree} for name, a in self.halves.items()},
            "reference": {name: asdict(value) for name, value in self.reference.items()},
            "inside": {name: asdict(a) | {"agree": a.agree} for name, a in self.inside.items()},
            "delay": self.delay,
            "terms": list(self.terms),
            "prediction": dict(self.prediction),
            "faults": list(self.faults),
        }


def judge(real: RealLog, tick: Callable[[str], None]) -> Judgement:
    """Identify a log and its halves, and compare.

    Parameters
    ----------
    real
        The log.
    tick
        Called before each step with its name.
    """
    split = split_index(real.log)
    parts = (real.log.part(0, split), real.log.part(split, len(real.log)))
    found: list[tuple[Outcome, Any]] = []
    for what, log in (("whole", real.log), ("first half", parts[0]), ("second half", parts[1])):
        tick(what)
        found.append(_identify(log))
    tick("reference")
    (whole, _), (first, _), (second, _) = found
    reference, delay = _reference_of(real, parts)
    terms = _terms_of(first.values)
    return Judgement(
        log=real,
        whole=whole,
        first=first,
        second=second,
        halves=_agreements(first, second),
        reference=reference,
        inside={
            name: Agreement(
                first=whole.values[name],
                second=known.value,
                allowed=whole.half_widths[name] + known.tolerance,
            )
            for name, known in reference.items()
            if name in whole.half_widths
        },
        delay=delay,
        terms=terms,
        prediction=_predictions(real, parts, (found[1], found[2])),
    )


def split_index(log: AxisLog) -> int:
    """Return where a log is cut: at the rest nearest to its middle in time, or at the middle."""
    middle = int(np.searchsorted(log.time, (log.time[0] + log.time[-1]) / 2))
    reach = int(_REST_SEARCH * len(log))
    window = max(1, len(log) // 500)
    speed = np.abs(np.gradient(log.measured_position, log.time))
    speed = np.convolve(speed, np.ones(window) / window, mode="same")
    near = np.arange(max(middle - reach, 2), min(middle + reach, len(log) - 2))
    resting = near[speed[near] < _REST * np.quantile(speed, 0.95)]
    return middle if not resting.size else int(resting[np.argmin(np.abs(resting - middle))])


def _identify(log: AxisLog) -> tuple[Outcome, Any]:
    """Return the outcome, and what `stickslip.identify` returned, None after an error."""
    start = time.perf_counter()
    try:
        found = stickslip.identify(log)
    except InputError as error:
        return _failed("refused", error, start), None
    except Exception as error:  # noqa: BLE001 - a crash is a result of this study
        return _failed("crash", error, start), None
    estimate = found.estimate
    known = {name: p for name, p in estimate.parameters.items() if p.value is not None}
    return Outcome(
        status=estimate.status.value,
        values={name: float(p.value) for name, p in known.items() if p.value is not None},
        half_widths={name: float(p.ci95[1] - p.ci95[0]) / 2 for name, p in known.items() if p.ci95},
        units={name: p.unit for name, p in known.items()},
        notes=tuple(getattr(estimate.diagnostics, "notes", ())),
        seconds=time.perf_counter() - start,
    ), found


def _failed(status: str, error: Exception, start: float) -> Outcome:
    return Outcome(
        status=status,
        message=f"{type(error).__name__}: {error}",
        seconds=time.perf_counter() - start,
    )


def _agreements(first: Outcome, second: Outcome) -> dict[str, Agreement]:
    shared = [name for name in first.half_widths if name in second.half_widths]
    return {
        name: Agreement(
            first=first.values[name],
            second=second.values[name],
            allowed=math.hypot(first.half_widths[name], second.half_widths[name]),
        )
        for name in shared
    }


def repeats_agree(judgements: Sequence[Judgement]) -> dict[str, dict[str, Any]]:
    """Return for each group and parameter how the repeats agree, over those with status ``ok``.

    Returns
    -------
    By group and parameter: number of pairs, number that agree, spread of the values over their
    mean, and the largest half-width over the smallest.
    """
    groups: dict[str, list[Judgement]] = {}
    for judgement in judgements:
        if judgement.log.group is not None and judgement.trusted:
            groups.setdefault(judgement.log.group, []).append(judgement)
    out: dict[str, dict[str, Any]] = {}
    for group, members in groups.items():
        if len(members) < 2:
            continue
        names = set.intersection(*({*m.whole.half_widths} for m in members))
        out[group] = {name: _spread(members, name) for name in sorted(names)}
    return out


def _spread(members: Sequence[Judgement], name: str) -> dict[str, float]:
    pairs = [_agreements(a.whole, b.whole)[name].agree for a, b in combinations(members, 2)]
    values = np.array([m.whole.values[name] for m in members])
    widths = np.array([m.whole.half_widths[name] for m in members])
    return {
        "logs": len(members),
        "pairs": len(pairs),
        "agree": sum(pairs),
        "mean": float(values.mean()),
        "relative_spread": float(np.ptp(values) / abs(values.mean())),
        "half_width_ratio": float(widths.max() / widths.min()),
    }


def _reference_of(
    real: RealLog, parts: tuple[AxisLog, AxisLog]
) -> tuple[dict[str, ReferenceValue], float]:
    """Return the reference values, least squares where nothing is published, and the delay [s].

    The tolerance of a least-squares value is the largest of 5 %, half of the difference between the
    halves, and what half of the cutoff changes; a value that is doubtful by half of itself is none.
    """
    whole = real.filtered()
    delay = find_delay(whole, real.terms)
    mass = "mass" if real.log.kind == "linear" else "inertia"
    fit = fit_rows(whole.rows(delay), real.terms)
    if fit is None or not real.usable:
        return dict(real.reference), delay
    others = [fit_rows(real.filtered(part).rows(delay), real.terms) for part in parts]
    slower = replace(whole, cutoff=whole.cutoff / 2)
    changed = fit_rows(slower.rows(find_delay(slower, real.terms)), real.terms)
    made: dict[str, ReferenceValue] = {}
    for term in real.fitted:
        value = fit.values[term]
        halves = [other.values[term] for other in others if other is not None]
        doubt = [_TOLERANCE * abs(value)]
        doubt += [abs(halves[0] - halves[1]) / 2] if len(halves) > 1 else []
        doubt += [abs(changed.values[term] - value)] if changed is not None else []
        if max(doubt) < _LARGEST_TOLERANCE * value:
            made[mass if term == "inertia" else term] = ReferenceValue(
                value=value, tolerance=max(doubt), source="least squares here"
            )
    return made | dict(real.reference), delay


_Column = Callable[[MotionRows], Float[np.ndarray, " n"]]

_ESTIMATED: Mapping[str, tuple[tuple[str, ...], _Column]] = {
    "mass": (("inertia",), lambda r: r.acceleration),
    "inertia": (("inertia",), lambda r: r.acceleration),
    "viscous_friction": (("viscous_friction",), lambda r: r.velocity),
    "viscous_friction_positive": (
        ("viscous_friction", "viscous_asymmetry"),
        lambda r: r.velocity * (r.velocity > 0),
    ),
    "viscous_friction_negative": (
        ("viscous_friction", "viscous_asymmetry"),
        lambda r: r.velocity * (r.velocity < 0),
    ),
    "coulomb_friction": (("coulomb_friction",), lambda r: np.sign(r.velocity)),
    "coulomb_friction_positive": (
        ("coulomb_friction", "offset"),
        lambda r: 1.0 * (r.velocity > 0),
    ),
    "coulomb_friction_negative": (
        ("coulomb_friction", "offset"),
        lambda r: -1.0 * (r.velocity < 0),
    ),
    "offset": (("offset",), lambda r: np.ones_like(r.velocity)),
}
"""By parameter: terms of the reference that span its column, and the column."""

_FURTHER_TERMS: Mapping[str, tuple[str, ...]] = {
    "gravity": ("gravity_sine", "gravity_cosine"),
    "spring": ("spring",),
    "stiffness": ("spring",),
    "stribeck": ("stribeck",),
    "static": ("stribeck",),
    "quadratic": ("quadratic",),
    "two_thirds": ("two_thirds",),
    "power": ("two_thirds",),
    "drift": ("drift_offset", "drift_coulomb"),
}
"""By a part of a parameter's name: terms of the reference that stand for it."""


def _terms_of(parameters: Mapping[str, float]) -> tuple[str, ...]:
    """Return the reference's terms for the law with these parameters."""
    terms = list(PLAIN_TERMS)
    for name in parameters:
        own = _ESTIMATED[name][0] if name in _ESTIMATED else ()
        further = (t for part, ts in _FURTHER_TERMS.items() if part in name for t in ts)
        terms += [term for term in (*own, *further) if term not in terms]
    return tuple(terms)


def _predictions(
    real: RealLog, parts: tuple[AxisLog, AxisLog], found: Sequence[tuple[Outcome, Any]]
) -> dict[str, float]:
    """Return the relative error of the effort on the other half, mean of both ways [-].

    A half that moves one way only does not tell Coulomb friction from the offset: NaN.
    """
    errors: dict[str, list[float]] = {"estimate": [], "same_terms": [], "own_terms": []}
    for (outcome, identification), train, test in (
        (found[0], *parts),
        (found[1], parts[1], parts[0]),
    ):
        filtered, target = real.filtered(train), real.filtered(test)
        if not _both_ways(filtered.rows()):
            return dict.fromkeys(errors, math.nan)
        delay = 0.0
        for key, terms in (("own_terms", real.terms), ("same_terms", _terms_of(outcome.values))):
            delay = find_delay(filtered, tuple(t for t in terms if t != "stribeck"))
            fit = fit_rows(filtered.rows(delay), terms)
            rows = target.rows(delay)
            errors[key].append(math.nan if fit is None else relative_error(rows, fit.predict(rows)))
        errors["estimate"].append(_prediction_error(outcome, identification, test, target, delay))
    return {name: float(np.mean(pair)) for name, pair in errors.items()}


def _both_ways(rows: MotionRows) -> bool:
    forward = float(np.mean(rows.velocity[rows.moving] > 0)) if rows.moving.any() else 0.0
    return _BOTH_WAYS < forward < 1.0 - _BOTH_WAYS


def _prediction_error(
    outcome: Outcome, identification: Any, test: AxisLog, target: FilteredLog, delay: float
) -> float:
    """Return the relative error of an estimate's prediction; NaN without a complete law [-].

    An estimate that predicts efforts predicts the logged effort, its delay included. The plain
    parameters are judged on the effort without the delay of the least-squares fit.
    """
    if identification is None:
        return math.nan
    for holder in (identification.estimate, identification):
        predict = getattr(holder, "predict_effort", None)
        if predict is not None:
            predicted = np.nan_to_num(np.asarray(predict(test), dtype=float))
            rows = target.rows()
            return relative_error(rows, replace(target, effort=predicted).rows().effort)
    rows = target.rows(delay)
    known = [name for name in outcome.values if name in _ESTIMATED]
    if not any(name.startswith("coulomb") for name in known):
        return math.nan
    return relative_error(
        rows, sum((outcome.values[n] * _ESTIMATED[n][1](rows) for n in known), np.zeros(1))
    )
