"""Maximum likelihood with process noise: effort noise, disturbance forces and sensor noise."""

from stickslip.estimation.likelihood.process_noise.estimator import ProcessNoiseLikelihoodEstimator
from stickslip.estimation.likelihood.process_noise.problem import Tuning
from stickslip.estimation.likelihood.process_noise.uncertainty import (
    NoiseLevels,
    process_noise_bound,
)

__all__ = ["NoiseLevels", "ProcessNoiseLikelihoodEstimator", "Tuning", "process_noise_bound"]
