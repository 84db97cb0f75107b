"""The motion of an arm, to be played on its page by a few lines of script in that page."""

import json
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.presentation import drawing as draw
from stickslip.presentation.page import Markup, filled
from stickslip.presentation.positioning.figures import PHASE_COLOURS, shown_until
from stickslip.presentation.words import prefixed_unit, printed_unit
from stickslip.records import Positioning, PositioningRun, unit_of

_MOST_FRAMES = 1200  # between them the masses move on straight lines

# The stage [px]
_STAGE = {"width": 960, "height": 334, "half": 32, "tall": 46, "ground": 205, "wheel": 8}
_MARGIN = 62.0  # at either end of the stage
_GAP = 46.0  # least length of the spring
_ARROW = 105.0  # of the largest effort
_GAUGE_LEFT, _GAUGE_RIGHT = 190.0, 930.0  # ends of the gauge of the error

_SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # of the film, over real time
_LASTING = 20.0  # time that the whole should take to play [s]
_DECADES = (4, 12)  # of the gauge, at least and at most


def film(run: PositioningRun, positioning: Positioning) -> Markup:
    """Return the arm's motion in a run, with its player."""
    arm = run.arm
    if arm is None:
        return Markup("")
    end = shown_until(run)
    frames = min(_MOST_FRAMES, int(np.searchsorted(run.time, end)) + 1)
    time = np.linspace(0.0, end, max(2, frames))
    at = np.minimum(np.searchsorted(run.time, time * (1.0 + 1e-12), side="right"), run.time.size)
    at = np.maximum(at - 1, 0)
    position, load, target = arm.position[at], arm.load_position[at], arm.target[at]
    low, high = (float(pick([position, load, target])) for pick in (np.min, np.max))
    pressed = max(0.0, float(np.max(position - load)))
    half = float(_STAGE["half"])
    room = _STAGE["width"] - 2 * (_MARGIN + half) - 2 * half - _GAP
    scale = room / (high - low + pressed or 1.0)
    limit = positioning.scenario.get("controller", {}).get("effort_limit", (None, ""))[0]
    errors = [np.abs(target - each) for each in (position, load)]
    gauge = _Gauge(errors, positioning.tolerance, unit_of("position", positioning.kind))
    shown: dict[str, Any] = {
        "step": float(time[1]),
        "decimals": max(0, min(3, 2 - math.floor(math.log10(end)))),
        "left": _MARGIN + half - scale * low,
        "apart": 2 * half + _GAP + scale * pressed,
        "scale": scale,
        "half": half,
        "height": _STAGE["ground"] - _STAGE["tall"] / 2,
        "wheel": _STAGE["wheel"],
        "arrow": _ARROW,
        "effort_limit": float(limit or np.max(np.abs(run.effort)) or 1.0),
        "unit": printed_unit("effort", positioning.kind),
        "position": draw.numbers(position),
        "load_position": draw.numbers(load),
        "target": draw.numbers(target),
        "effort": draw.numbers(run.effort[np.minimum(at, run.effort.size - 1)]),
        "resting": arm.resting[at].astype(int).tolist(),
        "gauge": np.round(gauge.places(errors[0]), 1).tolist(),
        "load_gauge": np.round(gauge.places(errors[1]), 1).tolist(),
        "phases": [
            {"start": each.start_time, "word": each.word, "reason": each.reason}
            for each in run.phases
        ],
    }
    text = json.dumps(shown, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    strips = [
        (each, PHASE_COLOURS[each.name], max(0.0, min(each.end_time, end) - each.start_time))
        for each in run.phases
    ]
    return filled(
        "film.html",
        stage=_STAGE,
        draw=draw,
        number=run.number,
        gauge=gauge,
        end=end,
        strips=strips,
        speeds=_SPEEDS,
        best=min(_SPEEDS, key=lambda each: abs(math.log(each * _LASTING / end))),
        film=text,
        done=PHASE_COLOURS["done"],
    )


class _Gauge:
    """The distance of each mass from its target, on a logarithmic scale across the stage [px]."""

    left, right = _GAUGE_LEFT, _GAUGE_RIGHT

    def __init__(self, errors: list[Float[np.ndarray, " n"]], tolerance: float, unit: str) -> None:
        largest = max(float(np.max(each)) for each in errors)
        high = math.ceil(math.log10(max(largest, tolerance)))
        low = math.floor(math.log10(tolerance)) - 1
        self.low = min(max(low, high - _DECADES[1]), high - _DECADES[0])
        self.decade = (_GAUGE_RIGHT - _GAUGE_LEFT) / (high - self.low)
        self.within = float(self.places(np.array([tolerance]))[0]) - _GAUGE_LEFT
        every = 1 if high - self.low <= 7 else 2
        self.ticks: list[tuple[float, str]] = []
        for decade in range(high, self.low - 1, -every):
            factor, shown = prefixed_unit(10.0**decade, unit)
            place = _GAUGE_LEFT + self.decade * (decade - self.low)
            self.ticks.append((place, f"{10.0**decade * factor:g} {shown}"))

    def places(self, values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return where errors are on it [px]."""
        decades = np.log10(np.maximum(values, 10.0**self.low)) - self.low
        return _GAUGE_LEFT + self.decade * decades
