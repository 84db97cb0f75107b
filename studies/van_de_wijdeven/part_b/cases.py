"""The controllers of the source's simulations, in the readings that its text allows."""

from dataclasses import dataclass, replace
from typing import Literal

from stickslip.control import (
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
    RestDetection,
)
from studies.van_de_wijdeven.part_b.setting import (
    COULOMB_FRICTION,
    GUESS,
    LONGEST_PULSE,
    MASS,
    PULSE_EFFORT,
    SAMPLING_TIME,
    START_ERROR,
    TOLERANCE,
)

PWC = "PWC"
PAPWC = "PAPWC"
UNBOUNDED, BOUNDED = None, LONGEST_PULSE

CALCULATED = "u_p as calculated"
APPLIED = "u_p as applied"
SMALL = "P(0) = 1e-5 I"
LARGE = "P(0) = 1e5 I"
READINGS = {PWC: (CALCULATED, APPLIED), PAPWC: (SMALL, LARGE)}
"""By controller; the printed one first."""

Key = tuple[str, str, float | None]
"""Controller, reading, and t_p,max [s] or None."""

COVARIANCE = {SMALL: 1e-5, LARGE: 1e5}
"""P(0) over the unit matrix, by reading [of the recursion]."""
_REST = RestDetection(samples=1, spread=0.0, speed=0.0)


def pwc(
    *,
    longest_width: float | None,
    regressor: Literal["nominal", "applied"] = "nominal",
    sampling_time: float = SAMPLING_TIME,
    start_error: float = START_ERROR,
) -> PulseWidthController:
    """Return pulse width control with F(0) = 1e5, which never gives up.

    ``longest_width`` is t_p,max [s], None for none.
    """
    controller = PulseWidthController.from_friction(
        mass=MASS,
        coulomb_friction=GUESS * COULOMB_FRICTION,
        pulse_effort=PULSE_EFFORT,
        sampling_time=sampling_time,
        target=start_error,
        tolerance=TOLERANCE,
        rest=_REST,
    )
    return replace(
        controller, longest_width=longest_width, max_idle_pulses=None, regressor=regressor
    )


def papwc(
    *,
    longest_width: float | None,
    covariance: float = 1e-5,
    sampling_time: float = SAMPLING_TIME,
    tolerance: float = TOLERANCE,
    guess: float = GUESS,
) -> PulseAmplitudeWidthController:
    """Return pulse amplitude and width control, which never gives up.

    ``longest_width`` is t_p,max [s], None for none; ``covariance`` is P(0) over the unit matrix,
    ``guess`` the first guess of the Coulomb friction over the true one [-].
    """
    controller = PulseAmplitudeWidthController.from_friction(
        mass=MASS,
        coulomb_friction=guess * COULOMB_FRICTION,
        pulse_effort=PULSE_EFFORT,
        sampling_time=sampling_time,
        target=START_ERROR,
        tolerance=tolerance,
        rest=_REST,
    )
    return replace(
        controller,
        longest_width=longest_width,
        max_idle_pulses=None,
        initial_covariance=covariance,
    )


@dataclass(frozen=True, kw_only=True)
class Case:
    """One of the simulations of section 4."""

    controller: str  #: `PWC` or `PAPWC`.
    reading: str  #: One of its `READINGS`.
    longest_width: float | None  #: T_p,max [s]; None for none.

    @property
    def key(self) -> Key:
        """All three."""
        return self.controller, self.reading, self.longest_width

    def first(self) -> PulseController:
        """Return the controller of the first run."""
        if self.controller == PWC:
            nominal = self.reading == CALCULATED
            return pwc(
                longest_width=self.longest_width, regressor="nominal" if nominal else "applied"
            )
        return papwc(longest_width=self.longest_width, covariance=COVARIANCE[self.reading])


CASES = tuple(
    Case(controller=controller, reading=reading, longest_width=longest_width)
    for controller, readings in READINGS.items()
    for reading in readings
    for longest_width in (UNBOUNDED, BOUNDED)
)
