"""Maximum likelihood with process noise: effort noise, disturbance forces and sensor noise."""

from stickslip.estimation.likelihood.process_noise.bound import NoiseLevels, process_noise_bound
from stickslip.estimation.likelihood.process_noise.estimator import (
    ProcessNoiseLikelihoodEstimator,
)
from stickslip.estimation.likelihood.process_noise.tuning import Tuning

__all__ = ["NoiseLevels", "ProcessNoiseLikelihoodEstimator", "Tuning", "process_noise_bound"]
