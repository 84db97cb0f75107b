"""Which friction law a log supports: cross-validation over kinds of moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from stickslip.estimation.regression.law_selection.fitted_law import FittedLaw
from stickslip.estimation.regression.law_selection.friction_form import FrictionForm
from stickslip.estimation.regression.law_selection.linear_fit import LinearFit, fit_rows
from stickslip.estimation.regression.law_selection.moves import kinds_of, stretches
from stickslip.estimation.regression.law_selection.ripple import force_ripple
from stickslip.estimation.regression.law_selection.smooth_motion import RowSettings, SmoothMotion
from stickslip.friction import StribeckEffect
from stickslip.records import AxisLog, InputError, quantity_field

__all__ = ["LawCandidate", "LawScore", "LawSelection", "law_candidates", "select_friction_law"]

_LEAST_FOLDS = 3
_STRIBECK_VELOCITIES = 16
_LUBRICANT = 2.0 / 3.0


@dataclass(frozen=True, kw_only=True)
class LawCandidate:
    """A friction law to be judged.

    Attributes
    ----------
    name
        What it is called.
    forms
        One form, or several that differ in what does not enter linearly, of which each fit takes
        the one that leaves least.

    Raises
    ------
    InputError
        If there is no form.
    """

    name: str
    forms: tuple[FrictionForm, ...]

    def __post_init__(self) -> None:
        if not self.forms:
            raise InputError(f"the candidate {self.name!r} has no form", remedy="give one")

    @property
    def size(self) -> int:
        """Number of parameters, inertia included [-]."""
        return 1 + self.forms[0].size


@dataclass(frozen=True, kw_only=True)
class LawScore:
    """How well a law foretells the effort of moves that it was not fitted to.

    Attributes
    ----------
    candidate
        The law.
    fold_errors
        Root mean square error in each fold [N or N m], shape (folds,).
    error
        Root of the mean of their squares [N or N m].
    excess, excess_std
        Mean difference of the squares to those of the law with the smallest error, fold by fold,
        and its standard error [N^2 or (N m)^2].
    """

    candidate: LawCandidate
    fold_errors: Float[np.ndarray, " folds"] = quantity_field("effort")
    error: float = quantity_field("effort")
    excess: float
    excess_std: float

    @property
    def within(self) -> bool:
        """Whether it is within one standard error of the best."""
        return self.excess <= self.excess_std


@dataclass(frozen=True, kw_only=True)
class LawSelection:
    """What cross-validation says.

    Attributes
    ----------
    scores
        One a candidate, in their order.
    chosen
        The candidate with the fewest parameters within one standard error of the best.
    law
        It, fitted to the whole log.
    fit
        The values of that fit with their intervals, the inertia named ``mass`` or ``inertia``. The
        intervals take the Stribeck velocity and the period of a ripple for known.
    """

    scores: tuple[LawScore, ...]
    chosen: LawCandidate
    law: FittedLaw
    fit: LinearFit


def law_candidates(log: AxisLog, rows: RowSettings | None = None) -> tuple[LawCandidate, ...]:
    """Return a ladder of laws, each of which takes one thing more into account.

    Parameters
    ----------
    log
        Whose range of speeds the Stribeck velocities cover, and from which the period of a ripple
        is taken.
    rows
        How its motion is smoothed.
    """
    rows = rows or RowSettings()
    motion = rows.motion(log)
    speeds = np.geomspace(
        2.0 * motion.slow, float(np.max(np.abs(motion.velocity))), _STRIBECK_VELOCITIES
    )
    period = force_ripple(log, rows=rows).period
    plain = FrictionForm(offset=True)
    asymmetric = FrictionForm(viscous_per_direction=True)

    def bending(form: FrictionForm) -> tuple[FrictionForm, ...]:
        return tuple(
            replace(form, stribeck=StribeckEffect(velocity=float(speed), shape="exponential"))
            for speed in speeds
        )

    spring = replace(asymmetric, offset=True, stiffness=True)
    ripple = replace(asymmetric, period=period)
    lubricant = replace(asymmetric, exponent=_LUBRICANT)
    table: dict[str, tuple[FrictionForm, ...]] = {
        "Coulomb, viscous, offset": (plain,),
        "viscous per direction": (asymmetric,),
        "both per direction": (replace(asymmetric, coulomb_per_direction=True),),
        "symmetric, Stribeck": bending(plain),
        "symmetric, ripple": (replace(plain, period=period),),
        "viscous per direction, 2/3 power": (lubricant,),
        "viscous per direction, Stribeck": bending(asymmetric),
        "viscous per direction, spring": (spring,),
        "viscous per direction, ripple": (ripple,),
        "2/3 power, ripple": (replace(lubricant, period=period),),
        "Stribeck, ripple": bending(ripple),
        "Stribeck, spring": bending(spring),
        "Stribeck, ripple of two harmonics": bending(replace(ripple, harmonics=2)),
        "Stribeck, spring, ripple": bending(replace(spring, period=period)),
        "Stribeck, ripple, both per direction": bending(
            replace(ripple, coulomb_per_direction=True)
        ),
    }
    return tuple(LawCandidate(name=name, forms=forms) for name, forms in table.items())


def select_friction_law(
    log: AxisLog,
    candidates: Sequence[LawCandidate] | None = None,
    *,
    rows: RowSettings | None = None,
) -> LawSelection:
    """Choose the simplest law that foretells moves it has not seen as well as the best one.

    A fold is one kind of move with all its repetitions (told apart by where they
    begin and end), so that the law has to hold at other speeds and places than it was fitted to.
    Rests and what is between two moves is always fitted. The squared errors of two laws are
    compared fold by fold: what makes a move hard for both does not count. Of the laws whose excess
    over the best is within one standard error, the one with the fewest parameters is chosen
    (Breiman, Friedman, Olshen and Stone 1984, section 3.4.3).

    Parameters
    ----------
    log
        Without gaps.
    candidates
        Laws to choose from; `law_candidates` of this log if None.
    rows
        How the log becomes rows of the inverse dynamics.

    Raises
    ------
    InputError
        If the log has fewer than three kinds of moves, or no law is determined by it.
    """
    rows = rows or RowSettings()
    motion = rows.motion(log)
    folds = _folds(motion, log.name)
    candidates = law_candidates(log, rows) if candidates is None else candidates
    if not candidates:
        raise InputError("there is no law to choose from", remedy="give one or more candidates")
    tables = [_Rows.of(motion, candidate) for candidate in candidates]
    squares = np.array([table.squares(folds) for table in tables])
    best = squares[int(np.argmin(squares.mean(axis=1)))]
    scores = tuple(
        LawScore(
            candidate=candidate,
            fold_errors=np.sqrt(own),
            error=float(np.sqrt(own.mean())),
            excess=float(np.mean(own - best)),
            excess_std=float(np.std(own - best, ddof=1) / np.sqrt(own.size)),
        )
        for candidate, own in zip(candidates, squares, strict=True)
    )
    inside = [k for k, score in enumerate(scores) if score.within]
    chosen = min(inside, key=lambda k: (candidates[k].size, scores[k].error))
    form = tables[chosen].best()
    rows_of_it = tables[chosen].tables[form]
    inertia = "mass" if log.kind == "linear" else "inertia"
    names = (inertia, *candidates[chosen].forms[form].names)
    fit = fit_rows(names, rows_of_it[:, :-1], rows_of_it[:, -1])
    values = {name: fit.values[name] for name in names[1:]}
    return LawSelection(
        scores=scores,
        chosen=candidates[chosen],
        law=FittedLaw(
            form=candidates[chosen].forms[form], inertia=fit.values[inertia], values=values
        ),
        fit=fit,
    )


@dataclass(frozen=True, kw_only=True)
class _Rows:
    """The rows of each form of a candidate: the regressors, of unit norm, and the target."""

    tables: tuple[Float[np.ndarray, "n c"], ...]

    @classmethod
    def of(cls, motion: SmoothMotion, candidate: LawCandidate) -> "_Rows":
        """Return the rows that a motion gives."""
        tables: list[Float[np.ndarray, "n c"]] = []
        for form in candidate.forms:
            columns = form.columns(motion.position, motion.velocity)
            tables.append(
                motion.decimated(np.column_stack([motion.acceleration, columns, motion.effort]))
            )
        return cls(tables=tuple(tables))

    def best(self) -> int:
        """Return the form that leaves least of all rows."""
        return int(np.argmin([_left(_products(_scaled(table)))[0] for table in self.tables]))

    def squares(self, folds: Int[np.ndarray, " n"]) -> Float[np.ndarray, " folds"]:
        """Return the mean square error in each fold of the law that was fitted to the others."""
        tables = [_scaled(table) for table in self.tables]
        whole = [_products(table) for table in tables]
        errors: list[float] = []
        for k in range(int(folds.max()) + 1):
            out = folds == k
            fits = [
                _left(all_ - _products(table[out]))
                for all_, table in zip(whole, tables, strict=True)
            ]
            form = int(np.argmin([left for left, _ in fits]))
            left_out = tables[form][out]
            residual = left_out[:, -1] - left_out[:, :-1] @ fits[form][1]
            errors.append(float(np.mean(residual**2)))
        return np.array(errors)


def _scaled(table: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "n c"]:
    """Return the rows with regressors of unit norm, so that their products can be solved with."""
    norms = np.linalg.norm(table, axis=0)
    norms[-1] = 1.0
    return table / np.where(norms > 0, norms, 1.0)


def _products(table: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "c c"]:
    return table.T @ table


def _left(products: Float[np.ndarray, "c c"]) -> tuple[float, Float[np.ndarray, " p"]]:
    """Return the sum of squares that a fit leaves, and its values, from the rows' products."""
    values = np.linalg.lstsq(products[:-1, :-1], products[:-1, -1], rcond=None)[0]
    return float(products[-1, -1] - products[-1, :-1] @ values), values


def _folds(motion: SmoothMotion, name: str) -> Int[np.ndarray, " n"]:
    """Return the number of the fold that each row belongs to, -1 for none."""
    found = stretches(motion)
    kinds = kinds_of(motion, found)
    marks = np.full(motion.time.size, -1)
    for (start, stop), kind in zip(found, kinds, strict=True):
        marks[start:stop] = kind
    folds = marks[motion.kept()]
    present = np.unique(folds[folds >= 0])
    if present.size < _LEAST_FOLDS:
        raise InputError(
            f"the log shows {present.size} kinds of moves, at least {_LEAST_FOLDS} are needed to "
            "judge a law by moves it was not fitted to",
            where=name,
            remedy="record moves of several lengths, places and speeds, both ways",
        )
    return np.searchsorted(present, folds, side="left") - np.where(folds < 0, 1, 0)
