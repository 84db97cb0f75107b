"""The selection in words."""

from collections.abc import Mapping
from dataclasses import replace

from stickslip.estimation.selection.model import Model
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.records import EffortKind, ModelSelection, TermScore

EFFORT_KINDS: Mapping[EffortKind, str] = {
    "held": "held from its time stamp to the next",
    "sampled": "the value at its time stamp",
    "mean": "the mean since the time stamp before",
}
"""Kinds of a logged effort, in words."""


def selection_of(
    model: Model,
    motions: SlipMotions,
    known_delay: float | None,
    kind: EffortKind = "held",
    further: TermScore | None = None,
) -> ModelSelection:
    """Return the selection with its summary.

    ``further`` is the score of a term that is fitted after the model.
    """
    scores = (*model.scores, *(() if further is None else (further,)))
    chosen = [score for score in scores if score.selected]
    others = [score for score in scores if not score.selected]
    shapes = {term.name: shape.value for term, shape in model.chosen}
    chosen = [replace(score, shape=shapes.get(score.term, 0.0)) for score in chosen]
    delay = model.rows.delay * model.rows.weight.sampling_time
    sentences = [f"The model has {_parts(model)}."]
    if chosen:
        selected = "; ".join(f"{score.text} ({_gain(score)})" for score in chosen)
        sentences.append(f"Selected: {selected}.")
    given = [term.text for term, _ in model.chosen if term.name not in {s.term for s in chosen}]
    if given:
        sentences.append(f"Included as asked: {'; '.join(given)}.")
    if delay:
        known = "" if known_delay is None else ", as given"
        sentences.append(
            f"The effort, {EFFORT_KINDS[kind]}, acts {abs(1e3 * delay):.3g} ms "
            f"{'after' if delay > 0 else 'before'} that{known}."
        )
    if others:
        nearest = min(others, key=lambda score: score.p_value)
        sentences.append(
            f"{len(others)} other terms were tested and not selected; the nearest is "
            f"{nearest.term} ({_gain(nearest)}, {100 * nearest.share:.2f} % of the effort)."
        )
    return ModelSelection(
        summary=" ".join(sentences),
        scores=(*chosen, *others),
        effort_delay=delay,
        reference_time=motions.reference_time,
        reference_position=motions.reference_position,
        effort_kind=kind,
    )


def _parts(model: Model) -> str:
    """Return the terms of the base model in words."""
    parts = ["Coulomb friction"]
    if model.viscous:
        parts.append("viscous friction")
    if model.offset:
        parts.append("an offset")
    inertia = "inertia" if model.inertia is None else "the given inertia"
    return (
        f"{inertia}, {', '.join(parts[:-1])} and {parts[-1]}"
        if parts[1:]
        else (f"{inertia} and {parts[0]}")
    )


def _gain(score: TermScore) -> str:
    """Return in words how much better a model with a term predicts."""
    less = "lower" if score.gain >= 0 else "higher"
    shape = f"shape {score.shape:.4g}, " if score.shape else ""
    return (
        f"{shape}squared error on moves left out {abs(100 * score.gain):.1f} ± "
        f"{100 * score.gain_std:.1f} % {less}, p = {score.p_value:.1g}"
    )
