"""What estimators that take a log sample by sample have in common: one vector, one kernel."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy_online import take_sample

__all__ = ["Kernel", "OnlineMethod", "State"]

State = Float[np.ndarray, " s"]
Kernel = Callable[[State, float, float, float, float, float], bool]


class OnlineMethod(ABC):
    """An estimator all of whose memory is one vector, which a compiled kernel steps in place."""

    @property
    @abstractmethod
    def kernel(self) -> Kernel:
        """The compiled step ``kernel(state, u, x, v, x2, v2) -> taken``, in place.

        Effort [N or N m] held from this sample to the next, position [m or rad] and velocity [m/s
        or rad/s] of the driven mass, then both of the load; 0 for what the axis does not have or
        measure (see `init`). It takes every sample of five finite numbers.
        """

    @property
    @abstractmethod
    def _places(self) -> list[int]:
        """Places in a state of what is estimated, in the order of the online estimates."""

    def step(
        self, state: State, sample: tuple[float, float, float, float, float]
    ) -> tuple[State, Float[np.ndarray, " p"]]:
        """Take one sample; return the new state and the estimates.

        Parameters
        ----------
        state
            From `init` or an earlier step; it is left as it is.
        sample
            Effort, position, velocity, load position and load velocity [SI], with 0 for what the
            axis does not have. Velocities are not derived here: where they are not measured, `init`
            says whether a state can be made without them; with zeros for them no other state learns
            anything.

        Returns
        -------
        The state, and the estimates in the order of `parameter_names`.

        Raises
        ------
        InputError
            If the sample does not hold five finite numbers.
        """
        after = state.copy()
        take_sample(self.kernel, after, sample)
        return after, after[self._places]
