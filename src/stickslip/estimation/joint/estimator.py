"""Identification of a rigid axis from several logs, with one model for all of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import solve
from stickslip.estimation.joint.consistency import ConsistencyTuning, compared
from stickslip.estimation.joint.members import (
    Member,
    joint_excitation,
    joint_motions,
    joint_provenance,
    with_time_shift,
)
from stickslip.estimation.joint.model import JointModel, StackedRows, difference_terms, joint_rows
from stickslip.estimation.joint.summary import difference_texts, joint_logs, joint_selection
from stickslip.estimation.selection.dwell import RestedLog, with_dwell
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.intervals.deviations import deviations
from stickslip.estimation.selection.intervals.rival_law import rival_laws, rival_note, rival_shifts
from stickslip.estimation.selection.intervals.widening import of_unknown_delay
from stickslip.estimation.selection.judgement.plausibility import (
    implausible_time,
    implausible_units,
    reversed_sign,
    ripple_of_degrees,
    unsettled_delay,
    within_presliding,
    wrong_inertia,
)
from stickslip.estimation.selection.judgement.status import (
    causes_of_fit,
    judged,
    lacking_terms,
    undetermined_terms,
)
from stickslip.estimation.selection.model import DELAY_TERM, Model
from stickslip.estimation.selection.model_rows import ModelRows, column_noise, model_rows, nuisance
from stickslip.estimation.selection.search.forward import search, with_terms
from stickslip.estimation.selection.search.windows import noisy_elasticity, window_weight
from stickslip.estimation.selection.terms import DELAY, DWELL, SATURATION, Term, candidate_terms
from stickslip.estimation.weak_form.motion import slip_motions
from stickslip.estimation.weak_form.rows import window_rows
from stickslip.records import AxisLog, FrictionEstimate, InputError, mass_name, shared_name


@dataclass(frozen=True, kw_only=True)
class JointTuning:
    """Tuning of `JointEstimator`."""

    consistency: ConsistencyTuning = field(default_factory=ConsistencyTuning)
    smallest_level: float = 1e-3
    """Smallest level of a log's residual over its effort [-]: errors of a sampled motion can be as
    large. It limits the weight of a simulated log without noise."""
    level_change: float = 1.2
    """Change of the ratio of two levels after which the terms are selected again [-]."""
    fewest_rows: int = 12
    """Fewest windows of a log [-]: with fewer, the level of its residual is too uncertain."""


@dataclass(frozen=True, kw_only=True)
class JointEstimator:
    """Least squares over windows of slip in several logs of one axis.

    Inertia, friction and the selected terms are common to all logs. Each log has an offset of its
    own; if the delay of the effort or a drift is selected, each log has its own. Rows are weighted
    by the residual of their log, so that a noisy log does not spoil a good one. Whether the logs
    show the same common parameters is tested (`stickslip.estimation.joint.consistency`).

    Attributes
    ----------
    single
        Estimator of one log, whose settings apply to all of them.
    delays
        Known delay of the effort by name of the log [s]; those of the other logs are estimated, if
        a log shows one.
    tuning
        Tuning of the method.

    Raises
    ------
    InputError
        If a delay is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip.records import AxisLog
    >>> time = np.arange(0, 10, 0.001)
    >>> velocity = 0.1 * np.sin(2 * time) + 0.05 * np.sin(5 * time)
    >>> position = -0.05 * np.cos(2 * time) - 0.01 * np.cos(5 * time)
    >>> acceleration = 0.2 * np.cos(2 * time) + 0.25 * np.cos(5 * time)
    >>> effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity
    >>> logs = [
    ...     AxisLog(name=name, kind="linear", time=time, effort=effort + offset,
    ...             measured_position=position)
    ...     for name, offset in (("morning", 0.2), ("evening", 0.3))
    ... ]
    >>> found = JointEstimator().fit(logs)
    >>> round(found.value("coulomb_friction"), 1), round(found.value("offset[evening]"), 1)
    (1.5, 0.3)
    """

    single: SelectedModelEstimator = field(default_factory=SelectedModelEstimator)
    delays: Mapping[str, float] = field(default_factory=dict)
    tuning: JointTuning = field(default_factory=JointTuning)

    def __post_init__(self) -> None:
        for delay in self.delays.values():
            replace(self.single, effort_delay=delay)  # validates the delay

    def fit(self, logs: Sequence[AxisLog]) -> FrictionEstimate:
        """Estimate the parameters from several logs.

        Parameters
        ----------
        logs
            Of one rigid axis, with different names.

        Raises
        ------
        InputError
            If a log has no motion or no effort, or it has no window of slip.
        """
        return self.details(logs).estimate

    def details(self, logs: Sequence[AxisLog]) -> Fit:
        """Return the estimate with its rows, for a report; see `fit`."""
        unknown = [name for name in self.delays if name not in {log.name for log in logs}]
        if unknown:
            raise InputError(
                "delay_of_unknown_log", log=unknown[0], logs=[log.name for log in logs]
            )
        tuning = self.single.tuning
        members = [self._member(log) for log in logs]
        kind = mass_name(logs[0].kind)
        model, terms = self._selected(members, self.single.inertia)
        wrong = wrong_inertia(model, kind, logs[0].unit(kind), tuning.plausibility)
        if wrong:
            model, terms = self._selected(members, None)
        rows = joint_rows(model, kind)
        notes = [f"{each.name}: {note}" for each in members for note in each.notes]
        notes += undetermined_terms(
            model, self.single.include, "these logs do not determine it, or give"
        )
        rivals = rival_laws(model, terms, tuning.rival)
        note = rival_note(model, rivals, logs[0].kind, logs[0].unit("effort"), tuning.rival)
        notes += [note] if note else []
        estimate, regression = self._solved(members, model, rows, notes, None)
        common = _common_parameters(estimate)
        consistency = compared(rows, model.logs, common, self.tuning.consistency)
        matter, others = difference_texts(consistency, model, logs[0])

        def rows_of(wide: Model) -> ModelRows:
            return joint_rows(_joint(wide), kind, rows.names)

        shifts = [*self._shifts(model, rows, estimate, terms, rows_of), *consistency.shifts]
        notes += others
        counted = rivals if terms else []
        rows_of_rivals = [rows_of(rival.model) for rival in counted]
        law_shifts = rival_shifts(model, rows, counted, rows_of_rivals, logs[0].kind)
        if shifts or law_shifts is not None:
            widened = np.array(shifts) if shifts else None
            estimate, regression = self._solved(
                members, model, consistency.rows, notes, widened, law_shifts
            )
        causes = [wrong, *self._causes(members, model, estimate), *matter]
        estimate = replace(
            estimate,
            selection=joint_selection(model, members),
            joint=joint_logs(members, model, consistency, self.tuning.consistency.error_rate),
        )
        estimate = self._with_dwell(members, model, estimate)
        return Fit(
            estimate=judged(estimate, [cause for cause in causes if cause]),
            rows=regression,
            inertia=model.inertia,
            model=model,
        )

    def _shifts(
        self,
        model: JointModel,
        rows: ModelRows,
        estimate: FrictionEstimate,
        terms: Sequence[Term],
        rows_of: Callable[[Model], ModelRows],
    ) -> list[Float[np.ndarray, " p"]]:
        """Return deviations of the parameters beyond their sampling error [SI].

        ``terms`` are those that were tried, ``rows_of`` returns the rows of a model.
        """
        unknown_delay = None
        if DELAY not in model.names and not any(model.delay_known):
            unknown_delay = of_unknown_delay(model, rows, self.single.tuning.intervals)
        return deviations(model, rows, estimate, terms, rows_of, unknown_delay, self.single.tuning)

    def _causes(
        self, members: Sequence[Member], model: JointModel, estimate: FrictionEstimate
    ) -> list[str]:
        """Return the causes of a mismatch of all logs together, and of each log alone."""
        tuning, log = self.single.tuning.plausibility, members[0].log.log
        kind = mass_name(log.kind)
        motions = joint_motions(each.motions for each in members)
        causes = [
            f"{each.name}: {cause}"
            for each in members
            for cause in (
                implausible_time(each.log, tuning),
                implausible_units(each.log, each.motions, tuning),
            )
            if cause
        ]
        if not self.single.select:
            selecting = replace(self, single=replace(self.single, select=True))
            selected, _ = selecting._selected(members, model.inertia)
            causes.append(lacking_terms(selected, self.single.include))
        causes += [
            unsettled_delay(model, self.single.tuning.search),
            ripple_of_degrees(model, log.kind),
            within_presliding(model, estimate, self.single.include, motions),
        ]
        for k, each in enumerate(members):
            alone = model.of_log(k)
            own = (
                wrong_inertia(alone, kind, log.unit(kind), tuning)
                or reversed_sign(alone, kind, tuning),
                self._single_of(each.name).wrong_delay(each.log, each.motions, alone),
                *causes_of_fit(
                    each.log,
                    each.motions,
                    alone,
                    model_rows(alone, kind),
                    estimate,
                    self.single.tuning,
                    each.middle,
                ),
            )
            causes += [f"{each.name}: {cause}" for cause in own if cause]
        return causes

    def _with_dwell(
        self, members: Sequence[Member], model: JointModel, estimate: FrictionEstimate
    ) -> FrictionEstimate:
        """Return the estimate with the growth of the breakaway friction, if the logs show it."""
        single = self.single
        if not single.seeks_dwell:
            return estimate
        rested = [
            RestedLog(
                log=each.log,
                motions=with_time_shift(each.motions, each.middle),
                estimate=estimate.of_log(each.name),
            )
            for each in members
        ]
        estimate, score = with_dwell(
            estimate,
            rested,
            single.tuning.search,
            single.tuning.dwell,
            inertia=model.inertia,
            include=DWELL in single.include,
        )
        return replace(estimate, selection=joint_selection(model, members, score))

    def _member(self, log: AxisLog) -> Member:
        """Return a log as prepared, without samples in which its drive saturates."""
        single = self._single_of(log.name)
        found = single.prepared(log)
        motions = slip_motions(found, single.tuning.motion)
        _, _, motions, notes = single.followed(found, motions)
        middle = motions.reference_time
        return Member(
            log=found,
            motions=with_time_shift(motions, -middle),
            notes=(*found.notes, *notes),
            middle=middle,
        )

    def _single_of(self, log: str) -> SelectedModelEstimator:
        """Return the estimator of one log, with the delay that is known of it."""
        return replace(self.single, effort_delay=self._known_delay(log))

    def _known_delay(self, log: str) -> float | None:
        return self.delays.get(log, self.single.effort_delay)

    def _selected(
        self, members: Sequence[Member], inertia: float | None
    ) -> tuple[JointModel, Sequence[Term]]:
        """Return the model that the logs support together, and the terms that were tried."""
        single, smallest = self.single, self.tuning.smallest_level
        start = self._start(members, inertia)
        motions = joint_motions(each.motions for each in members)
        parts = zip(start.rows.parts, members, strict=True)
        left_out = single.not_selectable(
            delay_known=all(start.delay_known),
            inertia_known=inertia is not None,
            noisy=any(noisy_elasticity(rows, each.motions) for rows, each in parts),
        )
        left_out.add(SATURATION)
        terms = [
            term
            for term in (DELAY_TERM, *candidate_terms(motions, members[0].log.log.kind))
            if term.name not in left_out or term.name in single.include
        ]
        model = self._searched(start, terms, left_out)
        again = model.with_levels(smallest)
        change = np.log(np.array(again.levels) / np.array(start.levels))
        if np.ptp(change) > np.log(self.tuning.level_change):
            start = replace(start, levels=again.levels)
            again = self._searched(start, terms, left_out).with_levels(smallest)
        tried = [term for term in terms if term.name not in left_out and single.select]
        return again.without_differences(), tried

    def _searched(self, start: JointModel, terms: Sequence[Term], left_out: set[str]) -> JointModel:
        """Return the model with its included and selected terms."""
        tuning, single = self.single.tuning.search, self.single
        model = with_terms(start, terms, single.include, tuning)
        if single.select:
            offered = [term for term in terms if term.name not in left_out]
            offered += difference_terms(start.logs, inertia=start.inertia is None)
            more = replace(tuning, most_terms=tuning.most_terms + len(start.logs))
            model = search(model, offered, more, ripple="ripple" not in left_out)
        return cast("JointModel", model)

    def _start(self, members: Sequence[Member], inertia: float | None) -> JointModel:
        """Return the model without terms, with the residual that each log leaves by itself."""
        tuning = self.single.tuning.search
        parts: list[Model] = []
        for each in members:
            T = each.log.sampling_time
            weight = window_weight(each.log, each.motions, tuning)
            part = Model(
                rows=window_rows(each.motions.stretches, weight),
                inertia=inertia,
                offset=self.single.offset,
            )
            delay = self._known_delay(each.name)
            part = part if delay is None else part.shifted(delay / T)
            if part.rows.size == 0:
                raise InputError("joint_log_without_slip", where=each.name)
            if part.rows.size < self.tuning.fewest_rows:
                raise InputError(
                    "joint_log_too_short",
                    where=each.name,
                    windows=part.rows.size,
                    least=self.tuning.fewest_rows,
                )
            parts.append(part)
        levels: list[float] = []
        for part in parts:
            residual = float(np.linalg.norm(part.basis().residual)) / np.sqrt(part.rows.size)
            least = self.tuning.smallest_level * np.sqrt(np.mean(part.rows.effort**2))
            levels.append(max(float(residual), float(least), float(np.finfo(float).tiny)))
        return JointModel(
            rows=StackedRows.of([part.rows for part in parts]),
            inertia=inertia,
            offset=self.single.offset,
            logs=tuple(each.name for each in members),
            levels=tuple(levels),
            delay_known=tuple(self._known_delay(each.name) is not None for each in members),
        )

    def _solved(
        self,
        members: Sequence[Member],
        model: JointModel,
        rows: ModelRows,
        notes: Sequence[str],
        shifts: Float[np.ndarray, "k p"] | None,
        law_shifts: Float[np.ndarray, "laws p"] | None = None,
    ) -> tuple[FrictionEstimate, Regression]:
        """Return the estimate with its rows."""
        noises = [
            column_noise(rows.names, each.motions, part.weight) / level
            for each, part, level in zip(members, model.rows.parts, model.levels, strict=True)
        ]
        shares = np.array([part.size for part in model.rows.parts]) / model.rows.size
        regression = Regression(
            kind=members[0].log.log.kind,
            names=rows.names,
            time=np.concatenate(
                [part.time + t for part, t in zip(model.rows.parts, model.begins, strict=True)]
            ),
            target=rows.target,
            regressors=rows.columns,
            regressor_noise=np.sqrt(shares @ np.array(noises) ** 2),
            quantity="effort",
            motion=joint_excitation(members, model),
            samples=sum(len(each.log.log) for each in members),
            notes=tuple(notes),
            shifts=shifts,
            law_shifts=law_shifts,
            slow_residual=True,
            effort=model.scaled(model.rows.effort),
            log=rows.log,
            nuisance=nuisance(rows.names, model, self.single.include),
        )
        provenance = joint_provenance(
            [each.log.log for each in members],
            {**self.single.options(), "effort_delays": dict(self.delays)},
        )
        return solve(regression, estimator=self.single.name, provenance=provenance), regression


def _common_parameters(estimate: FrictionEstimate) -> list[str]:
    """Return the names of the identified parameters that all logs share."""
    return [
        name
        for name, parameter in estimate.parameters.items()
        if parameter.identified and name == shared_name(name)
    ]


def _joint(model: Model) -> JointModel:
    """Narrow the type of a model that was made from a joint one."""
    return cast("JointModel", model)
