"""The estimators that are compared, each made for what is known of an axis and wanted of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from stickslip.jobs.wanted import (
    ESTIMATORS,
    Wanted,
    check_known,
    energy_estimator,
    idim_estimator,
)
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    InputError,
    StickslipError,
    count_of,
)

__all__ = [
    "Estimator",
    "Fitted",
    "check_wanted",
    "fitted",
    "inertia_of",
    "made",
]


@runtime_checkable
class Estimator(Protocol):
    """What every estimator offers."""

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log."""
        ...


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """What came of a fit: an estimate, or why there is none.

    Attributes
    ----------
    estimate, why_not
        One of them.
    assumed_inertia
        Mass or inertia that the estimator was given, though it was not known [kg or kg m^2].
    """

    estimate: FrictionEstimate | None = None
    why_not: str = ""
    assumed_inertia: float | None = None


_Make = Callable[[Wanted, float | None, AxisKind], Estimator]


@dataclass(frozen=True, kw_only=True)
class _Kind:
    """How an estimator is made, from what is wanted, a mass to rely on, and the kind of axis.

    Attributes
    ----------
    make
        The estimator.
    needs_inertia
        Whether it estimates no mass.
    rigid, symmetric
        Whether it is for rigid axes only, and for friction that is alike in both directions.
    """

    make: _Make
    needs_inertia: bool = False
    rigid: bool = False
    symmetric: bool = False


def _energy(wanted: Wanted, _inertia: float | None, _kind: AxisKind) -> Estimator:
    return energy_estimator(wanted)


def _stribeck(wanted: Wanted, _inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import StribeckEstimator

    return StribeckEstimator(method=energy_estimator(wanted))


def _likelihood(wanted: Wanted, inertia: float | None, kind: AxisKind) -> Estimator:
    from stickslip.estimation import MaximumLikelihoodEstimator

    guess = None
    if wanted.flexible and wanted.inertia is None:
        # It has no first guess of its own for an arm
        if inertia is None:
            raise InputError(
                "it needs a first guess of the first mass of an arm, and the energy estimator "
                "found none",
                remedy="give the mass",
            )
        guess = {"mass" if kind == "linear" else "inertia": inertia}
    return MaximumLikelihoodEstimator(
        inertia=wanted.inertia,
        load_inertia=wanted.load_inertia,
        stiffness=wanted.stiffness,
        per_direction=wanted.per_direction,
        offset=wanted.offset,
        largest_delay=wanted.largest_delay,
        initial_values=guess,
    )


def _idim(wanted: Wanted, _inertia: float | None, _kind: AxisKind) -> Estimator:
    return idim_estimator(wanted)


def _idim_iv(wanted: Wanted, _inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import IdimInstrumentalVariables

    return IdimInstrumentalVariables(
        inertia=wanted.inertia, per_direction=wanted.per_direction, offset=wanted.offset
    )


def _rls(wanted: Wanted, _inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import LeastSquaresObserver

    return LeastSquaresObserver(
        inertia=wanted.inertia, stiffness=wanted.stiffness, offset=wanted.has_offset
    )


def _kalman(wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import ExtendedKalmanFilter

    return ExtendedKalmanFilter(inertia=_given(inertia), offset=wanted.has_offset)


def _report(wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import ReportEstimator

    return ReportEstimator(
        inertia=_given(inertia), load_inertia=wanted.load_inertia, stiffness=wanted.stiffness
    )


@runtime_checkable
class _Observer(Protocol):
    """How the observers of the friction force are made."""

    def __call__(
        self, *, inertia: float, stiffness: float | None, offset: bool, viscous: bool
    ) -> Estimator: ...


def _observed(observer: _Observer, wanted: Wanted, inertia: float | None) -> Estimator:
    return observer(
        inertia=_given(inertia),
        stiffness=wanted.stiffness,
        offset=wanted.has_offset,
        viscous=True,
    )


def _friedland(wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import FriedlandParkObserver

    return _observed(FriedlandParkObserver, wanted, inertia)


def _yazdizadeh(wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import YazdizadehKhorasaniObserver

    return _observed(YazdizadehKhorasaniObserver, wanted, inertia)


def _liao(wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import LiaoChienObserver

    return _observed(LiaoChienObserver, wanted, inertia)


def _gradient(wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import GradientEstimator

    return GradientEstimator(
        inertia=_given(inertia), stiffness=wanted.stiffness, offset=wanted.has_offset
    )


def _decay(_wanted: Wanted, inertia: float | None, _kind: AxisKind) -> Estimator:
    from stickslip.estimation import FreeDecayEstimator

    return FreeDecayEstimator(inertia=_given(inertia))


def _given(inertia: float | None) -> float:
    if inertia is None:
        raise InputError(
            "it needs the mass or inertia, which is not given, and which the energy estimator "
            "could not identify",
            remedy="give it",
        )
    return inertia


_KINDS: Mapping[str, _Kind] = {
    "energy": _Kind(make=_energy),
    "maximum-likelihood": _Kind(make=_likelihood),
    "idim-ls": _Kind(make=_idim, rigid=True),
    "idim-iv": _Kind(make=_idim_iv, rigid=True),
    "stribeck-energy": _Kind(make=_stribeck),
    "ekf": _Kind(make=_kalman, needs_inertia=True, rigid=True, symmetric=True),
    "rls": _Kind(make=_rls, symmetric=True),
    "friedland-park": _Kind(make=_friedland, needs_inertia=True, symmetric=True),
    "yazdizadeh-khorasani": _Kind(make=_yazdizadeh, needs_inertia=True, symmetric=True),
    "liao-chien": _Kind(make=_liao, needs_inertia=True, symmetric=True),
    "gradient": _Kind(make=_gradient, needs_inertia=True, symmetric=True),
    "report": _Kind(make=_report, needs_inertia=True, symmetric=True),
    "free-decay": _Kind(make=_decay, needs_inertia=True, rigid=True, symmetric=True),
}


_LARGEST_DELAY = 100
"""Of the effort, in samples."""


def check_wanted(wanted: Wanted, kind: AxisKind) -> None:
    """Refuse what cannot be known of an axis, or be wanted of it.

    Raises
    ------
    InputError
        If a value is out of its range, an arm is half described, an offset is asked for beside
        friction per direction, an estimator's name is unknown, or a delay is to be looked for by
        none that can.
    """
    check_known(wanted, kind)
    for name in wanted.only:
        if name not in ESTIMATORS:
            raise InputError(
                f"{name!r} is not an estimator", remedy=f"use one of {', '.join(ESTIMATORS)}"
            )
    if not 0 <= wanted.largest_delay <= _LARGEST_DELAY:
        raise InputError(
            f"largest_delay is {count_of(wanted.largest_delay, 'sample')}",
            remedy=f"give 0 to {_LARGEST_DELAY} whole samples: each of them is a fit",
        )
    if wanted.largest_delay and "maximum-likelihood" not in wanted.names:
        raise InputError(
            f"largest_delay is {count_of(wanted.largest_delay, 'sample')}, and only "
            "maximum-likelihood looks for a delay, which is left out",
            remedy="compare maximum-likelihood too, or leave largest_delay out",
        )
    energy_estimator(wanted)  # which refuses half an arm, and an offset per direction


def made(name: str, wanted: Wanted, energy_inertia: float | None, kind: AxisKind) -> Estimator:
    """Return an estimator.

    Parameters
    ----------
    name
        One of `ESTIMATORS`.
    wanted
        What is known and wanted.
    energy_inertia
        Mass or inertia that the energy estimator found [kg or kg m^2], for those that estimate
        none.
    kind
        ``"linear"`` or ``"rotary"``.

    Raises
    ------
    InputError
        If it is not for such an axis, or needs a mass that nobody knows.
    """
    which = _KINDS[name]
    if which.rigid and wanted.flexible:
        raise InputError("it is for rigid axes, and this is a flexible arm", remedy="")
    if which.symmetric and wanted.per_direction:
        raise InputError("it takes friction as alike in both directions", remedy="")
    return which.make(wanted, energy_inertia if wanted.inertia is None else wanted.inertia, kind)


def fitted(name: str, wanted: Wanted, energy_inertia: float | None, log: AxisLog) -> Fitted:
    """Return what an estimator makes of a log, or why it does not apply to it.

    Parameters
    ----------
    name, wanted, energy_inertia
        As `made` takes them.
    log
        The measurement.
    """
    assumes = _KINDS[name].needs_inertia and wanted.inertia is None
    try:
        estimate = made(name, wanted, energy_inertia, log.kind).fit(log)
    except StickslipError as error:
        return Fitted(why_not=_reason(error, log.name))
    return Fitted(estimate=estimate, assumed_inertia=energy_inertia if assumes else None)


def _reason(error: StickslipError, log: str) -> str:
    """Return why an estimator does not apply; which log is meant is clear."""
    text = error.what if isinstance(error, InputError) else str(error)
    return text.removeprefix(f"{log}: ")


def inertia_of(estimate: FrictionEstimate | None) -> float | None:
    """Return the mass or inertia that an estimate holds [kg or kg m^2]; None if none that can be.

    Parameters
    ----------
    estimate
        Of the energy estimator; None if it does not apply.
    """
    held: Sequence[float | None] = (
        []
        if estimate is None
        else [p.value for name, p in estimate.parameters.items() if name in {"mass", "inertia"}]
    )
    value = held[0] if held else None
    return value if value is not None and value > 0 else None
