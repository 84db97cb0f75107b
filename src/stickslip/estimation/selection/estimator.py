"""Identification of a rigid axis with the model that its log supports."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression, least_squares
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.prepare import PreparedLog, prepare
from stickslip.estimation.selection.model_rows import ModelRows, model_rows
from stickslip.estimation.selection.motion import MotionTuning, SlipMotions, slip_motions
from stickslip.estimation.selection.plausibility import (
    PlausibilityTuning,
    implausible_units,
    too_slow_sampling,
    unexplained_effort,
    unsettled_delay,
    wrong_inertia,
)
from stickslip.estimation.selection.rows import window_rows
from stickslip.estimation.selection.search import (
    DELAY_TERM,
    Model,
    SearchTuning,
    half_width,
    search,
    smallest_ratio,
    with_terms,
)
from stickslip.estimation.selection.terms import (
    DELAY,
    SATURATION,
    TERM_NAMES,
    Term,
    candidate_terms,
    effort_excess,
)
from stickslip.estimation.selection.windows import Weight
from stickslip.records import (
    AxisLog,
    FrictionEstimate,
    InputError,
    ModelSelection,
    Status,
    TermScore,
    positive,
)

__all__ = ["SelectedModelEstimator", "SelectionTuning"]


@dataclass(frozen=True, kw_only=True)
class IntervalTuning:
    """Tuning of what widens the intervals beyond the sampling error."""

    wide_windows: tuple[float, float] = (2.5, 4.0)
    """Widths of further windows over that of the fit [-]; the widest also models an elastic
    drive."""
    fewest_deviations: float = 2.0
    """Difference between windows, in standard deviations, that counts [-]."""
    largest_p_value: float = 0.1
    """Of a term that was not selected and whose effect counts all the same [-]."""
    smallest_ratio: float = 3e-3
    """Smallest over largest singular value of the columns of wide windows [-]: below it they do not
    determine the parameters."""
    fewest_moves: float = 0.7
    """Share of the moves that wide windows must still fit into [-]."""


@dataclass(frozen=True, kw_only=True)
class SelectionTuning:
    """Tuning of `SelectedModelEstimator`, by stage."""

    motion: MotionTuning = field(default_factory=MotionTuning)
    search: SearchTuning = field(default_factory=SearchTuning)
    intervals: IntervalTuning = field(default_factory=IntervalTuning)
    plausibility: PlausibilityTuning = field(default_factory=PlausibilityTuning)


_LARGEST_DELAY = 1.0  # s
_SATURATED = 0.98  # of the limit: below it the drive follows


@dataclass(frozen=True, kw_only=True)
class SelectedModelEstimator:
    """Least squares of the effort over windows of slip, with the terms that the log supports.

    The force balance is taken in its weak form (`stickslip.estimation.selection.windows`), so that
    noise of the logged effort costs variance and no bias, and whatever a window must not contain
    (reversals, rests, gaps, clipped samples) is left out exactly. Terms beyond inertia, viscous and
    Coulomb friction and offset are added one by one as long as they are significant under
    correlated residuals and predict moves left out of the fit better, by more than one standard
    error. The delay of the effort is one of them. Intervals allow for correlated residuals, for
    terms that are nearly significant, and for differences between frequency bands.

    Attributes
    ----------
    inertia
        Known mass or inertia [kg or kg m^2]; None estimates it.
    offset
        Whether a constant offset is estimated.
    include, exclude
        Terms of `TERM_NAMES` that the model has, whatever the log supports, and terms that it does
        not have.
    select
        Whether further terms are selected.
    effort_delay
        Known time by which the effort acts later than it is logged [s]; None estimates it if the
        log shows one.
    tuning
        Of the method.

    Raises
    ------
    InputError
        If the inertia is not positive, or a term is not one of `TERM_NAMES`.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip.records import AxisLog
    >>> time = np.arange(0, 10, 0.001)
    >>> velocity = 0.1 * np.sin(2 * time) + 0.05 * np.sin(5 * time)
    >>> position = -0.05 * np.cos(2 * time) - 0.01 * np.cos(5 * time)
    >>> acceleration = 0.2 * np.cos(2 * time) + 0.25 * np.cos(5 * time)
    >>> effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity + 20.0 * position
    >>> log = AxisLog(name="stage", kind="linear", time=time, effort=effort,
    ...               measured_position=position)
    >>> found = SelectedModelEstimator().fit(log)
    >>> found.selection.selected
    ('spring',)
    >>> round(found.value("spring_stiffness"), 1)
    20.0
    """

    inertia: float | None = None
    offset: bool = True
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    select: bool = True
    effort_delay: float | None = None
    tuning: SelectionTuning = field(default_factory=SelectionTuning)

    def __post_init__(self) -> None:
        if self.inertia is not None:
            positive("inertia", self.inertia, "kg or kg m^2")
        for name in (*self.include, *self.exclude):
            if name not in TERM_NAMES:
                raise InputError(
                    f"{name!r} is not a term", remedy=f"use some of {', '.join(TERM_NAMES)}"
                )
        twice = [name for name in self.include if self.include.count(name) > 1]
        both = [name for name in self.include if name in self.exclude]
        if twice or both:
            raise InputError(
                f"the term {(twice or both)[0]!r} is "
                f"{'included twice' if twice else 'both included and excluded'}",
                remedy="give it once",
            )
        if SATURATION in self.include:
            raise InputError(
                "saturation is included, but it is a defect of a log and no term of an axis",
                remedy="leave it out; it is looked for unless it is excluded",
            )
        if self.effort_delay is not None:
            if not abs(self.effort_delay) <= _LARGEST_DELAY:
                raise InputError(
                    f"the effort delay is {self.effort_delay:g} s; it must be within "
                    f"{_LARGEST_DELAY:g} s",
                    remedy="align the columns of the log",
                )
            if DELAY in self.include:
                raise InputError(
                    "the effort delay is given and the term 'delay' is included",
                    remedy="leave one of them out",
                )

    @property
    def name(self) -> str:
        """Name in the registry."""
        return "auto"

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Parameters
        ----------
        log
            Of a rigid axis.

        Raises
        ------
        InputError
            If nothing moves or pushes in the log, or it is too short for any window.
        """
        return self.details(log).estimate

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report.

        Parameters
        ----------
        log
            Of a rigid axis.

        Raises
        ------
        InputError
            As `fit`.
        """
        check_excited(log)
        return self.fit_prepared(prepare(log))

    def fit_prepared(self, log: PreparedLog) -> Fit:
        """Return the estimate from a log that is prepared already, with its rows.

        Parameters
        ----------
        log
            As `prepare` returns it.

        Raises
        ------
        InputError
            As `fit`.
        """
        if not log.parts:
            raise InputError(
                f"the log has no stretch of samples without a gap that is long enough "
                f"({len(log.log)} samples in all, one every {log.sampling_time:.4g} s)",
                where=log.log.name,
                remedy="record a longer log, without gaps",
            )
        motions = slip_motions(log, self.tuning.motion)
        notes = list(log.notes)
        causes = [implausible_units(log, motions, self.tuning.plausibility)]
        driven = motions
        model, terms, motions, found = self._followed(log, driven)
        notes += [
            f"the term {name!r} is left out: this log does not determine it, or gives its "
            "coefficient the wrong sign"
            for name in self.include
            if name not in model.names
        ]
        kind = "mass" if log.log.kind == "linear" else "inertia"
        wrong = wrong_inertia(model, kind, log.log.unit(kind), self.tuning.plausibility)
        if wrong:
            causes.append(wrong)
            model, terms, motions, found = replace(self, inertia=None)._followed(log, driven)
        notes += found
        causes.append(unsettled_delay(model, self.tuning.search))
        rows = model_rows(model, kind)
        estimate, regression = self._solved(log, motions, model, rows, notes)
        shifts = [
            shift
            for shift in (
                self._between_windows(model, rows, estimate, kind),
                self._of_other_terms(model, rows, terms),
            )
            if shift is not None
        ]
        if shifts:
            estimate, regression = self._solved(log, motions, model, rows, notes, np.array(shifts))
        causes.append(too_slow_sampling(log, motions, self.tuning.plausibility))
        causes.append(unexplained_effort(motions, model, rows, self.tuning.plausibility))
        estimate = replace(estimate, selection=_selection(model, motions, self.effort_delay))
        return Fit(
            estimate=_judged(estimate, [cause for cause in causes if cause]),
            rows=regression,
            inertia=model.inertia,
            model=model,
        )

    def _followed(
        self, log: PreparedLog, motions: SlipMotions
    ) -> tuple[Model, Sequence[Term], SlipMotions, list[str]]:
        """Return model, tried terms, the motion without saturated samples, and notes."""
        model, terms = self._selected(log, motions)
        if SATURATION not in model.names:
            return model, terms, motions, []
        limit = next(shape.value for term, shape in model.chosen if term.name == SATURATION)
        followed, note = _without_saturation(motions, limit, log.log)
        model, terms = self._selected(log, followed, saturation=False)
        if _saturates(model, motions, limit):
            return model, terms, followed, [note]
        model, terms = self._selected(log, motions, saturation=False)
        return model, terms, motions, []

    def _selected(
        self, log: PreparedLog, motions: SlipMotions, *, saturation: bool = True
    ) -> tuple[Model, Sequence[Term]]:
        """Return the model that the log supports, and the terms that were tried."""
        T = log.sampling_time
        tuning = self.tuning.search
        weight = Weight(half_width=half_width(motions, T, tuning), sampling_time=T)
        model = Model(
            rows=window_rows(motions.stretches, weight), inertia=self.inertia, offset=self.offset
        )
        if self.effort_delay is not None:
            model = model.shifted(self.effort_delay / T)
        if model.rows.size == 0:
            return model, ()
        terms = [DELAY_TERM, *candidate_terms(motions, log.log.kind)]
        left_out = {*self.exclude, *(() if saturation else (SATURATION,))}
        if self.effort_delay is not None:
            left_out.add(DELAY)
        if not self.offset:  # which friction per direction would bring back
            left_out.add("direction")
        model = with_terms(model, terms, self.include, tuning)
        if not self.select:
            return model, ()
        terms = [term for term in terms if term.name not in left_out]
        return search(model, terms, tuning, ripple="ripple" not in left_out), terms

    def _solved(
        self,
        log: PreparedLog,
        motions: SlipMotions,
        model: Model,
        rows: ModelRows,
        notes: Sequence[str],
        shifts: Float[np.ndarray, "k p"] | None = None,
    ) -> tuple[FrictionEstimate, Regression]:
        """Return the estimate with its rows."""
        regression = rows.regression(log, motions, model, shifts=shifts, notes=notes)
        provenance = provenance_of(log.log, self._options())
        return solve(regression, estimator=self.name, provenance=provenance), regression

    def _options(self) -> Mapping[str, Any]:
        return {
            "estimator": self.name,
            "inertia": self.inertia,
            "offset": self.offset,
            "include": list(self.include),
            "exclude": list(self.exclude),
            "select": self.select,
            "effort_delay": self.effort_delay,
        }

    def _between_windows(
        self, model: Model, rows: ModelRows, estimate: FrictionEstimate, kind: str
    ) -> Float[np.ndarray, " p"] | None:
        """Return by how much the parameters differ over wider windows; None if by chance only.

        Wider windows leave out what is fast: a drive that resonates, presliding, a poor model of
        transients. An elastic drive still adds a share of the fourth derivative of the position,
        the first term in which its apparent inertia depends on frequency.
        """
        tuning = self.tuning.intervals
        weight = model.rows.weight
        shifts = np.zeros(len(rows.names))
        for k, factor in enumerate(tuning.wide_windows):
            wider = replace(weight, half_width=round(factor * weight.half_width))
            wide = replace(model, rows=window_rows(model.rows.motions, wider, model.rows.delay))
            too_few = wide.rows.size < 4 * len(rows.names)
            if too_few or wide.rows.moves < tuning.fewest_moves * model.rows.moves:
                continue
            other = model_rows(wide, kind)
            if k > 0:
                other = other.with_column("elastic", wide.rows.snap)
            if smallest_ratio(other.columns) < tuning.smallest_ratio:
                continue
            values, stds = other.fitted()
            for place, (name, value) in enumerate(zip(rows.names, rows.values(), strict=True)):
                own = estimate.parameters[name].std
                if own is None:
                    continue
                shift = float(values[place] - value)
                chance = float(np.sqrt(max(stds[place] ** 2 - own**2, 0.1 * own**2)))
                if abs(shift) > max(tuning.fewest_deviations * chance, abs(shifts[place])):
                    shifts[place] = shift
        return shifts if np.any(shifts) else None

    def _of_other_terms(
        self, model: Model, rows: ModelRows, terms: Sequence[Term]
    ) -> Float[np.ndarray, " p"] | None:
        """Return the largest change of the parameters by a term that is nearly significant."""
        open_ = {
            score.term
            for score in model.scores
            if not score.selected and score.p_value < self.tuning.intervals.largest_p_value
        }
        own = rows.values()
        norms = np.linalg.norm(rows.columns, axis=0)
        largest, found = 0.0, None
        for term in terms:
            if term.name not in open_ or term.name == SATURATION:
                continue
            for shape in term.shapes[:: max(len(term.shapes) // 3, 1)]:
                more = np.column_stack([rows.columns, model.term_columns(term, shape)])
                shift = least_squares(more, rows.target)[: own.size] - own
                size = float(np.linalg.norm(shift * norms))
                if size > largest:
                    largest, found = size, shift
        return found


def _without_saturation(
    motions: SlipMotions, limit: float, log: AxisLog
) -> tuple[SlipMotions, str]:
    """Return the motions without the samples whose effort did not reach the axis, and a note."""
    over = [np.abs(m.effort) > _SATURATED * limit for m in motions.stretches]
    stretches = tuple(
        replace(m, usable=m.usable & ~out) for m, out in zip(motions.stretches, over, strict=True)
    )
    share = float(np.mean(np.concatenate(over)))
    return replace(motions, stretches=stretches), (
        f"logged effort beyond {limit:.3g} {log.unit('effort')} does not reach the axis, so the "
        f"drive saturates; {100 * share:.2g} % of samples excluded"
    )


def _saturates(model: Model, motions: SlipMotions, limit: float) -> bool:
    """Return whether the effort that moves the axis stays at a limit where the logged one does not.

    The model is that of the samples within the limit. The excess of an effort over a limit explains
    part of any effort, so that its coefficient alone proves nothing.

    Parameters
    ----------
    model
        Fitted to the windows in which the effort is within the limit.
    motions
        All of the motion.
    limit
        [N or N m].
    """
    every = replace(model, rows=window_rows(motions.stretches, model.rows.weight, model.rows.delay))
    if model.rows.size < _FEWEST_FOLLOWED * every.rows.size:
        return False
    values = least_squares(model.columns(), model.target())
    logged = every.target()
    excess = every.rows.mean(effort_excess(limit))
    beyond = np.abs(excess) > _SATURATION_SEEN * limit
    needed = (every.columns() @ values)[beyond]
    followed = float(np.sum((needed - logged[beyond]) ** 2))
    limited = float(np.sum((needed - logged[beyond] + excess[beyond]) ** 2))
    return bool(np.any(beyond)) and limited < _SATURATION_PROVED * followed


_FEWEST_FOLLOWED = 0.4  # of the windows: a limit that is met in most of them is friction
_SATURATION_SEEN = 0.02  # of the limit: windows with a smaller excess tell little
_SATURATION_PROVED = 0.25  # of the squared error without a limit


def _selection(model: Model, motions: SlipMotions, known_delay: float | None) -> ModelSelection:
    """Return the selection with its summary."""
    chosen = [score for score in model.scores if score.selected]
    others = [score for score in model.scores if not score.selected]
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
            f"The effort, held over each sample, acts {abs(1e3 * delay):.3g} ms "
            f"{'after' if delay > 0 else 'before'} its time stamp{known}."
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
    )


def _parts(model: Model) -> str:
    """Return what every model has, and what was given."""
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


def _judged(estimate: FrictionEstimate, causes: Sequence[str]) -> FrictionEstimate:
    """Return the estimate with the causes of a mismatch, the most serious first."""
    if not causes:
        return estimate
    diagnostics = replace(estimate.diagnostics, notes=(*causes, *estimate.diagnostics.notes))
    return replace(estimate, status=Status.MODEL_MISMATCH, diagnostics=diagnostics)
