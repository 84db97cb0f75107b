"""Content of exported code: chosen in Python, or derived from an estimate."""

import math
from dataclasses import dataclass, replace
from typing import Literal

from stickslip.control import ExactPulseController, RestDetection
from stickslip.estimation import EnergyEstimator
from stickslip.estimation.online.kalman.extended_kalman import ExtendedKalmanFilter
from stickslip.export.c.law import CodeLaw
from stickslip.export.parameters import ExportParameters
from stickslip.friction import CoulombViscousFriction
from stickslip.records import AxisKind, InputError, positive, unit_of

_SAMPLING_TIME = 0.001  # s
_EFFORT_LIMIT = 2.5  # over the breakaway
_RESOLUTION: dict[AxisKind, float] = {"linear": 1e-6, "rotary": 1e-5}  # of the encoder [m, rad]
_TOLERANCE = 10.0  # of positioning, over the resolution
_WINDOW = 20  # samples in which rest is looked for
_MEMORY = 128  # first samples that the Kalman filter keeps


@dataclass(frozen=True, kw_only=True)
class CodeContent:
    """Content of the exported code."""

    axis: str  #: Name of the axis.
    kind: AxisKind  #: ``"linear"`` or ``"rotary"``.
    law: CodeLaw  #: The friction law.
    #: Moving mass [kg] or inertia [kg m^2] that the feedforward accelerates; 0 leaves it out.
    inertia: float = 0.0
    #: Speed up to which the feedforward compensates no friction [m/s or rad/s].
    dead_band: float = 0.0
    sampling_time: float = 0.001  #: Of the estimators [s].
    controller: ExactPulseController | None = None  #: A module of its own; None leaves it out.
    energy: EnergyEstimator | None = None  #: A module of its own; None leaves it out.
    kalman: ExtendedKalmanFilter | None = None  #: A module of its own; None leaves it out.
    velocity_measured: bool = True  #: Whether the estimators get a measured velocity.
    precision: Literal["single", "double"] = "double"  #: Default arithmetic of the code.
    banner: str = ""  #: One sentence on the origin, the first line of every file.


@dataclass(frozen=True, kw_only=True)
class Derived:
    """Content derived from an estimate, and what was chosen or left out, one sentence each."""

    content: CodeContent
    notes: tuple[str, ...]


def derived_content(
    axis: str,
    parameters: ExportParameters,
    *,
    sampling_time: float | None = None,
    precision: Literal["single", "double"] | None = None,
    banner: str = "",
) -> Derived:
    """Return the content that an estimate allows.

    The estimators and the pulse controller need the inertia and a friction that is not negative;
    what the estimate says nothing of (encoder, effort limit, tolerance) is chosen and noted.
    """
    T = _SAMPLING_TIME if sampling_time is None else positive("sampling_time", sampling_time, "s")
    notes = [] if sampling_time else [f"the sampling time is {T:g} s, the default"]
    law, inertia, kind = CodeLaw.estimated(parameters), parameters.inertia, parameters.kind
    base = CodeContent(
        axis=axis,
        kind=kind,
        law=law,
        inertia=inertia or 0.0,
        sampling_time=T,
        velocity_measured=False,
        precision=precision or "double",
        banner=banner,
    )
    if inertia is None:
        notes.append(
            "only the friction law is written: the other modules need the inertia, which the "
            "estimate does not hold"
        )
        return Derived(content=base, notes=tuple(notes))
    try:
        affine = law.affine
        limit = _EFFORT_LIMIT * (max(affine.breakaway()) + abs(affine.offset))
        controller = _controller(affine, inertia, T, limit, kind)
    except InputError as error:
        notes.append(f"only the friction law is written: {error.what}")
        return Derived(content=base, notes=tuple(notes))
    step, unit = _RESOLUTION[kind], unit_of("position", kind)
    notes.append(
        f"pulse controller and estimators are for an encoder of {step:g} {unit} without a velocity "
        f"sensor; the controller for efforts up to {limit:.4g} {unit_of('effort', kind)} and a "
        f"tolerance of {_TOLERANCE * step:g} {unit}: set the axis' own in the configuration"
    )
    content = replace(
        base,
        controller=controller,
        energy=online_estimator(parameters, inertia),
        kalman=_filter(affine, inertia, T, limit, kind),
    )
    return Derived(content=content, notes=tuple(notes))


def online_estimator(parameters: ExportParameters, inertia: float) -> EnergyEstimator:
    """Return the online estimator of the friction of an axis with a known inertia."""
    return EnergyEstimator(
        inertia=inertia, per_direction=parameters.directional("coulomb_friction")
    )


def _controller(
    law: CoulombViscousFriction, inertia: float, T: float, limit: float, kind: AxisKind
) -> ExactPulseController:
    step = _RESOLUTION[kind]
    return ExactPulseController(
        sampling_time=T,
        target=0.0,
        tolerance=_TOLERANCE * step,
        rest=RestDetection.for_encoder(resolution=step, samples=_WINDOW),
        kind=kind,
        effort_limit=limit,
        mass=inertia,
        friction=law,
        position_noise=step / math.sqrt(12.0),
    )


def _filter(
    law: CoulombViscousFriction, inertia: float, T: float, limit: float, kind: AxisKind
) -> ExtendedKalmanFilter:
    """Return a Kalman filter that begins with the estimate, and takes it to be uncertain."""
    coulomb = 0.5 * (law.coulomb_friction_positive + law.coulomb_friction_negative)
    viscous = 0.5 * (law.viscous_friction_positive + law.viscous_friction_negative)
    asymmetry = 0.5 * (law.coulomb_friction_positive - law.coulomb_friction_negative)
    return ExtendedKalmanFilter(
        inertia=inertia,
        offset=True,
        position_noise=_RESOLUTION[kind] / math.sqrt(12.0),
        # Slower than this, a sample may hold a reversal
        rest_speed=2.0 * limit / inertia * T,
        rest_force=limit / math.sqrt(2.0),
        initial_values={
            "coulomb_friction": coulomb,
            "viscous_friction": viscous,
            "offset": law.offset + asymmetry,
        },
        initial_deviations={
            "coulomb_friction": 0.5 * coulomb,
            # Such that it makes up for Coulomb friction where the axis can be fast
            "viscous_friction": max(viscous, coulomb * inertia / (limit * 1000.0 * T)),
            "offset": 0.5 * coulomb,
        },
        memory=_MEMORY,
    )
