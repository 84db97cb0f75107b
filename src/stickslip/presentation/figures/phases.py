"""What lies behind the curves of a run: the phases of a landing, the tolerance, starts of runs."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.presentation.figures import drawing as draw
from stickslip.presentation.figures.drawing import Trace
from stickslip.records import LandingPhaseName, PositioningRun

__all__ = [
    "PHASE_COLOURS",
    "phase_layout",
    "phase_shades",
    "phase_traces",
    "shown_until",
    "starts",
    "tolerance_band",
]

PHASE_COLOURS: dict[LandingPhaseName, str] = {
    "feedback": "#d6e6f5",
    "resting": "#eceff2",
    "series": "#fce3bd",
    "pulses": "#fce3bd",
    "done": "#d3eddf",
    "stopped": "#f6d3c4",
}
"""Pale enough to lie behind curves; phases are numbered too."""

_MARGIN = {"l": 56, "r": 14, "t": 22, "b": 44}
"""Of a figure with the numbers of phases above it [pixels]."""

_AFTER = 1.15
"""Time drawn over the time until the controller has ended."""

_NARROW = 0.012
"""Share of the time that a phase takes at least to have its number above it."""


def shown_until(run: PositioningRun) -> float:
    """Return the time up to which a run is drawn at first: without a long rest at its end."""
    whole = float(run.time[-1])
    phases = run.phases
    if len(run.moves) > 1 or not phases or phases[-1].name not in {"done", "stopped"}:
        return whole
    return min(whole, _AFTER * phases[-1].start_time)


def phase_traces(run: PositioningRun) -> list[Trace]:
    """Return what the legend shows of the phases: their colours, each once."""
    words: dict[LandingPhaseName, str] = {each.name: each.word.lower() for each in run.phases}
    return [
        {"name": word, "fill": "toself", "fillcolor": PHASE_COLOURS[name]}
        for name, word in words.items()
    ]


def phase_shades(run: PositioningRun) -> list[dict[str, object]]:
    """Return the phases as bands behind curves over time."""
    return [
        {
            "type": "rect",
            "layer": "below",
            "xref": "x",
            "yref": "paper",
            "x0": phase.start_time,
            "x1": phase.end_time,
            "y0": 0,
            "y1": 1,
            "fillcolor": PHASE_COLOURS[phase.name],
            "line": {"width": 0},
        }
        for phase in run.phases
    ]


def phase_layout(run: PositioningRun, end: float) -> dict[str, object]:
    """Return the settings of a layout that shade and number the phases up to a time."""
    numbers = [
        {
            "text": str(k),
            "showarrow": False,
            "xref": "x",
            "yref": "paper",
            "x": 0.5 * (phase.start_time + min(phase.end_time, end)),
            "y": 1,
            "yanchor": "bottom",
            "font": {"size": 11, "color": draw.GREY},
        }
        for k, phase in enumerate(run.phases, start=1)
        if min(phase.end_time, end) - phase.start_time > _NARROW * end
    ]
    margin = {"margin": _MARGIN} if run.phases else {}
    return {"shapes": phase_shades(run), "annotations": numbers, **margin}


def tolerance_band(time: Float[np.ndarray, " n"], half: float, row: int) -> Trace:
    """Shade the tolerance over the whole time."""
    ends = time[[0, -1]]
    (shade,) = draw.band(ends, np.full(2, -half), np.full(2, half), name="tolerance", row=row)
    return shade


def starts(lengths: Sequence[float] | Sequence[int], *, first: float) -> list[dict[str, object]]:
    """Return a dotted line where each run but the first begins."""
    begins = np.cumsum([0, *lengths[:-1]])[1:] + first
    return [draw.vertical(float(x), dash="dot") for x in begins]
