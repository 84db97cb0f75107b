"""The terms that a force balance may have beyond inertia, Coulomb and viscous friction and offset.

Every term is linear in its parameters once its shape (a Stribeck velocity, the period of a ripple)
is fixed. A term with several shapes is a family, of which the best-fitting member is tested.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.weak_form.motion import SlipMotion, SlipMotions
from stickslip.estimation.weak_form.rows import ANY, Column, Shape, model_effort
from stickslip.records import AxisKind

DELAY = "delay"  #: Name of the term that is the derivative of the effort with respect to its delay.

DIRECTION = "direction"  #: Name of the term that is the asymmetry of viscous friction.

DWELL = "dwell"
"""Name of the term that is the growth of the breakaway friction with the time at rest."""

ELASTIC = "elastic"  #: Name of the term whose column is the mean fourth derivative of the position.

SATURATION = "saturation"  #: Name of the term that is the excess of the logged effort over a limit.

MODEL_SCALE = "model scale"
"""Name of the term that is the relative error of the effort that a model states."""

DEAD_BAND = "dead band"  #: Name of the term that is the effort lost in a dead band of the actuator.

SMALL_POWER = "small power"
"""Name of the term that is friction with a power of the speed below 2/3, which is never selected:
its value at rest is far from that at the driven speeds."""

POSITIVE = (0.0, np.inf)
NEGATIVE = (-np.inf, 0.0)
_ALL_OF_IT = (0.7, 1.3)  # of the coefficient, 1 for an effort that does not reach the axis [-]
TERM_NAMES = (
    "delay",
    "direction",
    "quadratic",
    "two-thirds",
    "stribeck",
    "low speed",
    "presliding",
    "dwell",
    "elastic",
    "spring",
    "gravity",
    MODEL_SCALE,
    "ripple",
    "offset drift",
    "friction drift",
    "viscous drift",
    "gain drift",
    "dead band",
    "saturation",
)
"""Names of all terms."""

_STRIBECK_SHAPES = 9  # velocities tried [-], a factor of some 1.4 apart; refined afterwards
_PRESLIDING_SHAPES = 7  # distances tried [-], a factor of 2.8 apart; refined afterwards
_DEAD_BAND_SHAPES = 9  # sizes tried [-], a factor of 1.5 apart; refined afterwards
_NARROWEST_BAND = 0.04  # over the widest one [-]

_MOST_BANDED = 0.2
"""Share of the samples in motion that a dead band may contain [-]: within it, the column is the
effort itself."""

_SATURATION_SHAPES = 12  # limits tried [-]; the limit is not refined

_MOST_SATURATED = 0.4
"""Share of the samples in motion with an effort above the lowest limit that is tried [-]."""

_SWING = 0.5  # rad: a smaller one bends the sine of a pendulum by less than 1 %


@dataclass(frozen=True, kw_only=True)
class Term:
    """A term with its possible shapes."""

    name: str  #: Of the term, such as ``"stribeck"``.
    text: str  #: What it means for the axis, in words.
    shapes: tuple[Shape, ...]  #: At least one, or none if ``proportional`` makes it.
    tests: int = 0  #: Number of shapes from which these were chosen [-]; 0 if they are all.
    #: The shape with any value, for a search between those of ``shapes``; None if there is no
    #: other.
    family: Callable[[float], Shape] | None = None
    #: The shape for given Coulomb and viscous friction; None if it depends on neither.
    proportional: Callable[[float, float], Shape] | None = None

    @property
    def trials(self) -> int:
        """Number of shapes in the test of the best one [-]."""
        return max(self.tests, len(self.shapes))


def _plain(name: str, text: str, *, bounds: tuple[float, float] = ANY, **columns: Column) -> Term:
    shape = Shape(names=tuple(columns), columns=tuple(columns.values()), bounds=bounds)
    return Term(name=name, text=text, shapes=(shape,))


def candidate_terms(motions: SlipMotions, kind: AxisKind) -> tuple[Term, ...]:
    """Return the candidate terms for the motion of a log."""
    extent = float(np.ptp(motions.moving(lambda m: m.position)))
    origin = motions.reference_position
    terms = [
        *_friction_terms(motions.slow, motions.largest_speed, extent),
        Term(
            name=ELASTIC,
            text="the encoder is behind an elastic drive, or its position is smoothed",
            shapes=(Shape(names=("elasticity",), columns=(), bounds=POSITIVE),),
        ),
        _plain(
            "spring",
            "a spring acts on the axis",
            spring_stiffness=lambda m: m.position - origin,
        ),
        *_drift_terms(motions.reference_time),
        *_drive_terms(np.abs(motions.moving(lambda m: m.effort))),
    ]
    if kind == "rotary" and extent > _SWING:
        terms.append(
            _plain(
                "gravity",
                "gravity acts on a swinging load",
                gravity_sine=lambda m: np.sin(m.position),
                gravity_cosine=lambda m: np.cos(m.position),
            )
        )
    if any(np.any(motion.model_effort) for motion in motions.stretches):
        terms.append(
            _plain(
                MODEL_SCALE,
                "the effort that the model of the machine states is too large or too small",
                bounds=(-1.0, np.inf),
                model_error=model_effort,
            )
        )
    return tuple(terms)


def _friction_terms(slow: float, largest: float, extent: float) -> list[Term]:
    """Return the terms of friction over speed, and of presliding.

    ``slow`` is the speed below which the axis may be at rest, ``largest`` its largest speed [m/s or
    rad/s], ``extent`` the range of its positions [m or rad].
    """
    velocities = np.geomspace(1.5 * slow, max(0.5 * largest, 2.0 * slow), _STRIBECK_SHAPES)
    return [
        _plain(
            DIRECTION,
            "viscous friction differs between the directions",
            viscous_asymmetry=lambda m: np.abs(m.velocity),
        ),
        _plain(
            "quadratic",
            "friction grows with the square of the speed",
            bounds=POSITIVE,
            quadratic_friction=lambda m: m.velocity * np.abs(m.velocity),
        ),
        two_thirds_term(),
        _family(
            "stribeck",
            "friction falls as the speed rises from zero (Stribeck effect)",
            _stribeck,
            velocities,
        ),
        _family(
            "low speed",
            "friction is lower at low speed than at higher speeds",
            _low_speed,
            velocities,
        ),
        _family(
            "presliding",
            "friction builds up over a distance after each reversal (presliding)",
            _presliding,
            np.geomspace(1e-4 * extent, 0.05 * extent, _PRESLIDING_SHAPES),
        ),
    ]


def _drift_terms(centre: float) -> list[Term]:
    """Return the terms that are linear in the time from ``centre`` [s]."""
    return [
        _plain(
            "offset drift",
            "a constant effort drifts during the log",
            offset_drift=lambda m: m.time - centre,
        ),
        Term(
            name="friction drift",
            text="friction drifts during the log",
            shapes=(),
            proportional=lambda coulomb, viscous: _friction_drift(coulomb, viscous, centre),
        ),
        _plain(
            "viscous drift",
            "viscous friction drifts during the log",
            viscous_drift=lambda m: m.velocity * (m.time - centre),
        ),
        _plain(
            "gain drift",
            "the gain from logged to true effort drifts during the log",
            gain_drift=lambda m: -m.effort * (m.time - centre),
        ),
    ]


def _drive_terms(efforts: Float[np.ndarray, " n"]) -> list[Term]:
    """Return the terms of a drive, for the size of its effort in slip [N or N m]."""
    largest = float(np.max(efforts))
    lowest_limit = max(float(np.quantile(efforts, 1.0 - _MOST_SATURATED)), 1e-3 * largest)
    widest_band = max(float(np.quantile(efforts, _MOST_BANDED)), 1e-3 * largest)
    return [
        _family(
            DEAD_BAND,
            "a dead band of the actuator takes a part of every effort",
            lambda size: _dead_band(min(size, widest_band)),
            np.geomspace(_NARROWEST_BAND * widest_band, widest_band, _DEAD_BAND_SHAPES),
        ),
        Term(
            name=SATURATION,
            text="the drive saturates below the largest logged effort",
            shapes=tuple(
                Shape(
                    names=("effort_excess",),
                    columns=(effort_excess(limit),),
                    value=limit,
                    bounds=_ALL_OF_IT,
                )
                for limit in np.geomspace(lowest_limit, 0.98 * largest, _SATURATION_SHAPES).tolist()
            ),
        ),
    ]


def two_thirds_term() -> Term:
    """Return the term of friction that grows with the 2/3 power of the speed."""
    return _plain(
        "two-thirds",
        "friction grows with the 2/3 power of the speed",
        bounds=POSITIVE,
        two_thirds_friction=lambda m: m.direction * np.abs(m.velocity) ** (2.0 / 3.0),
    )


def small_power_term() -> Term:
    """Return the term of friction with a power of the speed below 2/3."""
    return Term(
        name=SMALL_POWER,
        text="friction grows with a small power of the speed",
        shapes=tuple(_small_power(exponent) for exponent in (0.2, 0.3, 0.4, 0.5)),
    )


def _small_power(exponent: float) -> Shape:
    return Shape(
        names=("small_power_friction",),
        columns=(lambda m: m.direction * np.abs(m.velocity) ** exponent,),
        value=exponent,
        bounds=POSITIVE,
    )


def travel_term(position: Float[np.ndarray, " n"]) -> Term:
    """Return the term of Coulomb friction that varies along the travel, which is never selected.

    Its factor is ``1 + a_1 P_1(s) + a_2 P_2(s)`` with Legendre polynomials of the place s, from -1
    to 1 over the positions [m or rad].
    """
    middle, half = 0.5 * float(np.max(position) + np.min(position)), 0.5 * float(np.ptp(position))
    return _plain(
        "travel",
        "friction varies along the travel",
        travel_slope=lambda m: m.direction * (m.position - middle) / half,
        travel_bend=lambda m: m.direction * (1.5 * ((m.position - middle) / half) ** 2 - 0.5),
    )


def ripple_term(periods: Sequence[float], tests: int, origin: float) -> Term:
    """Return the term of a force that repeats along the travel.

    ``periods`` are the likeliest ones [m or rad] of the number ``tests``, ``origin`` is the
    position at which the sine is zero [m or rad].
    """
    values = np.array(periods)

    def family(period: float) -> Shape:
        return _ripple(period, origin)

    term = _family("ripple", "a force repeats along the travel (ripple)", family, values)
    return replace(term, tests=tests)


def _family(
    name: str, text: str, family: Callable[[float], Shape], values: Float[np.ndarray, " n"]
) -> Term:
    shapes = tuple(family(value) for value in values.tolist())
    return Term(name=name, text=text, shapes=shapes, family=family)


def _stribeck(velocity: float) -> Shape:
    """Return ``sign(v) exp(-(v / v_s)^2)``."""
    return Shape(
        names=("static_friction",),
        columns=(lambda m: m.direction * np.exp(-((m.velocity / velocity) ** 2)),),
        value=velocity,
        bounds=POSITIVE,
    )


def _low_speed(velocity: float) -> Shape:
    """Return ``sign(v) exp(-(v / v_l)^2)`` with a negative coefficient: the reverse of Stribeck."""
    shape = _stribeck(velocity)
    return replace(shape, names=("low_speed_friction",), bounds=NEGATIVE)


def _presliding(distance: float) -> Shape:
    """Return ``sign(v) exp(-s / d)``, with the distance s since the direction changed (Dahl)."""

    def slope(size: Float[np.ndarray, " 1"]) -> Column:
        return lambda m: (
            size[0] * m.direction * np.exp(-m.travelled / distance) * m.travelled / distance**2
        )

    return Shape(
        names=("presliding_friction",),
        columns=(lambda m: m.direction * np.exp(-m.travelled / distance),),
        value=distance,
        bounds=NEGATIVE,
        slope=("presliding_distance", slope),
    )


def _dead_band(size: float) -> Shape:
    """Return ``clip(u / u_d, -1, 1)``: the effort that a dead band of the size u_d takes."""
    return Shape(
        names=("dead_band",),
        columns=(lambda m: np.clip(m.effort / size, -1.0, 1.0),),
        value=size,
        bounds=(_ALL_OF_IT[0] * size, _ALL_OF_IT[1] * size),
        of_effort=True,
    )


def effort_excess(limit: float) -> Column:
    """Return the excess of the effort over a limit [N or N m]."""
    return lambda m: np.sign(m.effort) * np.maximum(np.abs(m.effort) - limit, 0.0)


def _ripple(period: float, origin: float) -> Shape:
    wave = 2.0 * np.pi / period

    def slope(sizes: Float[np.ndarray, " 2"]) -> Column:
        def column(m: SlipMotion) -> Float[np.ndarray, " n"]:
            place = m.position - origin
            turned = sizes[0] * np.cos(wave * place) - sizes[1] * np.sin(wave * place)
            return -turned * place * wave / period

        return column

    return Shape(
        names=("ripple_sine", "ripple_cosine"),
        columns=(
            lambda m: np.sin(wave * (m.position - origin)),
            lambda m: np.cos(wave * (m.position - origin)),
        ),
        value=period,
        slope=("ripple_period", slope),
    )


def _friction_drift(coulomb: float, viscous: float, centre: float) -> Shape:
    """Return ``(f_c sign(v) + c v) (t - t_c)``: friction grows in proportion."""
    return Shape(
        names=("friction_drift",),
        columns=(lambda m: (coulomb * m.direction + viscous * m.velocity) * (m.time - centre),),
    )
