"""Parameters of an estimate as exports use them: identified, on one side, in SI units."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from stickslip.export.transmission import Side, Transmission, factor
from stickslip.records import (
    AxisKind,
    InputError,
    ReadOnlyMapping,
    Status,
    in_words,
    mass_name,
    quantity_name,
    unit_of,
)

SLIDING = ("coulomb_friction", "viscous_friction", "static_friction", "stribeck_velocity")
"""Quantities of friction at any speed."""

_SIDES = ("_positive", "_negative")


@dataclass(frozen=True, kw_only=True)
class Source:
    """The origin of exported values."""

    file: str = ""  #: Name of the estimate's file; empty for one in memory.
    logs: tuple[str, ...] = ()  #: Names of the logs that it was identified from.
    status: Status = Status.OK  #: Of the estimate.
    estimator: str = ""  #: Name of the estimator.
    version: str = ""  #: Version of stickslip that wrote the estimate.
    sha256: str = ""  #: Hash of the log; empty for one in memory.

    @property
    def text(self) -> str:
        """One sentence on the origin."""
        logs = f" from {', '.join(self.logs)}" if self.logs else ""
        named = f" ({self.file})" if self.file else ""
        digest = f", sha256 {self.sha256[:12]}" if self.sha256 else ""
        by = f" by stickslip {self.version}" if self.version else ""
        with_method = f", estimator {self.estimator}" if self.estimator else ""
        return f"Identified{logs}{by}{with_method}{named}{digest}; status: {self.status.value}"


@dataclass(frozen=True, kw_only=True)
class ExportParameters:
    """Parameters of one axis that an export may write."""

    #: ``"linear"`` or ``"rotary"``; its units are those of `stickslip.records.unit_of`.
    kind: AxisKind
    #: Values that may be written, by parameter name [SI]; those identified, and with ``force`` also
    #: others that have a value.
    values: Mapping[str, float]
    #: Parameters that are not written, each with the reason.
    withheld: Mapping[str, str] = field(default_factory=dict)
    #: Parameters that are written although they were not identified, each with the reason.
    forced: Mapping[str, str] = field(default_factory=dict)
    #: Names of values that were not estimated but given to the estimator, such as a known mass.
    given: frozenset[str] = frozenset()
    #: Standard deviations by name [SI]; given values have none.
    std: Mapping[str, float] = field(default_factory=dict)
    #: 95 % intervals (low, high) by name [SI]; given values have none.
    ci95: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    #: Of the parameters in ``uncertain`` [SI], shape (p, p); the log's, not that of given values.
    covariance: Float[np.ndarray, "p p"] = field(default_factory=lambda: np.zeros((0, 0)))
    #: Names of the rows of ``covariance``, all of which are in ``values``.
    uncertain: tuple[str, ...] = ()
    side: Side = "joint"  #: Side that the values are of.
    #: The side of the estimate and the ratio to the other.
    transmission: Transmission = field(default_factory=Transmission)
    source: Source = field(default_factory=Source)  #: Where the values come from.

    def __post_init__(self) -> None:
        for name in ("values", "withheld", "forced", "std", "ci95"):
            object.__setattr__(self, name, ReadOnlyMapping(getattr(self, name)))
        covariance = np.array(self.covariance, dtype=np.float64)
        covariance.flags.writeable = False
        object.__setattr__(self, "covariance", covariance)

    @property
    def inertia(self) -> float | None:
        """Moving mass [kg] or inertia [kg m^2]; None if there is none to write."""
        return self.values.get(mass_name(self.kind))

    @property
    def offset(self) -> float:
        """Constant effort lost whatever the motion [N or N m]; 0 if there is none to write.

        Friction per direction contains it: half of the difference of the Coulomb frictions.
        """
        if "offset" in self.values:
            return self.values["offset"]
        if self.directional("coulomb_friction"):
            forward, backward = self.pair("coulomb_friction") or (0.0, 0.0)
            return 0.5 * (forward - backward)
        return 0.0

    def unit(self, name: str) -> str:
        """Return the SI unit of a parameter."""
        return unit_of(name, self.kind)

    def has(self, quantity: str) -> bool:
        """Return whether there is a value of a quantity, in both directions."""
        return self.pair(quantity) is not None

    def pair(self, quantity: str) -> tuple[float, float] | None:
        """Return the value of a quantity in the positive and in the negative direction [SI]."""
        if quantity in self.values:
            return self.values[quantity], self.values[quantity]
        names = [quantity + side for side in _SIDES]
        if all(name in self.values for name in names):
            return self.values[names[0]], self.values[names[1]]
        return None

    def directional(self, quantity: str) -> bool:
        """Return whether a quantity has a value for each direction."""
        return quantity not in self.values and self.has(quantity)

    def mean(self, quantity: str) -> float | None:
        """Return the value of a quantity, of both directions the mean [SI]; None without one."""
        pair = self.pair(quantity)
        return None if pair is None else 0.5 * (pair[0] + pair[1])

    def required(self, quantity: str, title: str) -> float:
        """Return the mean of both directions, which the target of this title needs [SI].

        Raises
        ------
        InputError
            If it is withheld or not in the estimate.
        """
        value = self.mean(quantity)
        if value is not None:
            return value
        reason = next((r for n, r in self.withheld.items() if quantity_name(n) == quantity), None)
        code = "parameter_absent" if reason is None else "parameter_withheld"
        raise InputError(code, where=self.source.file, title=title, name=quantity, reason=reason)

    def sliding_law(self, title: str) -> tuple[float, float, float, float | None]:
        """Return Coulomb, viscous and static friction and Stribeck velocity, means [SI].

        Without viscous or static friction they are zero and the Coulomb friction, which the target
        of this title needs.
        """
        coulomb = self.required("coulomb_friction", title)
        static = max(coulomb, self.mean("static_friction") or coulomb)
        viscous = self.mean("viscous_friction") or 0.0
        return coulomb, viscous, static, self.mean("stribeck_velocity")

    def on(self, side: Side | None) -> "ExportParameters":
        """Return the parameters on a side of the transmission.

        Parameters
        ----------
        side
            ``"motor"`` or ``"joint"``; None for the side they are of.

        Raises
        ------
        InputError
            If they are of the other side and the ratio is not given.
        """
        if side is None or side == self.side:
            return self
        ratio = self.transmission.ratio()
        if ratio is None:
            raise InputError(
                "gear_ratio_missing", where=self.source.file, side=self.side, wanted=side
            )
        factors = {
            name: factor(quantity_name(name), ratio, to=side)
            for name in dict.fromkeys((*self.values, *self.std, *self.uncertain))
        }
        withheld = dict(self.withheld)
        for name, scale in factors.items():
            if scale is None:
                withheld[_turned(name, ratio)] = "it has no value on the other side of the gear"
        known = {name: scale for name, scale in factors.items() if scale is not None}
        kind = self.transmission.kind_on(side, self.kind)

        def renamed(name: str) -> str:
            turned = _turned(name, ratio)
            return mass_name(kind) if turned in {"mass", "inertia"} else turned

        rows = [k for k, name in enumerate(self.uncertain) if name in known]
        scales = np.array([known[self.uncertain[k]] for k in rows])
        return replace(
            self,
            kind=kind,
            side=side,
            values={renamed(n): v * known[n] for n, v in self.values.items() if n in known},
            std={renamed(n): v * abs(known[n]) for n, v in self.std.items() if n in known},
            ci95={
                renamed(n): _scaled(interval, known[n])
                for n, interval in self.ci95.items()
                if n in known
            },
            withheld={renamed(name): reason for name, reason in withheld.items()},
            forced={renamed(name): reason for name, reason in self.forced.items()},
            given=frozenset(renamed(name) for name in self.given),
            uncertain=tuple(renamed(self.uncertain[k]) for k in rows),
            covariance=self.covariance[np.ix_(rows, rows)] * np.outer(scales, scales),
        )

    def warnings(self, quantities: tuple[str, ...]) -> tuple[str, ...]:
        """Return one sentence on each of the quantities that was written by force."""
        return tuple(
            in_words(f"{name} was written by force: {reason}")
            for name, reason in self.forced.items()
            if quantity_name(name) in quantities
        )

    def missing(self, quantities: tuple[str, ...]) -> tuple[str, ...]:
        """Return one sentence on each of these quantities that is withheld."""
        return tuple(
            in_words(f"{name} is not written: {reason}")
            for name, reason in self.withheld.items()
            if quantity_name(name) in quantities
        )

    def omissions(
        self, title: str, represents: Collection[str], cannot: Mapping[str, str]
    ) -> tuple[str, ...]:
        """Return one sentence on each effect of the estimate that a target does not represent.

        Parameters
        ----------
        title
            Of the target.
        represents
            Quantities that it holds.
        cannot
            What it does instead, by quantity, or by ``"direction"`` for different values in the
            directions; the end of a sentence.
        """
        sentences: list[str] = []
        if "direction" in cannot:
            sentences += [
                in_words(f"{name} per direction {cannot['direction']}")
                for name in ("coulomb_friction", "viscous_friction")
                if (pair := self.pair(name)) is not None and pair[0] != pair[1]
            ]
        others: list[str] = []
        for quantity in dict.fromkeys(("offset", *map(quantity_name, self.values))):
            value = self.offset if quantity == "offset" else self.mean(quantity)
            # Within twice its standard deviation of zero, it may not exist
            exists = value is not None and abs(value) > 2.0 * self.std.get(quantity, 0.0)
            if not exists or quantity in (*represents, "mass", "inertia"):
                continue
            unit = self.unit(quantity)
            shown = in_words(f"{quantity} ({value:.4g}{'' if unit == '-' else f' {unit}'})")
            if quantity in cannot:
                sentences.append(f"{shown} {cannot[quantity]}")
            else:
                others.append(shown)
        if others:
            sentences.append(f"not represented in {title}: {', '.join(others)}")
        return tuple(each[0].upper() + each[1:] for each in sentences)


def _scaled(interval: tuple[float, float], factor: float) -> tuple[float, float]:
    low, high = (factor * each for each in interval)
    return min(low, high), max(low, high)


def _turned(name: str, ratio: float) -> str:
    """Return the name of a parameter on the other side, whose directions may be opposite."""
    if ratio > 0:
        return name
    for side, other in (_SIDES, _SIDES[::-1]):
        if name.endswith(side):
            return name.removesuffix(side) + other
    return name
