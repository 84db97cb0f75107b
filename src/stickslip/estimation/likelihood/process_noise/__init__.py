"""Maximum likelihood with process noise: effort noise, disturbance forces and sensor noise."""

from stickslip.estimation.likelihood.process_noise.estimator import (
    ProcessNoiseLikelihoodEstimator,
)

__all__ = ["ProcessNoiseLikelihoodEstimator"]
