"""Judge estimates on a log: agreement of halves, of repeats, with a reference, and prediction."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

import stickslip
from stickslip.estimation import predict_effort
from stickslip.friction.estimated_law import is_velocity_term, law_columns, law_effort
from stickslip.records import AxisLog, FrictionEstimate, InputError
from studies.real_axes.logs import RealLog, ReferenceValue
from studies.real_axes.reference import (
    FEWEST_ROWS,
    PLAIN_TERMS,
    FilteredLog,
    MotionRows,
    find_delay,
    fit_rows,
    relative_error,
)

NO_WORSE = 1.05
"""Largest ratio of an estimate's prediction error to that of least squares with the same terms that
counts as "no worse" [-]; the cutoff of the reference changes it by about 5 %."""

TRUSTED = "ok"
USABLE = frozenset({TRUSTED, "not_identifiable"})
"""Statuses whose values can be used."""

_REST = 0.02  # speed of a rest over the 95 % quantile of the speed [-]
_REST_SEARCH = 0.15  # of the log, on either side of its middle, in which it may be divided [-]
_TOLERANCE = 0.05  # least tolerance of a least-squares reference over its value [-]
_LARGEST_TOLERANCE = 0.5  # tolerance over the value [-], from which there is no reference
_BOTH_WAYS = 0.02  # least share of the moving rows in each direction [-]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of `stickslip.identify` for a log."""

    #: Status of the estimate; ``"refused"`` after an input error, ``"crash"`` after any other.
    status: str
    message: str = ""  #: The error, or empty.
    #: Value of each parameter [SI]; those that are not identified are absent.
    values: Mapping[str, float] = field(default_factory=dict)
    #: Half of each 95 % interval [same unit].
    half_widths: Mapping[str, float] = field(default_factory=dict)
    #: Viscous and Coulomb friction and offset of the nearest plain law over the speeds of the log:
    #: value and half of the 95 % interval [same unit].
    plain: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)  #: Unit of each parameter.
    selected: tuple[str, ...] = ()  #: Terms that were selected.
    notes: tuple[str, ...] = ()  #: Notes of the diagnostics.
    seconds: float = math.nan  #: Time of the call [s].

    @property
    def law(self) -> frozenset[str]:
        """Parameters of the law of effort over velocity."""
        return frozenset(name for name in self.values if is_velocity_term(name))

    def comparable(self, *, plain: bool) -> dict[str, tuple[float, float]]:
        """Return value and half of the 95 % interval by parameter, of the plain law if asked."""
        own = {name: (self.values[name], half) for name, half in self.half_widths.items()}
        if not plain or not self.plain:
            return own
        return {n: pair for n, pair in own.items() if n not in self.law} | dict(self.plain)


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """Two values of one parameter and whether they agree."""

    #: The values [SI].
    first: float
    second: float
    allowed: float  #: Largest difference that counts as agreement [same unit].

    @property
    def agree(self) -> bool:
        """Whether the difference is within what is allowed."""
        return abs(self.first - self.second) <= self.allowed

    @property
    def z(self) -> float:
        """Difference in standard deviations, with 1.96 for the largest that is allowed [-]."""
        return 1.96 * (self.first - self.second) / self.allowed


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """Results of the study for one log."""

    log: RealLog  #: The log.
    #: Outcome for the whole log and for its halves.
    whole: Outcome
    first: Outcome
    second: Outcome
    halves: Mapping[str, Agreement]  #: Agreement of the halves by parameter.
    reference: Mapping[str, ReferenceValue]  #: Reference values by parameter.
    inside: Mapping[str, Agreement]  #: Agreement of the whole log's estimate with the reference.
    delay: float  #: Delay of the effort in the reference fit of the whole log [s].
    #: Terms of the law that the estimate returned, for the reference with the same terms.
    terms: tuple[str, ...]
    #: Relative error of the effort on the other half, mean of both ways [-]: ``"estimate"``,
    #: ``"same_terms"`` for least squares with the same terms, ``"own_terms"`` for least squares
    #: with the terms that the machine needs.
    prediction: Mapping[str, float]

    @property
    def trusted(self) -> bool:
        """Whether the whole log has status ``ok``."""
        return self.whole.status == TRUSTED

    @property
    def usable(self) -> bool:
        """Whether the values of the whole log can be used."""
        return self.whole.status in USABLE

    @property
    def usable_halves(self) -> bool:
        """Whether the values of both halves can be used."""
        return {self.first.status, self.second.status} <= USABLE

    @property
    def prediction_ratio(self) -> float:
        """Prediction error of the estimate over that of least squares with the same terms [-]."""
        return self.prediction["estimate"] / self.prediction["same_terms"]

    @property
    def faults(self) -> tuple[str, ...]:
        """Faults of values that can be used; empty if there are none."""
        if not self.usable:
            return ()
        found = [] if self.log.usable or not self.trusted else ["no effort law fits this log"]
        if self.usable_halves:
            found += [f"halves differ: {name}" for name, a in self.halves.items() if not a.agree]
        found += [f"reference outside: {name}" for name, a in self.inside.items() if not a.agree]
        if self.prediction_ratio > NO_WORSE:
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
            "halves": {
                name: asdict(a) | {"agree": a.agree, "z": a.z} for name, a in self.halves.items()
            },
            "reference": {name: asdict(value) for name, value in self.reference.items()},
            "inside": {
                name: asdict(a) | {"agree": a.agree, "z": a.z} for name, a in self.inside.items()
            },
            "delay": self.delay,
            "terms": list(self.terms),
            "prediction": dict(self.prediction),
            "faults": list(self.faults),
        }


def judge(real: RealLog, tick: Callable[[str], None]) -> Judgement:
    """Identify a log and its halves, and compare; ``tick`` is called with the name of each step."""
    split = split_index(real.log)
    parts = (real.log.part(0, split), real.log.part(split, len(real.log)))
    found: list[tuple[Outcome, Any]] = []
    for what, log in (("whole", real.log), ("first half", parts[0]), ("second half", parts[1])):
        tick(what)
        found.append(_identify(log, real))
    tick("reference")
    (whole, _), (first, _), (second, _) = found
    reference, delay = _reference_of(real, parts)
    terms = _terms_of(first.values)
    ours = whole.comparable(plain=True)
    if not set(_terms_of(whole.values)) & _OF_POSITION <= set(real.terms):
        ours.pop("offset", None)  # it contains the force of the spring at the origin
    return Judgement(
        log=real,
        whole=whole,
        first=first,
        second=second,
        halves=_agreements(first, second),
        reference=reference,
        inside={
            name: Agreement(
                first=ours[name][0], second=known.value, allowed=ours[name][1] + known.tolerance
            )
            for name, known in reference.items()
            if name in ours
        },
        delay=delay,
        terms=terms,
        prediction=_predictions(real, parts, (found[1], found[2])),
    )


def split_index(log: AxisLog) -> int:
    """Return the sample that divides a log: at the rest nearest to its middle, or at the middle."""
    middle = int(np.searchsorted(log.time, (log.time[0] + log.time[-1]) / 2))
    reach = int(_REST_SEARCH * len(log))
    window = max(1, len(log) // 500)
    speed = np.abs(np.gradient(log.measured_position, log.time))
    speed = np.convolve(speed, np.ones(window) / window, mode="same")
    near = np.arange(max(middle - reach, 2), min(middle + reach, len(log) - 2))
    resting = near[speed[near] < _REST * np.quantile(speed, 0.95)]
    return middle if not resting.size else int(resting[np.argmin(np.abs(resting - middle))])


def _identify(log: AxisLog, real: RealLog) -> tuple[Outcome, Any]:
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
    values = {name: float(p.value) for name, p in known.items() if p.value is not None}
    half_widths = {name: (p.ci95[1] - p.ci95[0]) / 2 for name, p in known.items() if p.ci95}
    return Outcome(
        status=estimate.status.value,
        selected=() if estimate.selection is None else estimate.selection.selected,
        values=values,
        half_widths=half_widths,
        plain=_plain(estimate, real),
        units={name: p.unit for name, p in known.items()},
        notes=tuple(getattr(estimate.diagnostics, "notes", ())),
        seconds=time.perf_counter() - start,
    ), found


def _plain(estimate: FrictionEstimate, real: RealLog) -> dict[str, tuple[float, float]]:
    """Return viscous and Coulomb friction and offset of the nearest plain law.

    The law of an estimate is projected on these three terms over the speeds of the whole log. A
    nonlinear law, or one for each direction, can then be compared with the values of a plain one.
    Empty if a parameter of the law is not identified.
    """
    names = [name for name in estimate.parameters if is_velocity_term(name)]
    if not all(estimate.parameters[name].identified for name in names):
        return {}
    values = {name: estimate.value(name) for name in names}
    rows = real.filtered().rows()
    velocity = rows.velocity[rows.moving]
    if velocity.size < FEWEST_ROWS or not _both_ways(rows):
        return {}
    sign = np.sign(velocity)
    to_plain = np.linalg.pinv(np.column_stack([velocity, sign, np.ones(sign.size)]))
    jacobian = to_plain @ law_columns(names, velocity, sign, values)
    found = to_plain @ law_effort(values, velocity, sign)
    every = [name for name, p in estimate.parameters.items() if p.identified]
    keep = [every.index(name) for name in names]
    covariance = jacobian @ estimate.covariance[np.ix_(keep, keep)] @ jacobian.T
    quantile = max(estimate.parameters[name].quantile for name in names)
    half = quantile * np.sqrt(np.diag(covariance))
    plain = ("viscous_friction", "coulomb_friction", "offset")
    return {name: (float(v), float(h)) for name, v, h in zip(plain, found, half, strict=True)}


def _failed(status: str, error: Exception, start: float) -> Outcome:
    return Outcome(
        status=status,
        message=f"{type(error).__name__}: {error}",
        seconds=time.perf_counter() - start,
    )


def _agreements(first: Outcome, second: Outcome) -> dict[str, Agreement]:
    plain = first.law != second.law
    ours, theirs = first.comparable(plain=plain), second.comparable(plain=plain)
    return {
        name: Agreement(
            first=ours[name][0],
            second=theirs[name][0],
            allowed=math.hypot(ours[name][1], theirs[name][1]),
        )
        for name in ours
        if name in theirs
    }


def repeats_agree(judgements: Sequence[Judgement]) -> dict[str, dict[str, Any]]:
    """Return the agreement of repeats by group and parameter, for those with usable values.

    Returns
    -------
    By group and parameter: number of pairs, number that agree, spread of the values over their
    mean, and the largest half-width over the smallest.
    """
    groups: dict[str, list[Judgement]] = {}
    for judgement in judgements:
        if judgement.log.group is not None and judgement.usable:
            groups.setdefault(judgement.log.group, []).append(judgement)
    out: dict[str, dict[str, Any]] = {}
    for group, members in groups.items():
        if len(members) < 2:
            continue
        plain = len({m.whole.law for m in members}) > 1
        tables = [m.whole.comparable(plain=plain) for m in members]
        names = set.intersection(*({*table} for table in tables))
        out[group] = {name: _spread([table[name] for table in tables]) for name in sorted(names)}
    return out


def _spread(pairs: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Return how the values and half-widths of repeats agree."""
    agree = [abs(a[0] - b[0]) <= math.hypot(a[1], b[1]) for a, b in combinations(pairs, 2)]
    values, widths = np.array(pairs).T
    return {
        "logs": len(pairs),
        "pairs": len(agree),
        "agree": sum(agree),
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
    A least-squares value of others has at least the tolerance of what half of the cutoff changes.
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
    for name, known in real.reference.items():
        term = "inertia" if name == mass else name
        if known.source.startswith("least squares") and changed is not None and term in fit.values:
            doubt = abs(changed.values[term] - fit.values[term])
            made[name] = replace(known, tolerance=max(known.tolerance, doubt))
        else:
            made[name] = known
    return made, delay


_TERMS_OF: Mapping[str, tuple[str, ...]] = {
    "viscous_friction_positive": ("viscous_asymmetry",),
    "static_friction": ("stribeck",),
    "static_friction_positive": ("stribeck",),
    "low_speed_friction": ("stribeck",),
    "quadratic_friction": ("quadratic",),
    "two_thirds_friction": ("two_thirds",),
    "presliding_friction": (),
    "spring_stiffness": ("spring",),
    "gravity_sine": ("gravity_sine",),
    "gravity_cosine": ("gravity_cosine",),
    "ripple_sine": ("ripple_sine",),
    "ripple_cosine": ("ripple_cosine",),
    "offset_drift": ("drift_offset",),
    "friction_drift": ("drift_coulomb", "drift_viscous"),
    "gain_drift": ("drift_offset", "drift_coulomb", "drift_viscous"),
}
"""By parameter: terms of the reference beyond the plain ones that stand for it."""


_OF_POSITION = {"spring", "gravity_sine", "gravity_cosine"}


def _terms_of(parameters: Mapping[str, float]) -> tuple[str, ...]:
    """Return the reference's terms for the law with these parameters."""
    further = [term for name in parameters for term in _TERMS_OF.get(name, ())]
    return (*PLAIN_TERMS, *dict.fromkeys(further))


def _predictions(
    real: RealLog, parts: tuple[AxisLog, AxisLog], found: Sequence[tuple[Outcome, Any]]
) -> dict[str, float]:
    """Return the relative error of the effort on the other half, mean of both ways [-].

    All three are compared on the same rows. A half that moves one way only does not determine
    Coulomb friction and offset: NaN.
    """
    errors: dict[str, list[float]] = {"estimate": [], "same_terms": [], "own_terms": []}
    for (outcome, identification), train, test in (
        (found[0], *parts),
        (found[1], parts[1], parts[0]),
    ):
        filtered, target = real.filtered(train), real.filtered(test)
        if not _both_ways(filtered.rows()):
            return dict.fromkeys(errors, math.nan)
        predicted, usable = _predicted(identification, test, target)
        for key, terms in (("own_terms", real.terms), ("same_terms", _terms_of(outcome.values))):
            rippled = any(term.startswith("ripple") for term in terms)
            shapes = {"ripple": _ripple(identification)} if rippled else {}
            linear = tuple(t for t in terms if not t.startswith(("stribeck", "ripple")))
            delay = find_delay(filtered, linear)
            fit = fit_rows(filtered.rows(delay), terms, shapes)
            rows = replace(target.rows(delay), moving=usable)
            errors[key].append(math.nan if fit is None else relative_error(rows, fit.predict(rows)))
        rows = replace(target.rows(), moving=usable)
        errors["estimate"].append(relative_error(rows, predicted))
    return {name: float(np.mean(pair)) for name, pair in errors.items()}


def _both_ways(rows: MotionRows) -> bool:
    forward = float(np.mean(rows.velocity[rows.moving] > 0)) if rows.moving.any() else 0.0
    return _BOTH_WAYS < forward < 1.0 - _BOTH_WAYS


def _ripple(identification: Any) -> float:
    """Return the period of the ripple that was selected [m or rad]."""
    return next(s.shape for s in identification.estimate.selection.scores if s.term == "ripple")


def _predicted(
    identification: Any, test: AxisLog, target: FilteredLog
) -> tuple[Float[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """Return the effort that an estimate predicts, low-passed, and the moving rows that have one.

    Samples without a prediction take the logged effort, so that the low-pass carries nothing else
    into the rows beside them.
    """
    rows = target.rows()
    try:
        # The low-pass of the reference smooths it
        effort = predict_effort(identification.estimate, test, window=0.0)
    except (AttributeError, InputError):  # refused or not identified
        return np.full(rows.time.size, np.nan), rows.moving
    known = np.isfinite(effort)
    filled = replace(target, effort=np.where(known, effort, test.effort))
    usable = rows.moving & (np.interp(rows.time, test.time, known.astype(float)) == 1.0)
    return filled.rows().effort, usable
