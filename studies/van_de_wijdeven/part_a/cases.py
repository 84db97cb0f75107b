"""The cases of the source's simulations, and the variants of the estimator put beside them."""

from dataclasses import dataclass
from typing import Literal

from stickslip.estimation import EnergyEstimator, PublishedEnergyEstimator
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.loops import FORGETTING_FACTOR, INITIAL_VARIANCE

Form = Literal["printed", "settled"]

_HALF = 0.5  # the source's wrong standard deviations are 50 % of the true ones


def published_estimator(
    *,
    sums: Form = "printed",
    compensation: Literal["none", "printed", "settled"] = "none",
    assumed: float = 1.0,
    error_terms: bool = False,
) -> PublishedEnergyEstimator:
    """Return the source's estimator for the surrogate arm.

    It assumes ``assumed`` times the standard deviations of the surrogate values.
    """
    compensated = compensation != "none"
    return PublishedEnergyEstimator(
        inertia=surrogate.MASS_1,
        load_inertia=surrogate.MASS_2,
        stiffness=surrogate.STIFFNESS,
        sums=sums,
        compensation=compensation,
        position_noise=assumed * surrogate.POSITION_NOISE if compensated else None,
        velocity_noise=assumed * surrogate.VELOCITY_NOISE if compensated else None,
        error_terms=error_terms,
        forgetting_factor=FORGETTING_FACTOR,
        initial_variance=INITIAL_VARIANCE,
    )


def robust_estimator(assumed: float | None = None) -> EnergyEstimator:
    """Return this package's own estimator for the surrogate arm.

    On line it begins with ``assumed`` times the standard deviations of the surrogate values, or
    without any.
    """
    return EnergyEstimator(
        inertia=surrogate.MASS_1,
        load_inertia=surrogate.MASS_2,
        stiffness=surrogate.STIFFNESS,
        offset=False,
        position_noise=None if assumed is None else assumed * surrogate.POSITION_NOISE,
        velocity_noise=None if assumed is None else assumed * surrogate.VELOCITY_NOISE,
    )


@dataclass(frozen=True, kw_only=True)
class Case:
    """One of the six cases of chapter 6."""

    key: str  #: Its short name.
    label: str  #: What it is called in a legend.
    noise: float  #: Of the sensors, over that of the surrogate values [-].
    estimator: PublishedEnergyEstimator  #: What estimates.


CASES = (
    Case(key="clean", label="without noise", noise=0.0, estimator=published_estimator()),
    Case(key="noisy", label="with noise", noise=1.0, estimator=published_estimator()),
    Case(
        key="full",
        label="noise, fully compensated",
        noise=1.0,
        estimator=published_estimator(compensation="printed"),
    ),
    Case(
        key="wrong",
        label="noise, compensated with half σ",
        noise=1.0,
        estimator=published_estimator(compensation="printed", assumed=_HALF),
    ),
    Case(
        key="terms",
        label="noise, compensated, B and S",
        noise=1.0,
        estimator=published_estimator(compensation="printed", error_terms=True),
    ),
    Case(
        key="wrong-terms",
        label="noise, half σ, B and S",
        noise=1.0,
        estimator=published_estimator(compensation="printed", assumed=_HALF, error_terms=True),
    ),
)
"""The lines of Figures 6.1, 6.2, 6.6 and 6.7, and the columns of 6.3-6.5 and 6.8-6.10."""


@dataclass(frozen=True, kw_only=True)
class Variant:
    """One form of the source's estimator, scored by Monte Carlo."""

    name: str  #: What it is called.
    #: As `PublishedEnergyEstimator` takes them.
    sums: Form
    compensation: Literal["none", "printed", "settled"] = "none"
    error_terms: bool = False

    @property
    def informed(self) -> bool:
        """Whether it is given standard deviations."""
        return self.compensation != "none"

    def estimator(self, assumed: float) -> PublishedEnergyEstimator:
        """Return the estimator, given this much of the surrogate's standard deviations [-]."""
        return published_estimator(
            sums=self.sums,
            compensation=self.compensation,
            assumed=assumed,
            error_terms=self.error_terms,
        )


PRINTED_COMPENSATED = "printed sums, printed compensation"
"""The variant that the source compensates noise with, before B and S."""

_FORMS: tuple[tuple[str, Form, Form], ...] = (
    (PRINTED_COMPENSATED, "printed", "printed"),
    ("printed sums, settled compensation", "printed", "settled"),
    ("exact sums, settled compensation", "settled", "settled"),
)

VARIANTS = (
    Variant(name="printed sums", sums="printed"),
    Variant(name="exact sums", sums="settled"),
    *(
        Variant(
            name=name + (", B and S" if error_terms else ""),
            sums=sums,
            compensation=compensation,
            error_terms=error_terms,
        )
        for name, sums, compensation in _FORMS
        for error_terms in (False, True)
    ),
)
