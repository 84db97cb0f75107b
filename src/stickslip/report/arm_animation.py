"""The arm as it moved, to be played on its page; drawn by a few lines of script in that page."""

import json
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records import Positioning, PositioningRun, prefixed_unit, unit_of, unit_text
from stickslip.report.drawing import BLUE, GREY, INK, ORANGE, PALE, VERMILION, numbers
from stickslip.report.phase_figures import PHASE_COLOURS, shown_until
from stickslip.report.sheet import template

__all__ = ["animation"]

_MOST_FRAMES = 1200
"""Pictures kept: between them the masses move on straight lines."""

# The stage [px]
_WIDTH, _HEIGHT = 960, 334
_MARGIN = 62.0
_HALF, _TALL, _GROUND, _WHEEL = 32.0, 46.0, 205.0, 8.0
_GAP = 46.0  # least length of the spring
_ARROW = 105.0  # of the largest effort
_GAUGE_Y, _GAUGE_LEFT, _GAUGE_RIGHT = 290.0, 190.0, 930.0

_SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
_LASTING = 20.0
"""How long the whole should take to play [s]."""

_DECADES = (4, 12)
"""Decades of the gauge, at least and at most."""


def animation(run: PositioningRun, positioning: Positioning) -> str:
    """Return the arm's motion in a run, with what plays it, as HTML."""
    arm = run.arm
    if arm is None:
        return ""
    end = shown_until(run)
    frames = min(_MOST_FRAMES, int(np.searchsorted(run.time, end)) + 1)
    time = np.linspace(0.0, end, max(2, frames))
    at = np.minimum(np.searchsorted(run.time, time * (1.0 + 1e-12), side="right"), run.time.size)
    at = np.maximum(at - 1, 0)
    position, load = arm.position[at], arm.load_position[at]
    low = float(min(position.min(), load.min(), arm.target[at].min()))
    high = float(max(position.max(), load.max(), arm.target[at].max()))
    pressed = max(0.0, float(np.max(position - load)))
    room = _WIDTH - 2 * (_MARGIN + _HALF) - 2 * _HALF - _GAP
    scale = room / (high - low + pressed or 1.0)
    limit = positioning.scenario.get("controller", {}).get("effort_limit", (None, ""))[0]
    unit = unit_of("position", positioning.kind)
    errors = [np.abs(arm.target - each)[at] for each in (arm.position, arm.load_position)]
    gauge, marks = _gauge(errors, positioning.tolerance, unit)
    film: dict[str, Any] = {
        "step": float(time[1]),
        "decimals": max(0, min(3, 2 - math.floor(math.log10(end)))),
        "left": _MARGIN + _HALF - scale * low,
        "apart": 2 * _HALF + _GAP + scale * pressed,
        "scale": scale,
        "half": _HALF,
        "height": _GROUND - _TALL / 2,
        "wheel": _WHEEL,
        "arrow": _ARROW,
        "effort_limit": float(limit or np.max(np.abs(run.effort)) or 1.0),
        "unit": unit_text(unit_of("effort", positioning.kind)),
        "position": numbers(position),
        "load_position": numbers(load),
        "target": numbers(arm.target[at]),
        "effort": numbers(run.effort[np.minimum(at, run.effort.size - 1)]),
        "resting": arm.resting[at].astype(int).tolist(),
        "gauge": gauge[0],
        "load_gauge": gauge[1],
        "phases": [
            {"start": each.start_time, "word": each.word, "reason": each.reason}
            for each in run.phases
        ],
    }
    text = json.dumps(film, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        f'<div class="film"><svg id="stage" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" '
        f'aria-label="The arm of run {run.number}, moving: two masses joined by a spring, the '
        'first on a ground with friction; the flags are where they are to rest.">\n'
        f"{_scene()}{marks}</svg>\n{_controls(run, end)}</div>\n"
        f'<script type="application/json" id="film">{text}</script>\n'
        f"<script>{template('arm.js')}</script>\n"
    )


def _scene() -> str:
    """Return what moves on the stage; the script moves it."""
    top = _GROUND - _TALL
    hatch = "".join(
        f'<path d="M{x} {_GROUND}l-8 9" stroke="{PALE}"/>' for x in range(14, _WIDTH + 1, 11)
    )
    wheels = "".join(
        f'<g data-wheel="{x} {_GROUND - _WHEEL}"><circle r="{_WHEEL}" fill="#fff" stroke="{INK}" '
        f'stroke-width="2"/><path d="M0 0V{-_WHEEL}" stroke="{INK}" stroke-width="2"/></g>'
        for x in (-18, 18)
    )
    flags = "".join(
        f'<g data-part="flag-{k}"><path d="M0 {_GROUND}V98" stroke="{colour}" stroke-width="1.5" '
        f'stroke-dasharray="4 3"/><path d="M0 98l22 7-22 7Z" fill="{colour}"/></g>'
        for k, colour in ((1, BLUE), (2, VERMILION))
    )
    name = 'text-anchor="middle" fill="#fff" font-weight="650" font-size="15"'
    return (
        f'<path d="M0 {_GROUND}H{_WIDTH}" stroke="{INK}" stroke-width="1.5"/>{hatch}{flags}'
        f'<path data-part="spring" fill="none" stroke="{GREY}" stroke-width="2" '
        'stroke-linejoin="round"/>\n'
        f'<g data-part="mass-1"><rect x="{-_HALF}" y="{top}" width="{2 * _HALF}" height="{_TALL}" '
        f'rx="3" fill="{BLUE}"/><text y="{top + 28}" {name}>1</text>'
        f'<text data-part="contact" y="{_GROUND + 26}" text-anchor="middle" fill="{INK}" '
        'font-size="13">sticks</text>'
        f'<g transform="translate(0 {top - 16})"><path data-part="arrow" fill="{ORANGE}"/>'
        f'<text data-part="effort" y="-13" text-anchor="middle" fill="{INK}" font-size="13">'
        "</text></g></g>\n"
        f'<g data-part="mass-2"><rect x="{-_HALF}" y="{top}" width="{2 * _HALF}" '
        f'height="{_TALL - 2 * _WHEEL + 4}" rx="3" fill="{VERMILION}"/>'
        f'<text y="{top + 23}" {name}>2</text>{wheels}</g>\n'
        f'<text data-part="phase" x="12" y="34" font-size="22" font-weight="650" fill="{INK}">'
        "</text>\n"
    )


def _gauge(
    errors: list[Float[np.ndarray, " n"]], tolerance: float, unit: str
) -> tuple[list[list[float]], str]:
    """Return how far each mass is from its target on a logarithmic gauge [px], and its marks."""
    largest = max(float(np.max(each)) for each in errors)
    high = math.ceil(math.log10(max(largest, tolerance)))
    low = math.floor(math.log10(tolerance)) - 1
    low = min(max(low, high - _DECADES[1]), high - _DECADES[0])
    width = (_GAUGE_RIGHT - _GAUGE_LEFT) / (high - low)

    def places(values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        decades = np.log10(np.maximum(values, 10.0**low)) - low
        return _GAUGE_LEFT + width * decades

    within = float(places(np.array([tolerance]))[0])
    every = 1 if high - low <= 7 else 2
    ticks = "".join(
        f'<path d="M{x:.1f} {_GAUGE_Y}v6" stroke="{GREY}"/><text x="{x:.1f}" y="{_GAUGE_Y + 30}" '
        f'text-anchor="middle">{_power(decade, unit)}</text>'
        for decade in range(high, low - 1, -every)
        for x in [_GAUGE_LEFT + width * (decade - low)]
    )
    marks = "".join(
        f'<g data-part="gauge-{k}"><path d="{shape}" fill="{colour}" stroke="#fff"/></g>'
        for k, colour, shape in (
            (1, BLUE, f"M0 {_GAUGE_Y}l-7 -13h14Z"),
            (2, VERMILION, f"M0 {_GAUGE_Y}l-7 13h14Z"),
        )
    )
    drawn = (
        f'<g font-size="12.5" fill="{GREY}"><text x="12" y="{_GAUGE_Y - 3}" fill="{INK}">distance'
        f'</text><text x="12" y="{_GAUGE_Y + 17}" fill="{INK}">from target</text>'
        f'<rect x="{_GAUGE_LEFT}" y="{_GAUGE_Y - 14}" width="{within - _GAUGE_LEFT:.1f}" '
        f'height="28" fill="{PHASE_COLOURS["done"]}"/>'
        f'<text x="{_GAUGE_LEFT + 5}" y="{_GAUGE_Y - 19}">within tolerance</text>'
        f'<path d="M{_GAUGE_LEFT} {_GAUGE_Y}H{_GAUGE_RIGHT}" stroke="{INK}"/>{ticks}{marks}</g>\n'
    )
    return [np.round(places(each), 1).tolist() for each in errors], drawn


def _power(decade: int, unit: str) -> str:
    factor, shown = prefixed_unit(10.0**decade, unit)
    return f"{10.0**decade * factor:g} {shown}"


def _controls(run: PositioningRun, end: float) -> str:
    """Return the buttons, the time and the phases, to be clicked on."""
    best = min(_SPEEDS, key=lambda each: abs(math.log(each * _LASTING / end)))
    speeds = "".join(
        f'<option value="{each:g}"{" selected" if each == best else ""}>{each:g}×</option>'
        for each in _SPEEDS
    )
    strips = "".join(
        f'<button type="button" data-start="{each.start_time:.9g}" title="{each.word}" '
        f'aria-label="to phase {k}, {each.word}" style="flex:{part:.4g};background:'
        f'{PHASE_COLOURS[each.name]}"><span>{k}</span></button>'
        for k, each in enumerate(run.phases, start=1)
        for part in [max(0.0, min(each.end_time, end) - each.start_time)]
    )
    strip = f'<div id="film-phases" class="strip">{strips}</div>\n' if strips else ""
    said = '<p id="film-reason" class="reason"></p>\n' if strips else ""
    return (
        '<div class="controls"><button type="button" id="film-play">▶ Play</button>'
        f'<div class="times"><input type="range" id="film-time" min="0" max="{end:.9g}" '
        f'step="any" value="0" aria-label="Time">{strip}</div>'
        '<output id="film-clock" for="film-time">0 s</output>'
        f'<label>Speed <select id="film-speed">{speeds}</select></label></div>\n{said}'
    )
