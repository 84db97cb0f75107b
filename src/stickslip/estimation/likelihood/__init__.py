"""Maximum likelihood on the exact simulator, and the Cramer-Rao bound of any estimator."""

from stickslip.estimation.likelihood.bound import CramerRaoBound, cramer_rao_bound
from stickslip.estimation.likelihood.estimator import LikelihoodMaximum, MaximumLikelihoodEstimator
from stickslip.estimation.likelihood.input_design import DesignedInput, InputLimits, design_input
from stickslip.estimation.likelihood.process_noise import (
    NoiseLevels,
    ProcessNoiseLikelihoodEstimator,
    process_noise_bound,
)

__all__ = [
    "CramerRaoBound",
    "DesignedInput",
    "InputLimits",
    "LikelihoodMaximum",
    "MaximumLikelihoodEstimator",
    "NoiseLevels",
    "ProcessNoiseLikelihoodEstimator",
    "cramer_rao_bound",
    "design_input",
    "process_noise_bound",
]
