"""A friction law with its values: what it says of a log."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.estimation.regression.law_selection.friction_form import SIDES, FrictionForm
from stickslip.estimation.regression.law_selection.smooth_motion import RowSettings
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, FrictionEstimate, InputError, quantity_field
from stickslip.simulation import PlantStepper

__all__ = ["FittedLaw"]


@dataclass(frozen=True, kw_only=True)
class FittedLaw:
    """A rigid axis with a friction law of some form.

    Attributes
    ----------
    form
        Its terms.
    inertia
        Moving mass [kg] or inertia [kg m^2].
    values
        Of each of the form's names [SI].

    Raises
    ------
    InputError
        If a value is missing or not finite.
    """

    form: FrictionForm
    inertia: float = quantity_field("mass")
    values: Mapping[str, float]

    def __post_init__(self) -> None:
        for name in self.form.names:
            if not math.isfinite(self.values.get(name, math.nan)):
                raise InputError(
                    f"{name} is {self.values.get(name)}, and the form has it",
                    remedy=f"give a value for each of {', '.join(self.form.names)}",
                )
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))

    @classmethod
    def of(cls, estimate: FrictionEstimate, *, inertia: float | None = None) -> "FittedLaw":
        """Return the law that an estimate of Coulomb and viscous friction describes.

        Parameters
        ----------
        estimate
            With all parameters identified.
        inertia
            Moving mass or inertia, if it was given and not estimated [kg or kg m^2].

        Raises
        ------
        InputError
            If a parameter is not identified, or there is no inertia.
        """
        values = {name: estimate.value(name) for name in estimate.parameters}
        sided = "coulomb_friction_positive" in values
        mass = values.get("mass", values.get("inertia", inertia))
        if mass is None:
            raise InputError(
                "the estimate holds no inertia", remedy="give the one it was fitted with"
            )
        if sided:  # an offset beside two Coulomb values is half of their difference
            offset = values.pop("offset", 0.0)
            values["coulomb_friction_positive"] += offset
            values["coulomb_friction_negative"] -= offset
        form = FrictionForm(
            coulomb_per_direction=sided, viscous_per_direction=sided, offset="offset" in values
        )
        return cls(form=form, inertia=mass, values={name: values[name] for name in form.names})

    def without_ripple(self) -> "FittedLaw":
        """Return the law without what ripples along the way.

        A log counts its positions from where the axis was referenced. After another reference the
        ripple has another phase, which the law does not know.
        """
        form = replace(self.form, period=None)
        values = {name: self.values[name] for name in form.names}
        return FittedLaw(form=form, inertia=self.inertia, values=values)

    def friction(self, position: ArrayLike, velocity: ArrayLike) -> Float[np.ndarray, " n"]:
        """Return the force of all terms in motion [N or N m].

        Parameters
        ----------
        position, velocity
            [m and m/s, or rad and rad/s], shape (n,).
        """
        return self.form.friction(self.values, position, velocity)

    def effort_residual(self, log: AxisLog, rows: RowSettings | None = None) -> float:
        """Return the share of the effort that the inverse dynamics leave unexplained [-].

        Parameters
        ----------
        log
            Of this axis; another one than it was fitted to makes this a cross-test.
        rows
            How the log becomes rows.
        """
        motion = (rows or RowSettings()).motion(log)
        force = self.inertia * motion.acceleration + self.friction(motion.position, motion.velocity)
        both = motion.decimated(np.column_stack([motion.effort, motion.effort - force]))
        return float(np.linalg.norm(both[:, 1]) / np.linalg.norm(both[:, 0]))

    def free_run(
        self, log: AxisLog, starts: Sequence[int] = (), rows: RowSettings | None = None
    ) -> Float[np.ndarray, " n"]:
        """Return the positions of the simulated axis under the logged effort [m or rad].

        What of the law is Coulomb and viscous friction and offset is propagated exactly, rests
        included; what is left is held over each sample, at its value in the middle. At rest the
        axis stays while the effort is within the slowest friction.

        Parameters
        ----------
        log
            Whose effort drives it.
        starts
            Samples at which it starts anew from the measured state, beside the first one [-].
        rows
            How the state is smoothed.
        """
        motion = (rows or RowSettings()).motion(log)
        T = log.sampling_time
        base = self._base()
        stepper = PlantStepper(SingleMass(mass=self.inertia, friction=base), sampling_time=T)
        rest = self._remainder(base)
        efforts = log.effort.tolist()
        reached = np.empty(len(log))
        for start, stop in pairwise([*sorted({0, *starts}), len(log)]):
            x, v = float(motion.position[start]), float(motion.velocity[start])
            state, before = stepper.init((x, v)), v
            for k in range(start, stop):
                reached[k] = x
                ahead = 1.5 * v - 0.5 * before  # in the middle of the sample, if it goes on so
                force = rest(x + 0.5 * T * v, ahead if ahead * v > 0 else v)
                before = v
                state, (x, v) = stepper.step(state, efforts[k] - force)
        return reached

    def _base(self) -> CoulombViscousFriction:
        """Return the part of the law that the simulator knows."""
        values, form = self.values, self.form

        def side(term: str, which: str) -> float:
            return values.get(f"{term}_{which}", values.get(term, 0.0))

        slow = "coulomb_friction" if form.stribeck is None else "static_friction"
        ahead, back = (side(slow, which) for which in SIDES)
        linear = form.exponent == 1.0
        return CoulombViscousFriction(
            coulomb_friction_positive=ahead,
            coulomb_friction_negative=back,
            static_friction_positive=ahead,
            static_friction_negative=back,
            viscous_friction_positive=side("viscous_friction", SIDES[0]) if linear else 0.0,
            viscous_friction_negative=side("viscous_friction", SIDES[1]) if linear else 0.0,
            offset=values.get("offset", 0.0),
        )

    def _remainder(self, base: CoulombViscousFriction) -> Callable[[float, float], float]:
        """Return the rest of the law as a function of position and velocity, in plain floats."""
        form, values = self.form, self.values
        stiffness = values["stiffness"] if form.stiffness else 0.0
        waves = [
            (
                2.0 * math.pi * k / form.period,
                values[f"ripple_cosine_{k}"],
                values[f"ripple_sine_{k}"],
            )
            for k in range(1, form.harmonics + 1)
            if form.period is not None
        ]
        viscous, rise = (
            [values.get(f"{term}_{side}", values.get(term, 0.0)) for side in SIDES]
            for term in ("viscous_friction", "coulomb_friction")
        )
        rise = [
            rise[0] - base.coulomb_friction_positive,
            rise[1] - base.coulomb_friction_negative,
        ]
        effect, power = form.stribeck, form.exponent

        def rest(x: float, v: float) -> float:
            force = stiffness * x
            for wave, cosine, sine in waves:
                force += cosine * math.cos(wave * x) + sine * math.sin(wave * x)
            if v == 0.0:
                return force
            side = 0 if v > 0 else 1
            speed, moving = abs(v), 0.0
            if power != 1.0:
                moving = viscous[side] * speed**power
            if effect is not None:
                left = math.exp(-((speed / effect.velocity) ** effect.exponent))
                moving += rise[side] * (1.0 - left)
            return force + math.copysign(moving, v)

        return rest
