"""Rates per case, with their bounds, and the Markdown table."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np
from scipy.stats import norm

from studies.markdown import table
from studies.mismatch.cases import CASES
from studies.mismatch.judgement import LARGE_ERROR

Run = Mapping[str, Any]

_NORMAL = 1.959963985

LONGEST_MEDIAN = 1.0
"""Longest median time of an identification of 10 s at 1 kHz [s]."""


def wilson(count: int, total: int) -> tuple[float, float]:
    """Return the Wilson 95 % interval of a rate [-].

    Examples
    --------
    >>> [round(bound, 3) for bound in wilson(0, 100)]
    [0.0, 0.037]
    """
    if total == 0:
        return 0.0, 1.0
    z2, rate = _NORMAL**2, count / total
    centre = (rate + z2 / (2 * total)) / (1 + z2 / total)
    half = _NORMAL * math.sqrt(rate * (1 - rate) / total + z2 / (4 * total**2)) / (1 + z2 / total)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def summarize(runs: Sequence[Run]) -> dict[str, Any]:
    """Return the summary of every case that has runs, ``cases``, and of all together, ``all``."""
    cases = {
        name: _summary([run for run in runs if run["case"] == name])
        for name in CASES
        if any(run["case"] == name for run in runs)
    }
    for name, case in cases.items():
        case["group"] = CASES[name].group
        case["failed"] = _failed(CASES[name].group, case)
    return {"cases": cases, "all": _summary(runs)}


def _rate(flags: Iterable[bool]) -> float | None:
    held = list(flags)
    return float(np.mean(held)) if held else None


def _summary(runs: Sequence[Run]) -> dict[str, Any]:
    ok = [run for run in runs if run.get("ok")]
    critical = sum(run["critical"] for run in ok)
    curves = [run["curve"] for run in ok if run["curve"] is not None]
    curve_critical = sum(curve["critical"] for curve in curves)
    names = sorted({name for run in ok for name in run["parameters"]})
    parameters = {}
    for name in names:
        of = [run["parameters"][name] for run in ok if name in run["parameters"]]
        errors = np.array([p["error"] for p in of])
        parameters[name] = {
            "runs": len(of),
            "coverage": _rate(p["covered"] for p in of),
            "rmse": float(np.sqrt(np.mean(errors**2))),
            "bias": float(np.mean(errors)),
            "largest_error": float(np.max(np.abs(errors))),
            "critical": sum(p["critical"] for p in of),
        }
    bands = [curve["band"] for curve in curves if curve["band"] is not None]
    delays = [run["delay"] - run["true_delay"] for run in ok if run["delay"] is not None]
    return {
        "runs": len(runs),
        "ok": len(ok) / len(runs),
        "statuses": dict(Counter(run["status"] for run in runs).most_common()),
        "outside": sum(run["outside"] for run in ok) / len(runs),
        "critical": critical / len(runs),
        "critical_count": critical,
        "critical_bounds": wilson(critical, len(runs)),
        "nominal": sum(nominal_rate(run["parameters"].values()) for run in ok) / len(runs),
        "critical_seeds": [run["seed"] for run in ok if run["critical"]],
        "curve_critical": curve_critical / len(runs),
        "curve_critical_seeds": [
            run["seed"] for run in ok if run["curve"] is not None and run["curve"]["critical"]
        ],
        "curve_runs": len(curves),
        "curve_coverage": _rate(curve["coverage"] for curve in curves),
        "band_coverage": _rate(bands),
        "parameters": parameters,
        "plain": _rate(run["plain"] for run in ok),
        "models": dict(Counter(run["model"] for run in ok).most_common(5)),
        "delay_rmse": float(np.sqrt(np.mean(np.square(delays)))) if delays else None,
        "median_seconds": median(run["seconds"] for run in runs),
        "crashes": sorted({run["status"] for run in runs if run["status"].startswith("crash")}),
    }


def nominal_rate(parameters: Iterable[Mapping[str, float]]) -> float:
    """Return the probability of a critical result with intervals of exactly 95 % [-].

    The intervals have the reported widths. Errors are taken as normal and independent.
    """
    kept = 1.0
    for each in parameters:
        half = 0.5 * (each["high"] - each["low"])
        if each["error"] == 0.0 or half == 0.0:
            continue
        scale = abs((each["value"] - each["truth"]) / each["error"])
        kept *= 1.0 - 2.0 * float(norm.sf(_NORMAL * max(1.0, LARGE_ERROR * scale / half)))
    return 1.0 - kept


def _failed(group: str, case: Mapping[str, Any]) -> list[str]:
    """Return the acceptance criteria that the measured rates do not meet.

    A criterion ends with ``(!)`` if the Wilson 95 % interval of the rate excludes it too; otherwise
    the miss may be chance.
    """
    failed: list[str] = []

    def check(what: str, rate: float | None, runs: int, least: float, most: float) -> None:
        if rate is None or least <= rate <= most:
            return
        low, high = wilson(round(rate * runs), runs)
        bound, word = (least, "<") if rate < least else (most, ">")
        sure = " (!)" if high < least or low > most else ""
        failed.append(f"{what} {word} {100 * bound:.0f} %{sure}")

    runs = case["runs"]
    check("critical", case["critical"], runs, 0.0, 0.01)
    check("curve critical", case["curve_critical"], runs, 0.0, 0.01)
    check("ok", case["ok"], runs, {"ideal": 0.98, "unmodelled": 0.0}.get(group, 0.95), 1.0)
    least, most = (0.93, 0.97) if group == "noise" else (0.90, 1.0)
    counts = Counter[str]()
    for part in (*_MAIN, "other"):
        counts[part] = sum(p["runs"] for n, p in case["parameters"].items() if _part(n) == part)
        check(f"coverage of {part}", _pooled(case, part, "coverage"), counts[part], least, most)
    check("coverage of curve", case["curve_coverage"], case["curve_runs"], least, most)
    if group == "ideal":
        check("plain model", case["plain"], round(case["ok"] * runs), 0.95, 1.0)
    if case["median_seconds"] > LONGEST_MEDIAN:
        failed.append(f"median time > {LONGEST_MEDIAN:g} s")
    if case["crashes"]:
        failed.append("crash")
    return failed


def _percent(value: float | None, digits: int = 0) -> str:
    return "-" if value is None else f"{100 * value:.{digits}f}"


_MAIN = ("mass", "viscous", "Coulomb", "offset")
_PART = {
    "mass": "mass",
    "inertia": "mass",
    "viscous_friction": "viscous",
    "coulomb_friction": "Coulomb",
    "offset": "offset",
}


def _part(name: str) -> str:
    """Return the column of a parameter."""
    return _PART.get(name.removesuffix("_positive").removesuffix("_negative"), "other")


def _pooled(case: Mapping[str, Any], part: str, value: str) -> float | None:
    """Return the mean of a number over both names of the mass, or over both directions."""
    held = [(p["runs"], p[value]) for n, p in case["parameters"].items() if _part(n) == part]
    total = sum(runs for runs, _ in held)
    if not total:
        return None
    if value == "rmse":
        return math.sqrt(sum(runs * number**2 for runs, number in held) / total)
    return sum(runs * number for runs, number in held) / total


def markdown(summary: Mapping[str, Any], title: str) -> str:
    """Return what `summarize` returned as Markdown tables below a title."""
    about = (
        "Rates in per cent. *outside*: `ok`, and the true value of a reported parameter outside "
        "its 95 % interval. *critical*: the same, and its error above 5 % (offset: of Coulomb "
        "friction); in brackets the Wilson 95 % bounds. *nominal*: the rate of critical results if "
        "intervals of these widths held with exactly 95 %. *curve*: the friction curve at twenty "
        "driven velocities. *coverage* and *RMSE* are of `ok` runs. A criterion marked (!) is "
        "missed by more than chance."
    )
    head = [
        *("case", "group", "runs", "ok", "outside", "critical", "nominal", "curve critical"),
        *(f"{part} cov." for part in _MAIN),
        "curve cov.",
        *(f"{part} RMSE" for part in _MAIN),
        *("plain", "time [s]"),
    ]
    rates: list[list[str]] = []
    cases = [(name, case, case["group"]) for name, case in summary["cases"].items()]
    for name, case, group in [*cases, ("**all**", summary["all"], "")]:
        low, high = case["critical_bounds"]
        cells = [
            name,
            group,
            str(case["runs"]),
            _percent(case["ok"]),
            _percent(case["outside"]),
            f"{_percent(case['critical'], 1)} [{_percent(low, 1)}, {_percent(high, 1)}]",
            _percent(case["nominal"], 1),
            _percent(case["curve_critical"], 1),
            *(_percent(_pooled(case, part, "coverage")) for part in _MAIN),
            _percent(case["curve_coverage"]),
            *(_percent(_pooled(case, part, "rmse"), 2) for part in _MAIN),
            _percent(case["plain"]),
            f"{case['median_seconds']:.2f}",
        ]
        rates.append(cells)
    found: list[list[str]] = []
    for name, case in summary["cases"].items():
        statuses = "; ".join(f"{_cell(s)} {n}" for s, n in case["statuses"].items())
        models = "; ".join(f"{_cell(m)} ({n})" for m, n in case["models"].items())
        found.append([name, statuses, models, "; ".join(case["failed"])])
    results = ("case", "statuses", "models of `ok` runs", "criteria not met")
    parts = (f"# {title}\n", f"{about}\n", table(head, rates, words=2), table(results, found))
    return "\n".join(parts)


def _cell(text: str) -> str:
    return text.replace("|", "/")
