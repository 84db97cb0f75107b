"""Compensation of Coulomb and viscous friction, known or estimated by a running estimator."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.checks import check_fields
from stickslip.errors import check_class
from stickslip.friction import CoulombViscousFriction
from stickslip.records import (
    InputError,
    finite_vector,
    non_negative,
    one_of,
    positive,
    quantity_field,
)

_DIRECTIONS = ("reference", "measured")

Kernel = Callable[[Float[np.ndarray, " s"], float, float, float, float, float], bool]


@compiled(inline=True)
def compensating_effort(
    f_pos: float, f_neg: float, c_pos: float, c_neg: float, v: float, dead_band: float
) -> float:
    """Return f_c sign(v) + c v, 0 where abs(v) <= dead_band (van de Wijdeven 2002 A Eq. 2.1)."""
    if v > dead_band:
        return f_pos + c_pos * v
    if v < -dead_band:
        return c_neg * v - f_neg
    return 0.0


@compiled(inline=True)
def physical(estimate: float) -> float:
    """Return an estimate that friction can have: not negative, and 0 where there is none (NaN)."""
    return estimate if estimate > 0.0 else 0.0


@runtime_checkable
class OnlineEstimator(Protocol):
    """Interface of an estimator that runs beside a controller."""

    @property
    def kernel(self) -> Kernel:
        """As of `OnlineFriction`."""
        ...

    @property
    def values_at(self) -> slice:
        """As of `OnlineFriction`."""
        ...

    def init(self, *, sampling_time: float) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample; the sampling time is in s."""
        ...


@runtime_checkable
class RunningEstimator(OnlineEstimator, Protocol):
    """An online estimator with a covariance."""

    def covariance(self, state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
        """Return the covariance of the estimates; infinite while nothing is known."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class OnlineFriction:
    """An estimator of Coulomb and viscous friction that a controller asks and feeds.

    At each sample the controller first compensates the friction with the estimates as they stand,
    then hands the sample and the effort it computed to the estimator. `of` makes one from an
    estimator; with the class itself the state can be one of an earlier run, or made otherwise.

    Attributes
    ----------
    kernel
        ``kernel(state, effort, position, velocity, load_position, load_velocity) -> taken``
        [N or N m, m or rad, m/s or rad/s]. It changes the state in place and returns whether it
        could use the sample. When it is a compiled kernel, so is the controller.
    first_state
        State before the first sample, a vector [any units, those of the kernel]; copied.
    sampling_time
        That the first state was made for [s]; the controller must have the same.
    values_at
        Where in the state the two estimates lie, Coulomb friction [N or N m] first, then viscous
        friction [N s/m or N m s/rad]; a step of -1 reads them the other way round.
    needs_load
        Whether the kernel needs the load's position and velocity. If not, it gets 0 where the axis
        has no sensor for them; if so, a sample without them is not taken.
    covariance
        Covariance of the two estimates in a state, in the order of the state [SI]; None if it is
        not known.

    Raises
    ------
    InputError
        If the first state is not a finite vector, the slice does not name two of its places, or
        the sampling time is not positive.

    Examples
    --------
    >>> def never_learns(state, u, x, v, x2, v2):
    ...     return True
    >>> online = OnlineFriction(kernel=never_learns, first_state=np.array([0.1, 0.2]),
    ...                         sampling_time=0.001, values_at=slice(0, 2), needs_load=False)
    >>> online.places
    (0, 1)
    """

    kernel: Kernel
    first_state: Float[np.ndarray, " s"]
    sampling_time: float = quantity_field("sampling_time")
    values_at: slice
    needs_load: bool
    covariance: Callable[[Float[np.ndarray, " s"]], Float[np.ndarray, "p p"]] | None = None

    def __post_init__(self) -> None:
        state = finite_vector("first_state", self.first_state, "units of the estimator")
        object.__setattr__(self, "first_state", state)
        check_fields(self, positive, {"sampling_time": "s"})
        found = range(*self.values_at.indices(state.size))
        if len(found) != 2:
            raise InputError(
                "places_not_two",
                name="values_at",
                value=self.values_at,
                count=len(found),
                size=state.size,
            )
        if not callable(self.kernel):
            raise InputError("kernel_not_callable", found=type(self.kernel).__name__)

    @classmethod
    def of(
        cls, estimator: OnlineEstimator, *, sampling_time: float, needs_load: bool
    ) -> "OnlineFriction":
        """Return an estimator that runs along from its own first state on.

        Parameters
        ----------
        estimator
            Of Coulomb and viscous friction, as `stickslip.EnergyEstimator`.
        sampling_time
            That of the loop [s].
        needs_load
            As of the class.
        """
        return cls(
            kernel=estimator.kernel,
            first_state=estimator.init(sampling_time=sampling_time),
            sampling_time=sampling_time,
            values_at=estimator.values_at,
            needs_load=needs_load,
        )

    @property
    def places(self) -> tuple[int, int]:
        """Places in the state of Coulomb and of viscous friction."""
        coulomb, viscous = range(*self.values_at.indices(self.first_state.size))
        return coulomb, viscous


@dataclass(frozen=True, kw_only=True)
class FrictionCompensation:
    """Adds the effort that friction takes: Coulomb and viscous friction.

    Van de Wijdeven (2002) does not state which velocity gives the sign. By default it is that of
    the reference: the compensation is then a feedforward, which cannot make the loop unstable
    however wrong running estimates are at first, does not flip with the sensors' noise, and already
    pushes the right way when the axis is still at rest. Friction taken for twice what it is leaves
    the surrogate arm at rest after its moves.

    The measured velocity closes a positive feedback, which takes away the damping that friction
    gives: the same wrong estimate keeps that arm swinging without end. Use it, with a dead band of
    some standard deviations of the velocity's noise and friction rather under- than overestimated,
    where an axis moves without its reference.

    Attributes
    ----------
    friction
        The law if it is known (static friction is not used), or the estimator that runs along.
    velocity
        ``"reference"`` or ``"measured"``: the velocity that is compensated for.
    dead_band
        Nothing is added while the magnitude of that velocity is within it [m/s or rad/s].

    Raises
    ------
    InputError
        If the friction is neither of the two, the velocity is not one of the two, or the dead
        band is negative or not finite.

    Examples
    --------
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    >>> FrictionCompensation(friction=law).velocity
    'reference'
    """

    friction: CoulombViscousFriction | OnlineFriction
    velocity: Literal["reference", "measured"] = "reference"
    dead_band: float = quantity_field("velocity", default=0.0)

    def __post_init__(self) -> None:
        check_class("friction", self.friction, CoulombViscousFriction, OnlineFriction)
        one_of("velocity", self.velocity, _DIRECTIONS)
        check_fields(self, non_negative, {"dead_band": "m/s or rad/s"})
