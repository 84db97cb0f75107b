"""Plants whose friction law is not affine: integrated, where the others are propagated exactly."""

from stickslip.simulation.laws.kernel import law_batch, law_mass_step, law_run, law_step
from stickslip.simulation.laws.model import law_model

__all__ = ["law_batch", "law_mass_step", "law_model", "law_run", "law_step"]
