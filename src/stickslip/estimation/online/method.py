"""Base class of the estimators that take a log sample by sample: one vector, one kernel."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from stickslip.estimation.online.faults.health import OnlineHealth
from stickslip.records import InputError

State = Float[np.ndarray, " s"]
Kernel = Callable[[State, float, float, float, float, float], bool]

_SAMPLE = ("effort", "position", "velocity", "load position", "load velocity")


class OnlineMethod(ABC):
    """An estimator all of whose memory is one vector, which a compiled kernel steps in place."""

    @property
    @abstractmethod
    def kernel(self) -> Kernel:
        """The compiled step ``kernel(state, u, x, v, x2, v2) -> taken``, in place.

        Effort [N or N m] held from this sample to the next, position [m or rad] and velocity [m/s
        or rad/s] of the driven mass, then both of the load; 0 or NaN for what the axis does not
        have or measure (see `init`). It returns whether all that the axis measures was finite. A
        value that is missing or impossible is counted and not used (see `health`).
        """

    @abstractmethod
    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""

    @property
    @abstractmethod
    def _places(self) -> slice | list[int]:
        """Places in a state of what is estimated, in the order of the online estimates."""

    def step(
        self, state: State, sample: tuple[float, float, float, float, float]
    ) -> tuple[State, Float[np.ndarray, " p"]]:
        """Take one sample; return the new state and the estimates, in order of `parameter_names`.

        Parameters
        ----------
        state
            From `init` or an earlier step; it is left as it is.
        sample
            Effort, position, velocity, load position and load velocity [SI], with 0 for what the
            axis does not have and NaN for a missing value. Velocities are not derived here: where
            they are not measured, `init` says whether a state can be made without them; with zeros
            for them no other state learns anything.

        Raises
        ------
        InputError
            If the sample does not hold five numbers.
        """
        after = state.copy()
        try:
            u, x, v, x2, v2 = map(float, sample)
        except (TypeError, ValueError) as error:
            raise InputError("sample_not_five", sample=sample, names=_SAMPLE) from error
        self.kernel(after, u, x, v, x2, v2)
        return after, after[self._places].copy()
