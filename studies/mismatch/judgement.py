"""Comparison of an identification with the truth of its log."""

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip import InputError, identify
from stickslip.records import FrictionEstimate, Identification
from studies.mismatch.cases import Recorded, record

LARGE_ERROR = 0.05
"""A relative error above this one is critical if the status is ``ok`` [-]."""

_CURVE_NAMES = (
    "coulomb_friction",
    "viscous_friction",
    "offset",
    "viscous_asymmetry",
    "static_friction",
    "stribeck_velocity",
    "quadratic_friction",
    "two_thirds_friction",
)
_SIDES = ("_positive", "_negative")


@dataclass(frozen=True, kw_only=True)
class Judged:
    """One parameter of one estimate."""

    #: Estimate and 95 % interval [SI].
    value: float
    low: float
    high: float
    truth: float  #: True value [SI].
    error: float  #: Estimate minus truth, over the scale of its error [-].

    @property
    def covered(self) -> bool:
        """Whether the interval contains the truth."""
        return self.low <= self.truth <= self.high

    @property
    def critical(self) -> bool:
        """Whether it does not, by a large error."""
        return not self.covered and abs(self.error) > LARGE_ERROR


def judge_run(case_name: str, seed: int, options: Mapping[str, Any]) -> dict[str, Any]:
    """Record one log, identify it and compare; return plain JSON types.

    ``options`` are arguments of ``identify`` beside those of the case. The keys are ``case``,
    ``seed``, ``status`` (of the estimate, ``refused: ...`` or ``crash: ...``), ``seconds``; of an
    estimate also ``ok``, ``model``, ``plain``, ``notes``, ``parameters``, ``unjudged`` (reported,
    without one true value), ``curve``, ``outside``, ``critical``, ``delay``, ``true_delay``
    [samples].
    """
    recorded = record(case_name, seed)
    run: dict[str, Any] = {"case": case_name, "seed": seed}
    start = perf_counter()
    try:
        found = identify(recorded.log, **{**recorded.settings, **options})
    except InputError as error:
        return run | {"status": _reason("refused", error), "seconds": perf_counter() - start}
    except Exception as error:  # noqa: BLE001 - a crash is a result of the study
        word = f"{type(error).__name__}: {error}"
        return run | {"status": _reason("crash", word), "seconds": perf_counter() - start}
    run["seconds"] = perf_counter() - start
    return run | judge(found, recorded)


def _reason(kind: str, message: object) -> str:
    """Return a status of one line with # in place of numbers."""
    first = str(message).strip().splitlines()[0] if str(message).strip() else "no message"
    return f"{kind}: " + re.sub(r"\d[\d.e+-]*", "#", first)[:150]


def judge(found: Identification, recorded: Recorded) -> dict[str, Any]:
    """Compare an identification with the truth; return plain JSON types."""
    estimate = found.estimate
    judged, unjudged = _judged(estimate, recorded)
    curve = _curve(found, recorded)
    names = {name for name, p in estimate.parameters.items() if p.value is not None}
    expected = {"viscous_friction", "coulomb_friction", "offset"}
    return {
        "status": estimate.status.value,
        "ok": estimate.status.trusted,
        "model": _model(estimate),
        "plain": names - {"mass", "inertia"} == expected
        if estimate.selection is None
        else not estimate.selection.selected,
        "notes": list(estimate.diagnostics.notes),
        "parameters": {
            name: asdict(p) | {"covered": p.covered, "critical": p.critical}
            for name, p in judged.items()
        },
        "unjudged": unjudged,
        "curve": curve,
        "outside": any(not p.covered for p in judged.values()),
        "critical": any(p.critical for p in judged.values()),
        "delay": None
        if estimate.selection is None
        else estimate.selection.effort_delay / recorded.log.sampling_time,
        "true_delay": recorded.delay,
    }


def _model(estimate: FrictionEstimate) -> str:
    """Return the selected terms, or the names of the parameters."""
    if estimate.selection is None:
        return ", ".join(name.replace("inertia", "mass") for name in estimate.parameters)
    return ", ".join(estimate.selection.selected)


def _judged(estimate: FrictionEstimate, recorded: Recorded) -> tuple[dict[str, Judged], list[str]]:
    """Return the parameters that have an interval and a true value, and the names of the others."""
    judged: dict[str, Judged] = {}
    unjudged: list[str] = []
    names = estimate.parameters.keys()
    # With an offset beside them, Coulomb friction of each direction is known up to a constant only.
    loose = {f"{kind}_friction{side}" for kind in ("coulomb", "static") for side in _SIDES}
    loose = loose | {"offset"} if "offset" in names and loose & names else set[str]()
    given = {"mass", "inertia"} if "inertia" in recorded.settings else set[str]()
    for name, p in estimate.parameters.items():
        if p.value is None or p.ci95 is None or name in given:
            continue
        if name in loose or name not in recorded.truth:
            unjudged.append(name)
            continue
        truth = recorded.truth[name]
        judged[name] = Judged(
            value=float(p.value),
            low=float(p.ci95[0]),
            high=float(p.ci95[1]),
            truth=truth,
            error=float(p.value - truth) / recorded.scales[name],
        )
    return judged, unjudged


def _curve(found: Identification, recorded: Recorded) -> dict[str, Any] | None:
    """Compare the friction curve at the driven velocities; None where none can be predicted.

    ``coverage``: share of the velocities at which the truth is within t standard errors;
    ``critical``: whether it is outside, by a large error, at any of them; ``error``: largest
    relative error; ``band``: share inside the band of the identification's own curve, or None.
    """
    estimate, v = found.estimate, recorded.velocities
    truth = recorded.curve(v)
    prediction = _predicted(estimate, v)
    if prediction is None:
        return None
    value, deviation, quantile = prediction
    # Against the mean size of friction: the effort of one direction may be small with an offset.
    error = np.abs(value - truth) / np.mean(np.abs(recorded.curve(np.concatenate((v, -v)))))
    inside = np.abs(value - truth) <= quantile * deviation
    return {
        "coverage": float(np.mean(inside)),
        "critical": bool(np.any(~inside & (error > LARGE_ERROR))),
        "error": float(np.max(error)),
        "band": _band_coverage(found, v, truth),
    }


def _predicted(
    estimate: FrictionEstimate, v: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], float] | None:
    """Return the friction curve of an estimate, its standard error, and the quantile of 95 %."""
    values = {n: float(p.value) for n, p in estimate.parameters.items() if p.value is not None}
    covariance = estimate.covariance
    intervals = [n for n in values if estimate.parameters[n].ci95 is not None]
    wanted = {n.removesuffix(_SIDES[0]).removesuffix(_SIDES[1]) for n in estimate.parameters}
    known = {n.removesuffix(_SIDES[0]).removesuffix(_SIDES[1]) for n in values}
    if (wanted & set(_CURVE_NAMES)) - known or "coulomb_friction" not in known:
        return None  # a part of the curve is not identified
    if "static_friction" in known and "stribeck_velocity" not in known:
        return None
    if covariance.shape != (len(intervals),) * 2 or not intervals:
        return None
    value = _friction(values, v)
    gradient = np.zeros((v.size, len(intervals)))
    for j, name in enumerate(intervals):
        step = 1e-3 * float(np.sqrt(covariance[j, j])) or 1e-9 * abs(values[name])
        if step == 0.0:
            continue
        above = _friction(values | {name: values[name] + step}, v)
        below = _friction(values | {name: values[name] - step}, v)
        gradient[:, j] = (above - below) / (2 * step)
    variance = np.einsum("ni,ij,nj->n", gradient, covariance, gradient)
    quantiles = [estimate.parameters[n].quantile for n in intervals if n.startswith("coulomb")]
    quantile = float(np.nanmedian(quantiles)) if quantiles else 1.96
    return value, np.sqrt(np.maximum(variance, 0.0)), quantile


def _friction(values: Mapping[str, float], v: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return the effort at constant velocity that the parameters predict."""

    def of(name: str) -> Float[np.ndarray, " n"]:
        plain = values.get(name, 0.0)
        return np.where(
            v > 0, values.get(name + _SIDES[0], plain), values.get(name + _SIDES[1], plain)
        )

    sign, speed = np.sign(v), np.abs(v)
    size = of("coulomb_friction") + of("viscous_friction") * speed
    size = size + sign * values.get("viscous_asymmetry", 0.0) * speed
    size = size + values.get("quadratic_friction", 0.0) * speed**2
    size = size + values.get("two_thirds_friction", 0.0) * speed ** (2 / 3)
    if "stribeck_velocity" in values:
        fall = np.exp(-((speed / of("stribeck_velocity")) ** 2))
        size = size + (of("static_friction") - of("coulomb_friction")) * fall
    return sign * size + values.get("offset", 0.0)


def _band_coverage(
    found: Identification, v: Float[np.ndarray, " n"], truth: Float[np.ndarray, " n"]
) -> float | None:
    """Return the share of velocities at which the identification's own band holds the truth."""
    if found.curve is None:
        return None
    grid, low, high = found.curve.fitted_velocity, found.curve.band_low, found.curve.band_high
    inside: list[bool] = []
    for side in (1.0, -1.0):
        here = np.flatnonzero((side * grid > 0) & np.isfinite(low) & np.isfinite(high))
        here = here[np.argsort(grid[here])]
        points = np.flatnonzero(side * v > 0)
        if not here.size:
            continue
        at = v[points]
        reached = np.abs(at) <= 1.02 * np.max(np.abs(grid[here]))
        bottom, top = np.interp(at, grid[here], low[here]), np.interp(at, grid[here], high[here])
        inside.extend(((bottom <= truth[points]) & (truth[points] <= top))[reached].tolist())
    return float(np.mean(inside)) if inside else None
