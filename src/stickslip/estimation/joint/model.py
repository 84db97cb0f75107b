"""A model that several logs share, apart from their offsets, delays and drifts.

    u_i = m a_i + c v_i + f_c sign(v_i) + sum_j theta_j g_j + f_0i + (delay and drifts of log i)

The rows of log i are divided by the level of its residual, so that a noisy log does not spoil a
good one (weighted least squares).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.estimation.joint.consistency import compared_logs
from stickslip.estimation.selection.model import LARGEST_STEP, Model
from stickslip.estimation.selection.model_rows import ModelRows, model_rows, with_shapes
from stickslip.estimation.selection.terms import DELAY, Term
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.estimation.weak_form.rows import Column, Shape, WindowRows

_OWN_TERMS = (DELAY, "offset drift", "friction drift", "gain drift")
_OWN_PARAMETERS = (
    "offset",
    "effort_delay",
    "offset_drift",
    "friction_drift",
    "viscous_drift",
    "gain_drift",
)
_DIFFERENCE = "difference of "


class JointMotions(SlipMotions):
    """The motion of several logs, the time of each counted from the middle of that log."""

    @property
    def reference_time(self) -> float:
        """Middle of every log [s], at which drifting parameters have the values given."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class StackedRows(WindowRows):
    """Rows of several logs, whose sampling times and windows may differ."""

    parts: tuple[WindowRows, ...]  # of each log

    @classmethod
    def of(cls, parts: Sequence[WindowRows]) -> "StackedRows":
        """Return the rows of all logs, one log after another."""
        moves = np.cumsum([0, *(part.moves for part in parts)])
        return cls(
            motions=tuple(motion for part in parts for motion in part.motions),
            weight=max((part.weight for part in parts), key=lambda weight: weight.duration),
            delay=0.0,  # each log has its own
            middles=tuple(middles for part in parts for middles in part.middles),
            move=np.concatenate([part.move + k for part, k in zip(parts, moves, strict=False)]),
            parts=tuple(parts),
        )

    @cached_property
    def log(self) -> Int[np.ndarray, " n"]:
        """Number of the log that each row is from [-]."""
        return np.repeat(np.arange(len(self.parts)), [part.size for part in self.parts])

    @cached_property
    def indicators(self) -> Float[np.ndarray, "n k"]:
        """Whether each row is from each log, 1 or 0 [-]."""
        return (self.log[:, None] == np.arange(len(self.parts))).astype(float)

    def moved(self, samples: int) -> "StackedRows":
        """Return rows of the same windows a sample later (1) or earlier (-1)."""
        return StackedRows.of([part.moved(samples) for part in self.parts])

    def widened(self, factor: float) -> "StackedRows":
        """Return rows of windows that are wider by a factor [-]."""
        return StackedRows.of([part.widened(factor) for part in self.parts])

    def _filtered(
        self, column: Column, taps_of: Callable[[WindowRows], Float[np.ndarray, " k"]]
    ) -> Float[np.ndarray, " n"]:
        return np.concatenate([part._filtered(column, taps_of) for part in self.parts])


@dataclass(frozen=True, kw_only=True)
class DifferenceTerm(Term):
    """A difference of a parameter in one log from the others.

    It competes with the terms in the search, so that no term is selected to explain a log of
    another axis. The final model does not contain it.
    """

    log: int  # number of that log
    column: str  # "acceleration", "velocity" or "direction", of StackedRows


def difference_terms(logs: Sequence[str], *, inertia: bool) -> tuple[DifferenceTerm, ...]:
    """Return the differences of viscous and Coulomb friction, and of an estimated inertia."""
    columns = ("velocity", "direction", *(("acceleration",) if inertia else ()))
    own = compared_logs(len(logs))
    return tuple(
        DifferenceTerm(
            name=f"{_DIFFERENCE}{column} in {logs[k]}",
            text="one log differs from the others",
            shapes=(Shape(names=(column,), columns=()),),
            tests=len(own) * len(columns),
            log=k,
            column=column,
        )
        for k in own
        for column in columns
    )


@dataclass(frozen=True, kw_only=True)
class JointModel(Model):
    """A force balance of several logs."""

    rows: StackedRows  # windows of all logs, with the delay of the effort of each
    logs: tuple[str, ...]  # names
    levels: tuple[float, ...]  # root mean square of the residual of each log [N or N m]
    delay_known: tuple[bool, ...]  # whether the delay of each log was given

    def scaled(self, values: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return rows divided by the level of their log."""
        return (values.T / np.array(self.levels)[self.rows.log]).T

    def offset_columns(self) -> Float[np.ndarray, "n p"]:
        """Return the column of the offset of each log."""
        return self.rows.indicators

    def term_columns(self, term: Term, shape: Shape) -> Float[np.ndarray, "n p"]:
        """Return the columns of a term; of a delay or drift, those of each log."""
        if isinstance(term, DifferenceTerm):
            own = self.rows.indicators[:, term.log]
            return self.scaled((own * getattr(self.rows, term.column))[:, None])
        columns = super().term_columns(term, shape)
        if term.name not in _OWN_TERMS:
            return columns
        own = self.rows.indicators
        if term.name == DELAY:
            own = own[:, ~self._delay_known]
        return np.column_stack([columns * each[:, None] for each in own.T])

    @property
    def delays(self) -> Float[np.ndarray, " k"]:
        """Delays of the effort of the logs where it is not known [samples]."""
        delays = np.array([part.delay for part in self.rows.parts])
        return delays[~self._delay_known]

    def with_delays(self, delays: Float[np.ndarray, " k"]) -> "JointModel":
        """Return the model with other `delays` [samples], over the same windows if they fit."""
        every = np.array([part.delay for part in self.rows.parts])
        every[~self._delay_known] = delays
        parts = [self.of_log(k).shifted(delay).rows for k, delay in enumerate(every.tolist())]
        return replace(self, rows=StackedRows.of(parts))

    def stepped(self, largest_delay: float) -> tuple["JointModel", float]:
        """Return the model after a Gauss-Newton step of all delays, and the largest step [samples].

        The size of the delays is at most ``largest_delay`` [s].
        """
        steps = np.zeros(len(self.logs))
        found = np.clip(self.coefficients(DELAY), -LARGEST_STEP, LARGEST_STEP)
        steps[~self._delay_known] = found
        parts: list[Model] = []
        for k, step in enumerate(steps.tolist()):
            part = self.of_log(k)
            most = largest_delay / part.rows.weight.sampling_time
            delay = float(np.clip(part.rows.delay + step, -most, most))
            # A delay beyond the bounds is not found, even if the step would be small
            steps[k] = max(abs(step), abs(delay - part.rows.delay))
            parts.append(part.shifted(delay))
        rows = StackedRows.of([part.rows for part in parts])
        return replace(self, rows=rows), float(np.max(np.abs(steps)))

    def of_log(self, k: int) -> Model:
        """Return the model of one log alone."""
        chosen = self.chosen
        if self.delay_known[k]:
            chosen = tuple((term, shape) for term, shape in chosen if term.name != DELAY)
        return Model(
            rows=self.rows.parts[k],
            inertia=self.inertia,
            offset=self.offset,
            viscous=self.viscous,
            chosen=chosen,
        )

    @property
    def begins(self) -> tuple[float, ...]:
        """Shift of the time of each log [s], so that each begins at the end of the one before."""
        begins: list[float] = []
        end = 0.0
        for part in self.rows.parts:
            first, last = part.motions[0].time[0], part.motions[-1].time[-1]
            begins.append(end - float(first))
            end += float(last - first) + part.weight.sampling_time
        return tuple(begins)

    def without_differences(self) -> "JointModel":
        """Return the model with the parameters that are common to all logs."""
        return replace(
            self,
            chosen=tuple(each for each in self.chosen if not isinstance(each[0], DifferenceTerm)),
            scores=tuple(s for s in self.scores if not s.term.startswith(_DIFFERENCE)),
        )

    def with_levels(self, smallest: float) -> "JointModel":
        """Return the model with the levels of the residual that it leaves in each log.

        They are at least the smallest, relative to the effort.
        """
        basis = self.basis()
        squares = (basis.residual * np.array(self.levels)[self.rows.log]) ** 2
        spent = np.sum(basis.vectors**2, axis=1)
        levels: list[float] = []
        for k, part in enumerate(self.rows.parts):
            own = self.rows.log == k
            degrees = max(part.size - float(np.sum(spent[own])), 1.0)
            least = smallest * float(np.sqrt(np.mean(part.effort**2)))
            levels.append(max(float(np.sqrt(np.sum(squares[own]) / degrees)), least))
        return replace(self, levels=tuple(levels))

    @property
    def _delay_known(self) -> Bool[np.ndarray, " k"]:
        return np.array(self.delay_known)


def joint_rows(
    model: JointModel, inertia_name: str, shapes: Sequence[str] | None = None
) -> ModelRows:
    """Return the rows of a joint model in the parameters that are reported.

    Common parameters come first. Those of a log have its name in brackets. Friction per direction
    contains the offset of the first log; the offsets of the others are relative to it. The named
    shapes are parameters too; None for those that the logs determine.
    """
    bent = next((name for name in ("stribeck", "low speed") if name in model.names), None)
    excess = None if bent is None else float(model.coefficients(bent)[0])
    parts = [model_rows(model.of_log(k), inertia_name, excess) for k in range(len(model.logs))]
    columns = [dict(zip(part.names, part.columns.T, strict=True)) for part in parts]
    common = [name for name in parts[0].names if name not in _OWN_PARAMETERS]
    named = {name: np.concatenate([each[name] for each in columns]) for name in common}
    for parameter in _OWN_PARAMETERS:
        for k, log in enumerate(model.logs):
            if parameter in columns[k]:  # zero in the other logs
                own = np.zeros(model.rows.log.size)
                own[model.rows.log == k] = columns[k][parameter]
                named[f"{parameter}[{log}]"] = own
            elif parameter == "offset" and model.offset and k > 0:
                named[f"{parameter}[{log}]"] = model.rows.indicators[:, k]
    rows = ModelRows(
        names=tuple(named),
        columns=model.scaled(np.column_stack(list(named.values()))),
        target=model.scaled(np.concatenate([part.target for part in parts])),
        log=model.rows.log,
    )
    return with_shapes(rows, model, shapes)
