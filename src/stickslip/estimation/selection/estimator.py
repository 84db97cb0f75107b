"""Identification of a rigid axis with the model that its log supports."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.prepare import PreparedLog, prepare
from stickslip.estimation.selection.dwell import RestedLog, with_dwell
from stickslip.estimation.selection.effort_kind import kind_by_delay, kind_by_residual
from stickslip.estimation.selection.faults.clipping import (
    clipped,
    plateaus,
    without_plateaus,
)
from stickslip.estimation.selection.faults.saturation import (
    saturates,
    without_saturation,
)
from stickslip.estimation.selection.intervals.deviations import deviations
from stickslip.estimation.selection.intervals.rival_law import (
    rival_laws,
    rival_note,
    rival_shifts,
)
from stickslip.estimation.selection.intervals.widening import (
    between_moves,
    of_unknown_delay,
)
from stickslip.estimation.selection.judgement.plausibility import (
    ROUNDING,
    effort_step,
    implausible_time,
    implausible_units,
    ripple_of_degrees,
    unsettled_delay,
    untested,
    within_presliding,
    wrong_delay,
    wrong_inertia,
)
from stickslip.estimation.selection.judgement.status import (
    causes_of_fit,
    judged,
    lacking_terms,
    undetermined_terms,
    with_status,
)
from stickslip.estimation.selection.model import (
    DELAY_TERM,
    Model,
)
from stickslip.estimation.selection.model_rows import (
    ModelRows,
    model_rows,
    nuisance,
    with_shapes,
)
from stickslip.estimation.selection.search.delay import scanned_delay
from stickslip.estimation.selection.search.forward import search, with_terms
from stickslip.estimation.selection.search.windows import (
    noisy_elasticity,
    window_weight,
)
from stickslip.estimation.selection.summary import EFFORT_KINDS, selection_of
from stickslip.estimation.selection.terms import (
    DELAY,
    DIRECTION,
    DWELL,
    ELASTIC,
    SATURATION,
    TERM_NAMES,
    Term,
    candidate_terms,
)
from stickslip.estimation.selection.tuning import SelectionTuning
from stickslip.estimation.weak_form.motion import SlipMotions, slip_motions
from stickslip.estimation.weak_form.rows import window_rows
from stickslip.records import (
    AxisLog,
    EffortKind,
    FrictionEstimate,
    InputError,
    Status,
    finite,
    mass_name,
    one_of,
    positive,
)

_LARGEST_DELAY = 1.0  # s, of a given delay of the effort: a larger one is an error of the columns
_TINY = np.finfo(float).tiny
_UNKNOWN_DELAY = (
    "this log does not show whether the effort acts within a sample of its time stamp, which "
    "widens the intervals; give the delay if it is known, or log the effort as often as it changes"
)


@dataclass(frozen=True, kw_only=True)
class SelectedModelEstimator:
    """Least squares of the effort over windows of slip, with the terms that the log supports.

    The force balance is taken in its weak form (`stickslip.estimation.weak_form.windows`), so that
    noise of the logged effort costs variance and no bias, and reversals, rests, gaps and clipped
    samples are left out exactly. Terms beyond inertia, viscous and Coulomb friction and offset are
    added one by one as long as they are significant under correlated residuals and predict moves
    left out of the fit better, by more than one standard error. The delay of the effort is one of
    them. Intervals allow for correlated residuals, for terms that are nearly significant, for
    another law of viscous friction that explains the log as well, and for differences between
    frequency bands.

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
    effort_kind
        What a logged effort is: ``"held"`` from its time stamp to the next, ``"sampled"`` at its
        time stamp, or the ``"mean"`` since the time stamp before. With uneven time stamps, None
        takes the kind that explains most. With even ones the delay of the effort contains the
        difference, and the effort is held; with few samples in a window it is sampled if a held
        effort would act half a sample before its time stamp, and a mean if it would act a sample
        before.
    tuning
        Tuning of the method.

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
    effort_kind: EffortKind | None = None
    tuning: SelectionTuning = field(default_factory=SelectionTuning)

    def __post_init__(self) -> None:
        if self.inertia is not None:
            positive("inertia", self.inertia, "kg or kg m^2")
        for name in (*self.include, *self.exclude):
            one_of("term", name, TERM_NAMES)
        twice = [name for name in self.include if self.include.count(name) > 1]
        both = [name for name in self.include if name in self.exclude]
        if twice or both:
            raise InputError("term_twice" if twice else "term_both_ways", term=(twice or both)[0])
        if SATURATION in self.include:
            raise InputError("saturation_included")
        if self.effort_kind is not None:
            one_of("effort_kind", self.effort_kind, EFFORT_KINDS)
        if self.effort_delay is not None:
            finite("effort_delay", self.effort_delay, "s")
            if not abs(self.effort_delay) <= _LARGEST_DELAY:
                raise InputError(
                    "effort_delay_too_long", value=self.effort_delay, most=_LARGEST_DELAY
                )
            if DELAY in self.include:
                raise InputError("delay_given_and_included")

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
            If the log has no motion or no effort, or it is too short for any window.
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
        return self.fit_prepared(self.prepared(log))

    def prepared(self, log: AxisLog) -> PreparedLog:
        """Return a log as the fit takes it, with the kind of its effort.

        Parameters
        ----------
        log
            Of a rigid axis.

        Raises
        ------
        InputError
            If the log has no motion or no effort, or it is too short for any window.
        """
        check_excited(log)
        held = prepare(log, effort_kind=self.effort_kind or "held").with_parts()
        if self.effort_kind is not None:
            return held
        if held.resampled:
            return kind_by_residual(log, held, self._with_delay, self.tuning)
        if self._delay_known:
            return held
        return kind_by_delay(log, held, self._with_delay, self.tuning)

    @property
    def _delay_known(self) -> bool:
        return self.effort_delay is not None or DELAY in self.exclude

    def _with_delay(self, log: PreparedLog, motions: SlipMotions) -> Model:
        """Return the model with no term but a delay, unless that is known or excluded."""
        delay = () if self._delay_known else (DELAY,)
        return replace(self, include=delay, select=False)._selected(log, motions)[0]

    def fit_prepared(self, log: PreparedLog) -> Fit:
        """Return the estimate from a prepared log, with its rows.

        Parameters
        ----------
        log
            As `prepare` returns it.

        Raises
        ------
        InputError
            As `fit`.
        """
        driven, tuning = slip_motions(log, self.tuning.motion), self.tuning
        kind, unit = mass_name(log.log.kind), log.log.unit("effort")
        model, terms, motions, clipping = self.followed(log, driven)
        notes = [
            *log.notes,
            *undetermined_terms(model, self.include, "this log does not determine it, or gives"),
        ]
        wrong = wrong_inertia(model, kind, log.log.unit(kind), tuning.plausibility)
        if wrong:
            free = replace(self, inertia=None)
            model, terms, motions, clipping = free.followed(log, driven)
        notes += clipping
        rivals = rival_laws(model, terms, tuning.rival)
        note = rival_note(model, rivals, log.log.kind, unit, tuning.rival)
        notes += [note] if note else []
        rows = with_shapes(model_rows(model, kind), model)

        def rows_of(other: Model) -> ModelRows:
            return with_shapes(model_rows(other, kind), other, rows.names)

        estimate, regression = self._solved(log, motions, model, rows, notes)
        shifts, found = self._shifts(model, rows, estimate, terms, rows_of)
        notes += found
        counted = rivals if terms else []
        others = [rows_of(rival.model) for rival in counted]
        law_shifts = rival_shifts(model, rows, counted, others, log.log.kind)
        if shifts is not None or law_shifts is not None:
            estimate, regression = self._solved(
                log, motions, model, rows, notes, shifts, law_shifts
            )
        causes = [
            implausible_time(log, tuning.plausibility),
            implausible_units(log, driven, tuning.plausibility),
            wrong,
            unsettled_delay(model, tuning.search),
            self.wrong_delay(log, motions, model),
            ripple_of_degrees(model, log.log.kind),
            "" if self.select else self._left_out(log, motions),
            within_presliding(model, estimate, self.include, motions),
            *causes_of_fit(log, motions, model, rows, estimate, tuning),
        ]
        estimate = self._with_selection(log, motions, model, estimate)
        estimate = with_status(estimate, log.log, driven, model, causes, tuning.plausibility)
        short = untested(model) if self.select else ""
        if short and estimate.status.usable:
            estimate = judged(estimate, [short], Status.INSUFFICIENT_EXCITATION)
        return Fit(
            estimate=estimate,
            rows=regression,
            inertia=model.inertia,
            model=model,
        )

    def _shifts(
        self,
        model: Model,
        rows: ModelRows,
        estimate: FrictionEstimate,
        terms: Sequence[Term],
        rows_of: Callable[[Model], ModelRows],
    ) -> tuple[Float[np.ndarray, "k p"] | None, list[str]]:
        """Return deviations of the parameters beyond their sampling error [SI], and notes.

        None if there are no deviations. ``terms`` are those that were tried, ``rows_of`` returns
        the rows of a model.
        """
        tuning, notes = self.tuning.intervals, list[str]()
        unknown_delay = None
        if self.effort_delay is None:
            unknown_delay = of_unknown_delay(model, rows, tuning)
        if unknown_delay is not None:
            stds = np.array([estimate.parameters[name].std or np.inf for name in rows.names])
            notes += [_UNKNOWN_DELAY] if np.any(np.abs(unknown_delay) > stds) else []
        shifts = deviations(model, rows, estimate, terms, rows_of, unknown_delay, self.tuning)
        shifts += between_moves(model, rows, estimate, tuning)
        return np.array(shifts) if shifts else None, notes

    def _with_selection(
        self, log: PreparedLog, motions: SlipMotions, model: Model, estimate: FrictionEstimate
    ) -> FrictionEstimate:
        """Return the estimate with its selection, and with the growth of the breakaway friction."""
        select = partial(selection_of, model, motions, self.effort_delay, log.effort_kind)
        estimate = replace(estimate, selection=select())
        if not self.seeks_dwell:
            return estimate
        estimate, score = with_dwell(
            estimate,
            [RestedLog(log=log, motions=motions, estimate=estimate)],
            self.tuning.search,
            self.tuning.dwell,
            inertia=model.inertia,
            include=DWELL in self.include,
        )
        return replace(estimate, selection=select(further=score))

    @property
    def seeks_dwell(self) -> bool:
        """Whether the growth of the breakaway friction with the time at rest is estimated."""
        return DWELL in self.include or (self.select and DWELL not in self.exclude)

    def wrong_delay(self, log: PreparedLog, motions: SlipMotions, model: Model) -> str:
        """Return a sentence if the given delay disagrees with the log; empty otherwise.

        Parameters
        ----------
        log, motions
            As prepared.
        model
            Of the log, with the given delay of the effort.
        """

        def estimated() -> float:
            free = replace(self, effort_delay=None, exclude=())._with_delay(log, motions)
            return free.rows.delay * log.sampling_time

        return wrong_delay(model, self.effort_delay, estimated, self.tuning.plausibility)

    def _left_out(self, log: PreparedLog, motions: SlipMotions) -> str:
        """Return which terms a selection would add; empty if none."""
        return lacking_terms(replace(self, select=True)._selected(log, motions)[0], self.include)

    def followed(
        self, log: PreparedLog, motions: SlipMotions
    ) -> tuple[Model, Sequence[Term], SlipMotions, list[str]]:
        """Return model, tried terms, the motion without saturated samples, and notes.

        Parameters
        ----------
        log, motions
            As prepared.
        """
        motions, notes = self._unclipped(log, motions)
        model, terms = self._selected(log, motions)
        if SATURATION not in model.names:
            return model, terms, motions, notes
        limit = next(shape.value for term, shape in model.chosen if term.name == SATURATION)
        followed, note = without_saturation(motions, limit, log.log, self.tuning.saturation)
        model, terms = self._selected(log, followed, saturation=False)
        if saturates(model, motions, limit, self.tuning.saturation):
            return model, terms, followed, [*notes, note]
        model, terms = self._selected(log, motions, saturation=False)
        return model, terms, motions, notes

    def _unclipped(self, log: PreparedLog, motions: SlipMotions) -> tuple[SlipMotions, list[str]]:
        """Return the motions without samples that are clipped within the noise, and notes."""
        tuning = self.tuning.clipping
        found = plateaus(motions, tuning)
        if not found.ends:
            return motions, []
        model = self._with_delay(log, without_plateaus(motions, found, log.log)[0])
        proven = clipped(model, motions, found, tuning)
        if not proven.ends:
            return motions, []
        inside, note = without_plateaus(motions, proven, log.log)
        return inside, [note]

    def _selected(
        self, log: PreparedLog, motions: SlipMotions, *, saturation: bool = True
    ) -> tuple[Model, Sequence[Term]]:
        """Return the model that the log supports, and the terms that were tried."""
        T, tuning = log.sampling_time, self.tuning.search
        model = Model(
            rows=window_rows(motions.stretches, window_weight(log, motions, tuning)),
            inertia=self.inertia,
            offset=self.offset,
            origin=motions.reference_position,
        )
        if self.effort_delay is not None:
            model = model.shifted(self.effort_delay / T)
        if model.rows.size == 0:
            return model, ()
        # A term that explains less than the rounding error of the effort may describe that error
        rounding = effort_step(motions, self.tuning.plausibility) / ROUNDING
        size = float(np.sqrt(np.mean(model.rows.own_effort**2)))
        tuning = replace(
            tuning, smallest_share=max(tuning.smallest_share, rounding / max(size, _TINY))
        )
        terms = [DELAY_TERM, *candidate_terms(motions, log.log.kind)]
        left_out = self.not_selectable(
            delay_known=self.effort_delay is not None,
            inertia_known=self.inertia is not None,
            noisy=noisy_elasticity(model.rows, motions),
        )
        left_out |= set() if saturation else {SATURATION}
        offered = [term for term in terms if term.name not in left_out]

        def found(start: Model, include: Sequence[str]) -> Model:
            fixed = with_terms(start, terms, include, tuning)
            if not self.select:
                return fixed
            return search(fixed, offered, tuning, ripple="ripple" not in left_out)

        best = found(model, self.include)
        sought = DELAY in self.include or (self.select and DELAY not in left_out)
        if sought and (delay := scanned_delay(model, best, tuning)):
            best = found(model.shifted(delay), tuple(dict.fromkeys((DELAY, *self.include))))
        if DELAY not in self.include and abs(best.rows.delay) * T < best.elastic_lag:
            offered = [term for term in offered if term.name != DELAY]
            if DELAY in best.names:
                best = found(model, self.include)
        return best, offered if self.select else ()

    def not_selectable(self, *, delay_known: bool, inertia_known: bool, noisy: bool) -> set[str]:
        """Return the names of the terms that a selection does not add.

        Parameters
        ----------
        delay_known
            Whether the delay of the effort is known.
        inertia_known
            Whether the inertia is known.
        noisy
            Whether the fourth derivative of the position is mostly noise.
        """
        names = set(self.exclude)
        if delay_known:
            names.add(DELAY)
        if not self.offset:  # friction per direction would contain one
            names.add(DIRECTION)
        # A wrong inertia has a similar column as an elastic drive
        if inertia_known or noisy:
            names.add(ELASTIC)
        return names

    def _solved(
        self,
        log: PreparedLog,
        motions: SlipMotions,
        model: Model,
        rows: ModelRows,
        notes: Sequence[str],
        shifts: Float[np.ndarray, "k p"] | None = None,
        law_shifts: Float[np.ndarray, "laws p"] | None = None,
    ) -> tuple[FrictionEstimate, Regression]:
        """Return the estimate with its rows."""
        regression = rows.regression(
            log, motions, model, shifts=shifts, law_shifts=law_shifts, notes=notes
        )
        regression = replace(regression, nuisance=nuisance(rows.names, model, self.include))
        provenance = provenance_of(log.log, self.options())
        return solve(regression, estimator=self.name, provenance=provenance), regression

    def options(self) -> Mapping[str, Any]:
        """Return every option, as plain values."""
        return {
            "estimator": self.name,
            "inertia": self.inertia,
            "offset": self.offset,
            "include": list(self.include),
            "exclude": list(self.exclude),
            "select": self.select,
            "effort_delay": self.effort_delay,
            "effort_kind": self.effort_kind,
        }
