"""Recursive least squares with forgetting on the friction force of a log.

S. Haykin (2002), "Adaptive Filter Theory", chapter 9; van de Wijdeven (2002), part A, Eqs.
4.6-4.10.
The rows of the momentum balance (see `stickslip.estimation.online.observers.kernels`), each
the mean over a short block of samples, are taken one by one, and weigh less by the forgetting
factor with every row that follows.
"""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.online.method import State
from stickslip.estimation.online.observers.force_observer import ForceObserver
from stickslip.estimation.online.observers.kernels import least_squares_step
from stickslip.estimation.online.recursion import covariance_in, set_prior
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_forgetting_factor, options_of
from stickslip.records import AxisLog, FrictionEstimate


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
    name: ClassVar[str] = "rls"
    _kernel: ClassVar[Any] = least_squares_step

    def __post_init__(self) -> None:
        super().__post_init__()
        check_forgetting_factor(self.forgetting_factor)

    @property
    def _estimated(self) -> tuple[str, ...]:
        return ("viscous_friction", "coulomb_friction", *(("offset",) if self.offset else ()))

    def _initialise(self, s: Any) -> None:
        names, guesses = self.parameter_names("linear"), self._guesses
        mass = guesses.get("mass", guesses.get("inertia", 0.0))
        s.recursion.forgetting = self.forgetting_factor
        s.block = self._block(float(s.recursion.sampling_time))
        first = [mass if name == "mass" else guesses.get(name, 0.0) for name in names]
        set_prior(s.recursion, first, None)

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

        Row k of n weighs lambda^((n - k) / 2). ``quiet`` takes longer blocks than the recursion
        does, for less noise.
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
