"""Identification of a rigid axis from several logs, with one model for all of them."""

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import MotionSummary, Regression
from stickslip.estimation.fit.solve import provenance_of, solve
from stickslip.estimation.joint.consistency import Consistency, ConsistencyTuning, compared
from stickslip.estimation.joint.model import (
    JointModel,
    JointMotions,
    StackedRows,
    difference_terms,
    joint_rows,
)
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.dwell import RestedLog, with_dwell
from stickslip.estimation.selection.estimator import SelectedModelEstimator, judged, lacking_terms
from stickslip.estimation.selection.faults.change import sudden_change
from stickslip.estimation.selection.faults.nonlinear_gain import nonlinear_gain
from stickslip.estimation.selection.model import DELAY_TERM, Model
from stickslip.estimation.selection.model_rows import (
    ModelRows,
    column_noise,
    model_rows,
    motion_summary,
    nuisance,
)
from stickslip.estimation.selection.plausibility import (
    coarse_effort,
    implausible_time,
    implausible_units,
    reversed_sign,
    ripple_of_degrees,
    too_slow_sampling,
    unexplained_effort,
    unsettled_delay,
    within_presliding,
    wrong_inertia,
    wrong_model,
)
from stickslip.estimation.selection.rival_law import rival_laws, rival_note, rival_shifts
from stickslip.estimation.selection.search.forward import search, with_terms
from stickslip.estimation.selection.search.windows import noisy_elasticity, window_weight
from stickslip.estimation.selection.summary import selection_of
from stickslip.estimation.selection.terms import (
    DELAY,
    DIRECTION,
    DWELL,
    ELASTIC,
    SATURATION,
    Term,
    candidate_terms,
)
from stickslip.estimation.selection.widening import (
    between_windows,
    of_other_terms,
    of_unknown_asymmetry,
    of_unknown_delay,
)
from stickslip.estimation.weak_form.motion import SlipMotions, slip_motions
from stickslip.estimation.weak_form.rows import window_rows
from stickslip.records import (
    AxisLog,
    FrictionEstimate,
    InputError,
    JointLog,
    JointLogs,
    LogDeviation,
    ModelSelection,
    Provenance,
    TermScore,
    in_words,
    mass_name,
    share_text,
    shared_name,
    unit_text,
)


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
class _Member:
    """One log as prepared."""

    log: PreparedLog
    motions: SlipMotions  # with the time counted from the middle
    notes: tuple[str, ...]
    middle: float  # time of the log [s]

    @property
    def name(self) -> str:
        return self.log.log.name


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
        notes += [
            f"the term {name!r} is left out: these logs do not determine it, or give its "
            "coefficient the wrong sign"
            for name in self.single.include
            if name not in {*model.names, DWELL}
        ]
        rivals = rival_laws(model, terms, tuning.rival)
        note = rival_note(model, rivals, logs[0].unit("effort"), tuning.rival)
        notes += [note] if note else []
        estimate, regression = self._solved(members, model, rows, notes, None)
        common = [
            name
            for name, parameter in estimate.parameters.items()
            if parameter.identified and name == shared_name(name)
        ]
        consistency = compared(rows, model.logs, common, self.tuning.consistency)

        def rows_of(wide: Model) -> ModelRows:
            return joint_rows(_joint(wide), kind, rows.names)

        shifts = [*self._shifts(model, rows, estimate, terms, rows_of), *consistency.shifts]
        differences: dict[bool, list[str]] = {True: [], False: []}  # by whether they matter
        for each in consistency.deviations:
            differences[each.material].append(
                difference_text(each, model.logs, logs[0].unit(each.parameter))
            )
        notes += differences[False]
        law_shifts = None
        if terms:
            law_shifts = rival_shifts(rows, rivals, [rows_of(rival.model) for rival in rivals])
        if shifts or law_shifts is not None:
            widened = np.array(shifts) if shifts else None
            estimate, regression = self._solved(
                members, model, consistency.rows, notes, widened, law_shifts
            )
        causes = [wrong, *self._causes(members, model, estimate), *differences[True]]
        estimate = replace(
            estimate,
            selection=self._selection(model, members),
            joint=_joint_logs(members, model, consistency, self.tuning.consistency.error_rate),
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
        tuning = self.single.tuning.intervals
        unknown_delay = None
        if DELAY not in model.names and not any(model.delay_known):
            unknown_delay = of_unknown_delay(model, rows, tuning)
        every = (
            between_windows(model, rows, estimate, rows_of, tuning),
            of_other_terms(model, rows, terms, self.single.tuning.search.largest_p_value, tuning),
            unknown_delay,
            of_unknown_asymmetry(model, rows, terms, tuning),
        )
        return [shift for shift in every if shift is not None]

    def _causes(
        self, members: Sequence[_Member], model: JointModel, estimate: FrictionEstimate
    ) -> list[str]:
        """Return the causes of a mismatch of all logs together, and of each log alone."""
        tuning, log = self.single.tuning.plausibility, members[0].log.log
        kind = mass_name(log.kind)
        motions = _joint_motions(each.motions for each in members)
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
                too_slow_sampling(each.log, each.motions, tuning),
                unexplained_effort(
                    each.log.log, each.motions, alone, model_rows(alone, kind), tuning
                ),
                coarse_effort(alone, each.motions, log.unit("effort"), tuning),
                wrong_model(alone, tuning),
                sudden_change(alone, self.single.tuning.change, each.middle),
                nonlinear_gain(alone, estimate, self.single.tuning.gain),
            )
            causes += [f"{each.name}: {cause}" for cause in own if cause]
        return causes

    def _with_dwell(
        self, members: Sequence[_Member], model: JointModel, estimate: FrictionEstimate
    ) -> FrictionEstimate:
        """Return the estimate with the growth of the breakaway friction, if the logs show it."""
        single, tuning = self.single, self.single.tuning
        include = DWELL in single.include
        if not include and (not single.select or DWELL in single.exclude):
            return estimate
        rested = [
            RestedLog(
                log=each.log,
                motions=_with_time_shift(each.motions, each.middle),
                estimate=estimate.of_log(each.name),
            )
            for each in members
        ]
        estimate, score = with_dwell(
            estimate, rested, tuning.search, tuning.dwell, inertia=model.inertia, include=include
        )
        return replace(estimate, selection=self._selection(model, members, score))

    def _member(self, log: AxisLog) -> _Member:
        """Return a log as prepared, without samples in which its drive saturates."""
        single = self._single_of(log.name)
        found = single.prepared(log)
        motions = slip_motions(found, single.tuning.motion)
        _, _, motions, notes = single.followed(found, motions)
        middle = motions.reference_time
        return _Member(
            log=found,
            motions=_with_time_shift(motions, -middle),
            notes=(*found.notes, *notes),
            middle=middle,
        )

    def _single_of(self, log: str) -> SelectedModelEstimator:
        """Return the estimator of one log, with the delay that is known of it."""
        return replace(self.single, effort_delay=self._known_delay(log))

    def _known_delay(self, log: str) -> float | None:
        return self.delays.get(log, self.single.effort_delay)

    def _selected(
        self, members: Sequence[_Member], inertia: float | None
    ) -> tuple[JointModel, Sequence[Term]]:
        """Return the model that the logs support together, and the terms that were tried."""
        single, smallest = self.single, self.tuning.smallest_level
        start = self._start(members, inertia)
        motions = _joint_motions(each.motions for each in members)
        left_out = {*single.exclude, SATURATION}
        if all(start.delay_known):
            left_out.add(DELAY)
        if not single.offset:  # friction per direction would contain one
            left_out.add(DIRECTION)
        parts = zip(start.rows.parts, members, strict=True)
        noisy = any(noisy_elasticity(rows, each.motions) for rows, each in parts)
        if inertia is not None or noisy:
            left_out.add(ELASTIC)
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

    def _start(self, members: Sequence[_Member], inertia: float | None) -> JointModel:
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
        members: Sequence[_Member],
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
            motion=_motion(members, model),
            samples=sum(len(each.log.log) for each in members),
            notes=tuple(notes),
            shifts=shifts,
            law_shifts=law_shifts,
            slow_residual=True,
            effort=model.scaled(model.rows.effort),
            log=rows.log,
            nuisance=nuisance(rows.names, model, self.single.include),
        )
        provenance = self._provenance([each.log.log for each in members])
        return solve(regression, estimator=self.single.name, provenance=provenance), regression

    def _provenance(self, logs: Sequence[AxisLog]) -> Provenance:
        """Return the provenance, with assumptions that all logs share stated once."""
        options = {**self.single.options(), "effort_delays": dict(self.delays)}
        every = [provenance_of(log, options) for log in logs]
        shared = [
            line for line in every[0].assumptions if all(line in p.assumptions for p in every)
        ]
        own = [
            f"{log.name}: {line}"
            for log, p in zip(logs, every, strict=True)
            for line in p.assumptions
            if line not in shared
        ]
        hashes = [p.input_sha256 for p in every]
        return replace(
            every[0],
            files=tuple(file for p in every for file in p.files),
            input_sha256=(
                hashlib.sha256("".join(hashes).encode()).hexdigest() if all(hashes) else ""
            ),
            assumptions=(*shared, *own),
        )

    def _selection(
        self, model: JointModel, members: Sequence[_Member], further: TermScore | None = None
    ) -> ModelSelection:
        """Return the selection with its summary."""
        first = members[0]
        found = selection_of(model, first.motions, None, first.log.effort_kind, further)
        own = ["an offset"] if model.offset else []
        own += [word for name, word in _OWN_WORDS.items() if name in model.names]
        levels = ", ".join(
            f"{level:.3g} in {log}" for log, level in zip(model.logs, model.levels, strict=True)
        )
        unit = members[0].log.log.unit("effort")
        each = f"Each log has {_listed(own)} of its own. " if own else ""
        return replace(
            found,
            summary=f"One model for {len(members)} logs. {found.summary} {each}Residual of a "
            f"window [{unit}]: {levels}; rows are weighted by its inverse.",
            reference_time=0.0,
        )


_OWN_WORDS = {
    DELAY: "a delay of the effort",
    "offset drift": "a drift of the offset",
    "friction drift": "a drift of friction",
    "gain drift": "a drift of the gain",
}


def _joint(model: Model) -> JointModel:
    """Narrow the type of a model that was made from a joint one."""
    return cast("JointModel", model)


def _with_time_shift(motions: SlipMotions, shift: float) -> SlipMotions:
    """Return the motion with its time shifted [s]."""
    stretches = tuple(replace(m, time=m.time + shift) for m in motions.stretches)
    return replace(motions, stretches=stretches)


def _joint_motions(every: Iterable[SlipMotions]) -> JointMotions:
    """Return the motion of several logs."""
    motions = list(every)
    return JointMotions(
        stretches=tuple(m for each in motions for m in each.stretches),
        slow=min(each.slow for each in motions),
        position_noise=max(each.position_noise for each in motions),
    )


def _listed(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _motion(members: Sequence[_Member], model: JointModel) -> MotionSummary:
    """Return the excitation of all logs together."""
    every = [
        motion_summary(each.log, each.motions, part.weight)
        for each, part in zip(members, model.rows.parts, strict=True)
    ]
    widest = max(every, key=lambda motion: motion.position_range / motion.position_noise)
    return replace(
        widest,
        largest_speed=max(motion.largest_speed for motion in every),
        forward_travel=sum(motion.forward_travel for motion in every),
        backward_travel=sum(motion.backward_travel for motion in every),
        speed_variation=max(motion.speed_variation for motion in every),
    )


def difference_text(deviation: LogDeviation, logs: Sequence[str], unit: str) -> str:
    """Return in words by how much one of the named logs differs, and the remedy."""
    others = "the others" if len(logs) > 2 else logs[0]
    what = in_words(deviation.parameter)
    if deviation.relative > -1.0:
        size = share_text(abs(deviation.relative))
        side = "more" if deviation.relative > 0 else "less"
        sentence = f"{deviation.log} shows {size} {side} {what} than {others}"
    else:  # of zero or of the other sign
        value = deviation.difference / deviation.relative
        unit = unit_text(unit)
        article = "an" if what.startswith(("a", "e", "i", "o")) else "a"
        sentence = (
            f"{deviation.log} shows {article} {what} of {value + deviation.difference:.2g} {unit}, "
            f"{others} {value:.2g} {unit}"
        )
    sentence += f" (p = {deviation.p_value:.1g})"
    if not deviation.material:
        return f"{sentence}; the intervals allow for it"
    alone = "identify it alone" if len(logs) > 2 else "identify each log alone"
    return f"{sentence}; {alone}, and look for what changed between the logs"


def _joint_logs(
    members: Sequence[_Member], model: JointModel, consistency: Consistency, error_rate: float
) -> JointLogs:
    logs = [each.log.log for each in members]
    return JointLogs(
        logs=tuple(
            JointLog(
                name=log.name,
                samples=len(log),
                duration=float(log.time[-1] - log.time[0]),
                sampling_time=log.sampling_time,
                residual=level,
                effort_delay=part.delay * part.weight.sampling_time,
                reference_time=each.middle,
                effort_kind=each.log.effort_kind,
            )
            for log, each, part, level in zip(
                logs, members, model.rows.parts, model.levels, strict=True
            )
        ),
        p_value=consistency.p_value,
        error_rate=error_rate,
        deviations=consistency.deviations,
    )
