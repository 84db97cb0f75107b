"""What estimators that take a log sample by sample have in common: one vector, one kernel."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records import InputError

__all__ = ["Kernel", "OnlineMethod", "State"]

State = Float[np.ndarray, " s"]
Kernel = Callable[[State, float, float, float, float, float], bool]

_SAMPLE = ("effort", "position", "velocity", "load position", "load velocity")


class OnlineMethod(ABC):
    """An estimator all of whose memory is one vector, which a compiled kernel steps in place."""

    @property
    def counts_missing(self) -> bool:
        """Whether a sample that is not finite is counted in the state instead of refused."""
        return False

    @property
    @abstractmethod
    def kernel(self) -> Kernel:
        """The compiled step ``kernel(state, u, x, v, x2, v2) -> taken``, in place.

        Effort [N or N m] held from this sample to the next, position [m or rad] and velocity [m/s
        or rad/s] of the driven mass, then both of the load; 0 for what the axis does not have or
        measure (see `init`). It takes every sample of five finite numbers. Where `counts_missing`,
        it uses the finite ones of the others too, and counts.
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
            If the sample does not hold five numbers, or, unless `counts_missing`, one of them is
            not finite.
        """
        after = state.copy()
        _take_sample(self.kernel, after, sample, counted=self.counts_missing)
        return after, after[self._places]


def _take_sample(kernel: Kernel, state: State, sample: Sequence[float], *, counted: bool) -> None:
    """Take one sample into the state by a kernel, in place.

    Raises
    ------
    InputError
        If the sample does not hold five numbers, or one is not finite and not counted; the state
        is left as it is then.
    """
    try:
        u, x, v, x2, v2 = sample
        taken = kernel(state, float(u), float(x), float(v), float(x2), float(v2))
    except (TypeError, ValueError) as error:
        raise _not_a_sample(sample) from error
    if not taken and not counted:
        k = next(k for k, value in enumerate(sample) if not np.isfinite(value))
        raise InputError(
            f"the {_SAMPLE[k]} of the sample is {float(sample[k])}, it must be finite",
            remedy="leave the sample out and begin with a new state, as after a gap, or give the "
            "last good value",
        )


def _not_a_sample(sample: Any) -> InputError:
    return InputError(
        f"the sample is {sample!r}, it must be five numbers",
        remedy=f"give {', '.join(_SAMPLE)} in SI units, 0 for what the axis does not have or "
        "measure",
    )
