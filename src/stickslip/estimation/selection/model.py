"""A model of the effort: a force balance with further terms, over windows of slip."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.selection.significance import Basis
from stickslip.estimation.selection.terms import DELAY, ELASTIC, Term
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.estimation.weak_form.rows import Shape, WindowRows, window_rows
from stickslip.records import TermScore

_ROWS_PER_COLUMN = 3
"""Rows of a model for each of its columns, below which no further term is tested."""

_ELASTIC_DAMPING = 0.2
"""Twice the largest damping ratio of an elastic drive, its friction included [-]."""

LARGEST_STEP = 3.0  #: Largest step of a delay [samples]: the effort is nearly linear in it there.


@dataclass(frozen=True, kw_only=True)
class Model:
    """A force balance with some terms beyond inertia, viscous and Coulomb friction and offset."""

    rows: WindowRows  #: The windows, with the delay of the effort that belongs to the model.
    inertia: float | None  #: Known mass or inertia [kg or kg m^2]; None if it is estimated.
    offset: bool = True  #: Whether a constant effort acts.
    viscous: bool = True  #: Whether friction has a part that is proportional to the speed.
    #: Terms and their shapes, in the order of their selection.
    chosen: tuple[tuple[Term, Shape], ...] = ()
    scores: tuple[TermScore, ...] = ()  #: Score of every term that was tested.
    settled: bool = True  #: Whether the delay of the effort was found within its bounds.
    origin: float = 0.0  #: Position at which a ripple has the phase zero [m or rad].

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the selected terms."""
        return tuple(term.name for term, _ in self.chosen)

    def scaled(self, values: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
        """Return rows with the weight that they have in the fit."""
        return values

    def target(self) -> Float[np.ndarray, " n"]:
        """Return the effort less that of a model and of a known inertia [N or N m]."""
        effort = self.rows.own_effort
        if self.inertia is not None:
            effort = effort - self.inertia * self.rows.acceleration
        return self.scaled(effort)

    def base(self) -> Float[np.ndarray, "n p"]:
        """Return the columns of inertia, viscous friction, Coulomb friction and offset."""
        rows = self.rows
        columns = [rows.direction]
        if self.offset:
            columns.extend(self.offset_columns().T)
        if self.viscous:
            columns.insert(0, rows.velocity)
        if self.inertia is None:
            columns.insert(0, rows.acceleration)
        return self.scaled(np.column_stack(columns))

    def offset_columns(self) -> Float[np.ndarray, "n p"]:
        """Return the columns of the constant efforts."""
        return np.ones((self.rows.size, 1))

    def term_columns(self, term: Term, shape: Shape) -> Float[np.ndarray, "n p"]:
        """Return the columns of a term."""
        if term.name == DELAY:
            return self.effort_slope[:, None]
        if term.name == ELASTIC:
            return self.scaled(self.rows.snap)[:, None]
        return self.scaled(self.rows.means(shape))

    @cached_property
    def effort_slope(self) -> Float[np.ndarray, " n"]:
        """Return the change of the effort in a sample as the model predicts it [N or N m].

        The slope of the logged effort consists mostly of noise. As a regressor it would attenuate
        the delay and narrow its interval.
        """
        chosen = tuple(pair for pair in self.chosen if pair[0].name != DELAY)
        plain = replace(self, chosen=chosen)
        later, earlier = (replace(plain, rows=self.rows.moved(k)) for k in (1, -1))
        slope = 0.5 * (later.columns() - earlier.columns()) @ plain.solution
        slope += 0.5 * self.scaled(later.rows.model_effort - earlier.rows.model_effort)
        if self.inertia is not None:
            change = later.rows.acceleration - earlier.rows.acceleration
            slope += 0.5 * self.inertia * self.scaled(change)
        return slope

    def with_term(self, term: Term, shape: Shape) -> "Model":
        """Return the model with a further term."""
        return replace(self, chosen=(*self.chosen, (term, shape)))

    def columns(self, without: str = "") -> Float[np.ndarray, "n p"]:
        """Return all columns, or those without one term."""
        kept = [self.term_columns(t, s) for t, s in self.chosen if t.name != without]
        return np.column_stack([self.base(), *kept])

    @cached_property
    def solution(self) -> Float[np.ndarray, " p"]:
        """Coefficients of all columns in the least-squares fit [SI]."""
        return least_squares(self.columns(), self.target())

    def residual(self) -> Float[np.ndarray, " n"]:
        """Return the target less the fitted columns [N or N m]."""
        return self.target() - self.columns() @ self.solution

    def friction(self) -> tuple[float, float]:
        """Return Coulomb and viscous friction [SI]."""
        values = self.solution
        at = 0 if self.inertia is not None else 1
        if not self.viscous:
            return float(values[at]), 0.0
        return float(values[at + 1]), float(values[at])

    def fitted_effort(self) -> Float[np.ndarray, " n"]:
        """Return the effort that the fit gives the axis, that of a model included [N or N m]."""
        effort = self.columns() @ self.solution
        effort += self.scaled(self.rows.model_effort)
        if self.inertia is not None:
            effort += self.inertia * self.scaled(self.rows.acceleration)
        return effort

    def residual_share(self) -> float:
        """Return the unexplained share of the effort, in rms [-]."""
        size = max(float(np.linalg.norm(self.rows.effort)), np.finfo(float).tiny)
        return float(np.linalg.norm(self.residual())) / size

    def coefficients(self, name: str) -> Float[np.ndarray, " p"]:
        """Return the coefficients of a selected term [SI]."""
        at = self.base().shape[1]
        for term, shape in self.chosen:
            width = self.term_columns(term, shape).shape[1]
            if term.name == name:
                return self.solution[at : at + width]
            at += width
        raise KeyError(name)

    @property
    def elastic_lag(self) -> float:
        """Largest delay of the effort that the damping of an elastic drive can explain [s].

        Relative to 1 / omega of its resonance it is twice the damping ratio.
        """
        if ELASTIC not in self.names:
            return 0.0
        inertia = self.inertia or float(self.solution[0])
        ratio = float(self.coefficients(ELASTIC)[0]) / inertia
        return _ELASTIC_DAMPING * float(np.sqrt(max(ratio, 0.0)))

    def shifted(self, delay: float) -> "Model":
        """Return the model with another delay of the effort [samples]."""
        margin = ceil(abs(delay)) + 1
        if margin <= self.rows.weight.margin:
            return replace(self, rows=replace(self.rows, delay=delay))
        weight = replace(self.rows.weight, margin=margin + 1)
        return replace(self, rows=window_rows(self.rows.motions, weight, delay))

    def over(self, motions: SlipMotions) -> "Model":
        """Return the model over the windows of other motions."""
        rows = self.rows
        return replace(self, rows=window_rows(motions.stretches, rows.weight, rows.delay))

    @property
    def delays(self) -> Float[np.ndarray, " k"]:
        """Delays of the effort that the model estimates [samples]."""
        return np.array([self.rows.delay])

    def with_delays(self, delays: Float[np.ndarray, " k"]) -> "Model":
        """Return the model with other `delays` [samples], over the same windows if they fit."""
        return self.shifted(float(delays[0]))

    def stepped(self, largest_delay: float) -> tuple["Model", float]:
        """Return the model after a Gauss-Newton step of the delay, and its size [samples].

        ``largest_delay`` limits the delay of the effort in both directions [s].
        """
        most = largest_delay / self.rows.weight.sampling_time
        step = float(np.clip(self.coefficients(DELAY)[0], -LARGEST_STEP, LARGEST_STEP))
        delay = float(np.clip(self.rows.delay + step, -most, most))
        # A delay beyond the bounds is not found, even if the step would be small
        return self.shifted(delay), max(abs(step), abs(delay - self.rows.delay))

    def basis(self) -> Basis:
        """Return the columns in orthonormal coordinates, with the residual of the target."""
        return Basis.of(self.columns(), self.target(), self.rows.log)


DELAY_TERM = Term(
    name=DELAY,
    text="the effort acts later or earlier than it is logged",
    shapes=(Shape(names=("effort_delay",), columns=()),),
)


def testable(model: Model) -> bool:
    """Return whether there are enough rows to test a further term."""
    return model.rows.size >= _ROWS_PER_COLUMN * model.columns().shape[1]


def smallest_ratio(columns: Float[np.ndarray, "n p"]) -> float:
    """Return the smallest over the largest singular value of the columns at unit norm [-]."""
    norms = np.linalg.norm(columns, axis=0)
    if np.any(norms == 0) or columns.shape[0] < columns.shape[1]:
        return 0.0
    singular = np.linalg.svd(columns / norms, compute_uv=False)
    return float(singular[-1] / singular[0])
