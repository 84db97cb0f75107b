"""What is known of an axis and wanted of it, said in one way for every estimator."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from stickslip.records import AxisKind, positive, unit_of

if TYPE_CHECKING:
    from stickslip.estimation import EnergyEstimator, IdimLeastSquares

__all__ = ["ESTIMATORS", "Wanted", "check_known", "energy_estimator", "idim_estimator"]

ESTIMATORS: tuple[str, ...] = (
    "energy",
    "maximum-likelihood",
    "idim-ls",
    "idim-iv",
    "stribeck-energy",
    "ekf",
    "rls",
    "friedland-park",
    "yazdizadeh-khorasani",
    "liao-chien",
    "gradient",
    "report",
    "free-decay",
)
"""Names of the estimators that can be compared, in their order."""


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What is known of an axis, and what is to be estimated.

    Attributes
    ----------
    inertia
        Moving mass or inertia, of the first body of a flexible arm [kg or kg m^2]; None estimates
        it.
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis.
    per_direction
        Whether each direction gets its own Coulomb and viscous friction.
    offset
        Whether a constant offset is estimated; None does unless ``per_direction``.
    largest_delay
        Delays of the effort of 0 to so many samples are tried by maximum likelihood, the only one
        that finds any.
    only
        Names of the estimators to compare; empty for every one.
    """

    inertia: float | None = None
    load_inertia: float | None = None
    stiffness: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    largest_delay: int = 0
    only: tuple[str, ...] = ()

    @property
    def has_offset(self) -> bool:
        """Whether a constant offset is estimated."""
        return not self.per_direction if self.offset is None else self.offset

    @property
    def flexible(self) -> bool:
        """Whether the axis is a flexible arm."""
        return self.load_inertia is not None or self.stiffness is not None

    @property
    def names(self) -> tuple[str, ...]:
        """The estimators to compare, in their order."""
        return tuple(name for name in ESTIMATORS if not self.only or name in self.only)


def check_known(wanted: Wanted, kind: AxisKind) -> None:
    """Refuse what cannot be known of an axis.

    Parameters
    ----------
    wanted
        What is known and wanted.
    kind
        Of the axis.

    Raises
    ------
    InputError
        If a value is out of its range.
    """
    body = "mass" if kind == "linear" else "inertia"
    for what, quantity, value in (
        (body, body, wanted.inertia),
        (f"load {body}", body, wanted.load_inertia),
        ("stiffness", "stiffness", wanted.stiffness),
    ):
        if value is not None:
            positive(what, value, unit_of(quantity, kind))


def energy_estimator(wanted: Wanted, *, cutoff: float | None = None) -> "EnergyEstimator":
    """Return the energy estimator for what is wanted.

    Parameters
    ----------
    wanted
        What is known and wanted.
    cutoff
        Of its low-pass [Hz]; None for the usual one.

    Raises
    ------
    InputError
        If an arm is half described, or an offset is wanted beside friction per direction.
    """
    from stickslip.estimation import EnergyEstimator

    return EnergyEstimator(
        inertia=wanted.inertia,
        load_inertia=wanted.load_inertia,
        stiffness=wanted.stiffness,
        per_direction=wanted.per_direction,
        offset=wanted.offset,
        cutoff=cutoff,
    )


def idim_estimator(wanted: Wanted, *, cutoff: float | None = None) -> "IdimLeastSquares":
    """Return inverse dynamics by least squares for what is wanted.

    Parameters
    ----------
    wanted
        What is known and wanted, of a rigid axis.
    cutoff
        Of its low-pass [Hz]; None for the usual one.

    Raises
    ------
    InputError
        If an offset is wanted beside friction per direction.
    """
    from stickslip.estimation import IdimLeastSquares

    return IdimLeastSquares(
        inertia=wanted.inertia,
        per_direction=wanted.per_direction,
        offset=wanted.offset,
        cutoff=cutoff,
    )
