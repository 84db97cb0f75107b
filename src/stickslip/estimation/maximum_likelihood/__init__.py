"""Maximum likelihood on the exact simulator, and how good any estimator can be."""

from stickslip.estimation.maximum_likelihood.estimator import (
    LikelihoodMaximum,
    MaximumLikelihoodEstimator,
)

__all__ = ["LikelihoodMaximum", "MaximumLikelihoodEstimator"]
