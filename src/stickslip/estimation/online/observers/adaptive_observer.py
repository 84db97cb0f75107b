"""What observers whose error decays at a chosen rate have in common."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.estimation.online.method import State
from stickslip.estimation.online.observers import force_balance as at
from stickslip.estimation.online.observers.force_observer import ForceObserver
from stickslip.estimation.settings import check_given
from stickslip.records import AxisLog, InputError, positive

__all__ = ["AdaptiveObserver"]


@dataclass(frozen=True, kw_only=True)
class AdaptiveObserver(ForceObserver):
    """An observer whose error decays at a rate that is chosen.

    Attributes
    ----------
    inertia
        Moving mass or inertia [kg or kg m^2], of a flexible arm that of the driven side.
    viscous
        Whether viscous friction is estimated beside Coulomb friction.
    rate
        At which the error of the Coulomb friction decays at the typical speed [1/s]. With viscous
        friction beside it, a rate far beyond that at which the speed varies makes both slower to
        converge: the observer then follows the sum of the moment.
    speed
        Typical speed of the axis [m/s or rad/s], to which the gains refer; None takes the rms speed
        of the log, and cannot be used on line.
    """

    inertia: float
    viscous: bool = False
    rate: float = 3.0
    speed: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("rate", self.rate, "1/s")
        check_given(self, positive, {"speed": "m/s or rad/s"})

    @property
    def _estimated(self) -> tuple[str, ...]:
        return (
            *(("viscous_friction",) if self.viscous else ()),
            "coulomb_friction",
            *(("offset",) if self.offset else ()),
        )

    def _lay_settings(self, s: State) -> None:
        if self.speed is None:
            raise InputError(
                "the typical speed is not given, and a first state needs it",
                remedy="give speed [m/s or rad/s], or use fit",
            )
        s[at.SPEED] = self.speed
        s[at.GAINS + 1] = self.rate
        if self.viscous:
            s[at.GAINS] = self.rate / self.speed**2
        if self.offset:
            s[at.GAINS + 2] = self.rate

    def _settled(self, log: AxisLog) -> ForceObserver:
        speed = self.speed
        if speed is None:
            parts = [self._samples(part)[:, 2] for part in log.segments()]
            speed = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        return ForceObserver._settled(replace(self, speed=speed), log)
