"""Maximum likelihood on the exact simulator, and how good any estimator can be."""

from stickslip.estimation.maximum_likelihood.bound import CramerRaoBound, cramer_rao_bound
from stickslip.estimation.maximum_likelihood.estimator import (
    LikelihoodMaximum,
    MaximumLikelihoodEstimator,
)

__all__ = [
    "CramerRaoBound",
    "LikelihoodMaximum",
    "MaximumLikelihoodEstimator",
    "cramer_rao_bound",
]
