"""Other laws of friction, and gravity for a spring, that explain a log as well."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import robust_uncertainty
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.selection.model import Model, smallest_ratio
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.search.forward import BENDS
from stickslip.estimation.selection.search.shapes import best_shape, refined
from stickslip.estimation.selection.terms import (
    SMALL_POWER,
    Term,
    small_power_term,
    travel_term,
    two_thirds_term,
)
from stickslip.records import AxisKind


@dataclass(frozen=True, kw_only=True)
class RivalTuning:
    """Tuning of rival laws."""

    smallest_difference: float = 0.05
    """Relative difference of Coulomb friction [-] up to which there is no note."""
    smallest_ratio: float = 3e-3
    """Smallest over largest singular value of the columns of a rival [-]: below it they do not
    determine its parameters."""


_LAWS: dict[tuple[bool, tuple[str, ...]], str] = {
    (True, ()): "viscous friction",
    (False, ("two-thirds",)): "friction with the 2/3 power of the speed",
    (True, ("two-thirds",)): "viscous friction with a part of the 2/3 power of the speed",
    (False, (SMALL_POWER,)): "friction with a power of the speed below 2/3",
    (True, ("quadratic",)): "viscous and quadratic friction",
    (False, ("two-thirds", "quadratic")): "friction with the 2/3 power and the square of the speed",
    (True, ("stribeck",)): "a Stribeck effect",
    (True, ("low speed",)): "lower friction at low speed",
    (True, ("stribeck", "quadratic")): "a Stribeck effect with quadratic friction",
}
"""Laws of friction over speed in words, by whether they have viscous friction and by the terms that
make them nonlinear (`BENDS`)."""


@dataclass(frozen=True, kw_only=True)
class Rival:
    """The model with another law of friction or another load, and its weight."""

    model: Model  #: With the other law.
    law: str  #: In words.
    weight: float  #: Least-squares weight w of the other law [-] (`rival_laws`).
    std: float  #: Standard error of the weight [-].
    further: int = 0  #: Number of parameters that it has more than the selected law [-].
    load: bool = False  #: Whether it is another load, with the selected law of friction.

    @property
    def explains_as_well(self) -> bool:
        """Whether the log prefers the selected law by one standard error at most."""
        return self.weight > 0.5 - self.std

    @property
    def explains_more(self) -> bool:
        """Whether the residual decreases with the other law, by more than one standard error.

        Or below that of the selected law, which a weight above one half means. With a law of more
        parameters, which decreases any residual, by more than two standard errors for one and
        twice the square root of their number for several.
        """
        if self.further <= 0:
            return self.weight > min(self.std, 0.5)
        return self.weight > _LARGER * float(np.sqrt(self.further)) * self.std

    @property
    def counts(self) -> bool:
        """Whether intervals contain its parameters."""
        return self.explains_as_well and (self.load or self.explains_more)


_ROUNDING = 1e-9  # of a position: a shorter travel is none [-]
_LARGER = 2.0  # standard errors [-], of the weight of a law with more parameters

_GRAVITY = (
    "gravity on a swinging load explains this log as well as a spring, so that stiffness and "
    "offset are uncertain; record a longer travel, or exclude the term that the axis does not have"
)
_LACKING_GRAVITY = (
    "the spring may be gravity that the model of the robot lacks, as that of a payload, so that "
    "stiffness and offset are uncertain; check its masses"
)


def rival_laws(
    model: Model,
    terms: Sequence[Term] = (),
    tuning: RivalTuning | None = None,
) -> list[Rival]:
    """Return the model with other laws of friction that have the right signs, or another load.

    The other load is gravity in place of a selected spring: within a short swing they differ
    little, but the constant part of gravity is offset beside a spring.

    A selected law and another one are nested in ``y = y_own + w (y_other - y_own)``, where y are
    the fitted efforts: the weight w is 0 where the selected law is right, 1 where the other one is,
    and one half where both leave the same residual (J test: R. Davidson and J. G. MacKinnon 1981,
    "Several tests for model specification in the presence of alternative hypotheses", Econometrica
    49(3), 781-793). Its standard error is that of correlated residuals. The weight of a law that
    contains the selected one is 1, and its inverse standard error the t value of the added terms.

    ``terms`` are the candidates of the log; empty for the 2/3 power of the speed alone.
    """
    nonlinear = len(terms) > 0
    terms = (*(terms or (two_thirds_term(),)), small_power_term())
    tuning = RivalTuning() if tuning is None else tuning
    kept = tuple(pair for pair in model.chosen if pair[0].name not in BENDS)
    found: list[Rival | None] = []
    for (viscous, names), words in _LAWS.items():
        if not _is_rival(model, viscous, names):
            continue
        start = replace(model, viscous=viscous, chosen=kept)
        bends = [term for term in terms if term.name in names]
        if names == (SMALL_POWER,):  # each power is a law of its own, as a log shows it roughly
            powers = [[replace(bends[0], shapes=(shape,))] for shape in bends[0].shapes]
            found += [_rival(model, start, power, words, tuning) for power in powers]
        elif len(bends) == len(names):
            found.append(_rival(model, start, bends, words, tuning))
    place = model.rows.position
    if nonlinear and np.ptp(place) > _ROUNDING * np.max(np.abs(place)):
        words = "friction that varies along the travel"
        found.append(_rival(model, model, [travel_term(place)], words, tuning))
    gravity = [term for term in terms if term.name == "gravity"]
    if gravity and "spring" in model.names and "gravity" not in model.names:
        start = replace(
            model, chosen=tuple(each for each in model.chosen if each[0].name != "spring")
        )
        found.append(_rival(model, start, gravity, "gravity", tuning, load=True))
    return [rival for rival in found if rival is not None]


def _rival(
    model: Model,
    start: Model,
    terms: Sequence[Term],
    words: str,
    tuning: RivalTuning,
    *,
    load: bool = False,
) -> Rival | None:
    """Return a model with further terms as a rival; None without a fit, or if both fit the same."""
    other = _with_terms(start, terms, tuning)
    weighed = None if other is None else _weighed(model, other)
    if other is None or weighed is None:
        return None
    weight, std = weighed
    further = _parameters(other) - _parameters(model)
    return Rival(model=other, law=words, weight=weight, std=std, further=further, load=load)


def _parameters(model: Model) -> int:
    """Return the number of parameters, with those of the shapes."""
    return model.columns().shape[1] + sum(term.family is not None for term, _ in model.chosen)


def _is_rival(model: Model, viscous: bool, names: tuple[str, ...]) -> bool:
    """Return whether a law is to be compared with that of a model."""
    bends = {name for name in model.names if name in BENDS}
    if "two-thirds" in names and "direction" in model.names:  # not combined in the search either
        return False
    if not bends:  # the search has tested the terms that would make viscous friction nonlinear
        return not viscous and names == ("two-thirds",)
    if SMALL_POWER in names:  # a curve that is bent more than the selected one
        return bends == {"two-thirds"} and not model.viscous
    return viscous != model.viscous or set(names) != bends


def _with_terms(start: Model, terms: Sequence[Term], tuning: RivalTuning) -> Model | None:
    """Return the model with terms in their best shapes; None if one has a wrong sign or no fit.

    A term of the model that has the wrong sign beside them is left out: it may stand for the law.
    """
    model = start
    for term in terms:
        fits = best_shape(model, term, model.basis())
        if fits is None:
            return None
        model = model.with_term(term, fits[0])
        if term.family is not None:
            model = refined(model)
    if model.rows.size <= model.columns().shape[1] + 1:
        return None
    wrong = {t.name for t, shape in model.chosen if not shape.allows(model.coefficients(t.name))}
    left = tuple(pair for pair in start.chosen if pair[0].name not in wrong)
    if len(left) < len(start.chosen):
        return _with_terms(replace(start, chosen=left), terms, tuning)
    coulomb, viscous = model.friction()
    proper = not wrong and coulomb > 0.0 and viscous >= 0.0
    return model if proper and smallest_ratio(model.columns()) > tuning.smallest_ratio else None


def _weighed(model: Model, rival: Model) -> tuple[float, float] | None:
    """Return the weight of a rival and its standard error [-]; None if both fit the same."""
    basis = model.basis()
    partial = basis.partial((rival.columns() @ rival.solution)[:, None])
    if partial is None or partial.values[0] == 0.0:
        return None
    vectors = np.column_stack([basis.vectors, partial.vectors])
    residual = basis.residual - partial.vectors @ partial.coordinates
    size = float(partial.coordinates[0] / partial.values[0])
    to_weight = np.eye(vectors.shape[1])[-1:] / size
    found = robust_uncertainty(vectors, to_weight, residual, slow=True, log=basis.log)
    return float(partial.values[0]), float(np.sqrt(found.covariance[0, 0]))


def rival_note(
    model: Model, rivals: Sequence[Rival], kind: AxisKind, unit: str, tuning: RivalTuning
) -> str:
    """Return a note on a law that explains the log as well.

    The laws differ most below the driven speeds, so that Coulomb friction, the value at rest,
    depends on the law.

    The note is on gravity, or on the rival whose Coulomb friction differs most; empty if the log
    distinguishes the laws, or their Coulomb frictions agree.
    """
    own = model.friction()[0]
    if any(rival.load and rival.counts for rival in rivals):
        return _GRAVITY
    if _may_lack_gravity(model, kind):
        return _LACKING_GRAVITY
    others = [
        (abs(rival.model.friction()[0] - own), rival.model.friction()[0], rival.law)
        for rival in rivals
        if rival.explains_as_well and (rival.explains_more or rival.further <= 0) and not rival.load
    ]
    difference, other, law = max(others, default=(0.0, own, ""))
    if difference <= tuning.smallest_difference * abs(own):
        return ""
    return (
        f"{law} explains this log as well, with Coulomb friction {other:.4g} {unit} instead of "
        f"{own:.4g} {unit}; record moves at more speeds along the same travel to distinguish them"
    )


def rival_shifts(
    model: Model,
    rows: ModelRows,
    rivals: Sequence[Rival],
    others: Sequence[ModelRows],
    kind: AxisKind,
) -> Float[np.ndarray, "k p"] | None:
    """Return the differences to the parameters of the laws that explain the log as well [SI].

    The mean of their squares, that of the selected law counted as zero, is the variance between the
    models about the selected one (S. T. Buckland, K. P. Burnham and N. H. Augustin 1997, "Model
    selection: an integral part of inference", Biometrics 53(2), 603-618). A parameter that another
    law lacks is zero there; static friction is then its Coulomb friction, and a velocity
    is that of the selected law.

    None if the log distinguishes the laws, or no other law decreases the residual.
    """
    own = dict(zip(rows.names, rows.values().tolist(), strict=True))
    shifts = _of_lacking_gravity(model, rows) if _may_lack_gravity(model, kind) else []
    for rival, other in zip(rivals, others, strict=True):
        if not rival.counts:
            continue
        values = dict(zip(other.names, other.values().tolist(), strict=True))
        shifts.append([_value(values, name, own[name]) - own[name] for name in rows.names])
    return np.array(shifts) if shifts else None


def _may_lack_gravity(model: Model, kind: AxisKind) -> bool:
    """Return whether a spring and an offset may be gravity that a model of the machine lacks.

    On a linear axis gravity is constant, and no spring.
    """
    acts = kind == "rotary" and model.offset and "spring" in model.names
    return acts and bool(np.any(model.rows.model_effort))


def _of_lacking_gravity(model: Model, rows: ModelRows) -> list[list[float]]:
    """Return the differences by gravity of a payload in place of a spring beside a model [SI].

    The torque ``g sin(x - x_g)`` of a mass that the model of a robot lacks has the slope
    k = g cos(x - x_g) of the spring in the middle of the motion. There it is k tan(x - x_g), which
    is between -k and k for half of all directions, and k (x - x_0) with the spring. The
    difference of these is a part of the offset.
    """
    shape = next(shape for term, shape in model.chosen if term.name == "spring")
    stiffness = float(model.coefficients("spring")[0])
    middle = float(np.mean(model.rows.means(shape)))
    offset = least_squares(rows.columns, model.scaled(np.ones(model.rows.size)))
    own = np.equal(rows.names, "spring_stiffness")
    return [
        np.where(own, -stiffness, stiffness * (middle + torque) * offset).tolist()
        for torque in (-1.0, 1.0)
    ]


def _value(values: dict[str, float], name: str, own: float) -> float:
    """Return a parameter of another law [SI]."""
    if name in values:
        return values[name]
    if name.startswith("static_friction"):
        return values.get(name.replace("static", "coulomb"), own)
    return own if name.endswith("_velocity") else 0.0
