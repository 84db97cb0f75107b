"""Recursive least squares with forgetting on the friction force of a log.

S. Haykin (2002), "Adaptive Filter Theory", chapter 9; van de Wijdeven (2002), part A, Eqs.
4.6-4.10.
The rows of the momentum balance (see `stickslip.estimation.online.observers.force_balance`), each
the mean over a short block of samples, are taken one by one, and weigh less by the forgetting
factor with every row that follows.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.online.observers.force_balance import (
    FORCE,
    METHOD,
    SHAPE,
    balance,
    settled,
)
from stickslip.estimation.online.observers.force_observer import ForceObserver
from stickslip.estimation.online.recursion import (
    FORGETTING,
    PARAMETERS,
    ROW,
    SAMPLING_TIME,
    covariance_in,
    lay_prior,
    update,
)
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_forgetting_factor, options_of
from stickslip.records import AxisLog, FrictionEstimate

__all__ = ["LeastSquaresObserver"]

_FILLED = METHOD  # samples in the block so far
_SUMS = METHOD + 1  # of the force and the row over the block


@compiled(brief=True)
def least_squares_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite."""
    p = int(s[PARAMETERS])
    if not balance(s, u, x, v, x2, v2):
        s[_FILLED] = 0.0
        return settled(s, u, x, v, x2, v2)
    if s[_FILLED] == 0.0:
        for i in range(p + 1):
            s[_SUMS + i] = 0.0
    s[_SUMS] += s[FORCE]
    for i in range(p):
        s[_SUMS + 1 + i] += s[ROW + i]
    s[_FILLED] += 1.0
    if s[_FILLED] >= s[SHAPE]:
        for i in range(p):
            s[ROW + i] = s[_SUMS + 1 + i] / s[SHAPE]
        update(s, s[_SUMS] / s[SHAPE], s[FORGETTING], True)
        s[_FILLED] = 0.0
    return settled(s, u, x, v, x2, v2)


@dataclass(frozen=True, kw_only=True)
class LeastSquaresObserver(ForceObserver):
    """Coulomb and viscous friction (and the inertia) by recursive least squares with forgetting.

    Noise of a differentiated velocity is in the rows too, which biases all values, and most of all
    a sought inertia; with the inertia known the bias is small.

    Attributes
    ----------
    inertia
        Moving mass or inertia [kg or kg m^2]; None estimates it.
    forgetting_factor
        Of one row, in (0, 1] [-]; 1 forgets nothing.

    Examples
    --------
    >>> LeastSquaresObserver(offset=True).parameter_names("rotary")
    ('inertia', 'viscous_friction', 'coulomb_friction', 'offset')
    """

    inertia: float | None = None
    forgetting_factor: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_forgetting_factor(self.forgetting_factor)

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "rls"

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`)."""
        return least_squares_step

    @property
    def _estimated(self) -> tuple[str, ...]:
        return ("viscous_friction", "coulomb_friction", *(("offset",) if self.offset else ()))

    def _lay_settings(self, s: State) -> None:
        names = self.parameter_names("linear")
        guesses = self._guesses
        mass = guesses.get("mass", guesses.get("inertia", 0.0))
        s[PARAMETERS] = len(names)
        s[FORGETTING] = self.forgetting_factor
        s[SHAPE] = self._block(float(s[SAMPLING_TIME]))
        lay_prior(s, [mass if name == "mass" else guesses.get(name, 0.0) for name in names], None)

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P, in the order of `parameter_names`, for a force noise of 1 N (or N m) a row."""
        return covariance_in(state)

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Return what the recursion ends at, with intervals that allow for correlated residuals.

        Raises
        ------
        InputError
            If nothing moves or pushes in the log, or it lacks the load of a flexible arm.
        """
        check_excited(log)
        log = repaired(log)
        settled = self._settled(log)
        regression = settled.regression(log, quiet=False)
        return solve(
            replace(regression, notes=(*regression.notes, *log.notes), biased=log.clipped),
            estimator=self.name,
            provenance=provenance_of(log, options_of(settled)),
        )

    def regression(self, log: AxisLog, *, quiet: bool = False) -> Regression:
        """Return rows whose least-squares solution is what the recursion ends at.

        Row k of n weighs lambda^((n - k) / 2).

        Parameters
        ----------
        log
            With uniform samples between its gaps.
        quiet
            Whether to take longer blocks than the recursion does, for less noise.
        """
        plain = super().regression(log, quiet=quiet)
        root = np.sqrt(self.forgetting_factor)
        weight = root ** np.arange(plain.target.size - 1, -1, -1)
        return replace(
            plain,
            target=weight * plain.target,
            regressors=weight[:, None] * plain.regressors,
            effect=plain.effect * float(np.linalg.norm(weight)) / max(weight.size, 1) ** 0.5,
        )
