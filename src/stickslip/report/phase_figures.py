"""The phases of a landing behind its curves: bands, their numbers and their colours."""

from stickslip.records import LandingPhaseName, PositioningRun
from stickslip.report.drawing import GREY, Trace

__all__ = [
    "PHASE_COLOURS",
    "PHASE_MARGIN",
    "phase_numbers",
    "phase_shades",
    "phase_traces",
    "shown_until",
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

PHASE_MARGIN = {"l": 56, "r": 14, "t": 22, "b": 44}
"""Of a drawing with the numbers of phases above it [pixels]."""

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
    """Return what the key shows of the phases: their colours, each once."""
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


def phase_numbers(run: PositioningRun, end: float) -> list[dict[str, object]]:
    """Return the number of each phase above its band, as far as there is room."""
    return [
        {
            "text": str(k),
            "showarrow": False,
            "xref": "x",
            "yref": "paper",
            "x": 0.5 * (phase.start_time + min(phase.end_time, end)),
            "y": 1,
            "yanchor": "bottom",
            "font": {"size": 11, "color": GREY},
        }
        for k, phase in enumerate(run.phases, start=1)
        if min(phase.end_time, end) - phase.start_time > _NARROW * end
    ]
