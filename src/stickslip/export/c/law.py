"""The friction law that exported code holds, from an estimate or from a law."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.export.c.kernels import friction
from stickslip.export.parameters import ExportParameters
from stickslip.friction import CoulombViscousFriction
from stickslip.friction.coulomb_viscous import DirectionalFriction

Pair = tuple[float, float]  # positive and negative direction


@dataclass(frozen=True, kw_only=True)
class CodeLaw:
    """A friction law of velocity."""

    # Friction in the positive and the negative direction
    coulomb: Pair  #: [N or N m].
    static: Pair  #: [N or N m].
    viscous: Pair  #: [N s/m or N m s/rad].
    offset: float = 0.0  #: Constant effort lost whatever the motion [N or N m].
    #: Of the Stribeck effect [m/s or rad/s]; 0 for none, and static friction then holds at rest
    #: only.
    stribeck_velocity: float = 0.0
    exponent: float = 2.0  #: Of the Stribeck effect [-].
    quadratic: float = 0.0  #: Friction per squared speed [SI].
    two_thirds: float = 0.0  #: Friction per speed^(2/3) [SI].
    low_speed: float = 0.0  #: Friction of low speeds [N or N m].
    low_speed_velocity: float = 0.0  #: Speed that leaves 1/e of it [m/s or rad/s].

    @classmethod
    def of(cls, law: DirectionalFriction) -> "CodeLaw":
        """Return the law of a plant."""
        effect = law.effect
        return cls(
            coulomb=(law.coulomb_friction_positive, law.coulomb_friction_negative),
            static=(law.static_friction_positive, law.static_friction_negative),
            viscous=(law.viscous_friction_positive, law.viscous_friction_negative),
            offset=law.offset,
            stribeck_velocity=0.0 if effect is None else effect.velocity,
            exponent=2.0 if effect is None else effect.exponent,
        )

    @classmethod
    def estimated(cls, parameters: ExportParameters) -> "CodeLaw":
        """Return the law of an estimate; what it does not hold is 0."""
        values: Mapping[str, float] = parameters.values
        coulomb = parameters.pair("coulomb_friction") or (0.0, 0.0)
        return cls(
            coulomb=coulomb,
            static=parameters.pair("static_friction") or coulomb,
            viscous=parameters.pair("viscous_friction") or (0.0, 0.0),
            # Friction per direction contains an offset that was not estimated apart
            offset=values.get("offset", 0.0),
            stribeck_velocity=values.get("stribeck_velocity", 0.0),
            quadratic=values.get("quadratic_friction", 0.0),
            two_thirds=values.get("two_thirds_friction", 0.0),
            low_speed=values.get("low_speed_friction", 0.0),
            low_speed_velocity=values.get("low_speed_velocity", 0.0),
        )

    def numbers(self, inertia: float, dead_band: float) -> Float[np.ndarray, " n"]:
        """Return the numbers of the law as `friction.LAW` lays them out."""
        record = np.zeros(1, friction.LAW)
        record["inertia"], record["offset"], record["dead_band"] = inertia, self.offset, dead_band
        record["coulomb"], record["viscous"] = self.coulomb, self.viscous
        record["stribeck_velocity"] = self.stribeck_velocity or 1.0
        record["exponent"] = self.exponent
        if self.stribeck_velocity > 0.0:
            record["excess"] = np.subtract(self.static, self.coulomb)
        record["quadratic"], record["two_thirds"] = self.quadratic, self.two_thirds
        record["low_speed"] = self.low_speed if self.low_speed_velocity > 0.0 else 0.0
        record["low_speed_velocity"] = self.low_speed_velocity or 1.0
        return record.view(np.float64).ravel().copy()

    @property
    def affine(self) -> CoulombViscousFriction:
        """The law without what is not affine in the velocity; its friction must not be negative."""
        names = ("coulomb", "viscous", "static")
        values = {
            f"{name}_friction_{side}": pair[k]
            for name, pair in zip(names, (self.coulomb, self.viscous, self._static()), strict=True)
            for k, side in enumerate(("positive", "negative"))
        }
        return CoulombViscousFriction(**values, offset=self.offset)

    def _static(self) -> Pair:
        """Return the static friction, which an affine law has above the Coulomb friction only."""
        (a, b), (c, d) = self.static, self.coulomb
        return max(a, c), max(b, d)
