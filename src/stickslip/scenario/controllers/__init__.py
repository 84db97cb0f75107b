"""Controllers of a scenario: one table a family of methods, and their registry.

``docs/contributing.md`` has the steps to add one.
"""

from collections.abc import Mapping

from stickslip.scenario.controllers.base import Controller
from stickslip.scenario.controllers.flexible_arm import ArmFeedback, ArmLanding, ArmTracked
from stickslip.scenario.controllers.pid import PDControl, PIDControl, PIDDither, PIDReset, Profile
from stickslip.scenario.controllers.pulses import (
    AxisLanding,
    ExactPulses,
    Precise,
    PulseAmplitudeWidth,
    PulseWidth,
)
from stickslip.scenario.table import Variants

__all__ = ["ARM_CONTROLLERS", "AXIS_CONTROLLERS"]

_AXIS: Mapping[str, type[Controller]] = {
    "precise": Precise,
    "landing": AxisLanding,
    "exact": ExactPulses,
    "papwc": PulseAmplitudeWidth,
    "pwc": PulseWidth,
    "profile": Profile,
    "pd": PDControl,
    "pid": PIDControl,
    "pid-dither": PIDDither,
    "pid-reset": PIDReset,
}
_ARM: Mapping[str, type[Controller]] = {
    "tracked": ArmTracked,
    "landing": ArmLanding,
    "feedback": ArmFeedback,
}

AXIS_CONTROLLERS: Variants[Controller] = Variants(
    key="method", default="precise", models=_AXIS, where="a rigid axis", others=_ARM
)
ARM_CONTROLLERS: Variants[Controller] = Variants(
    key="method", default="tracked", models=_ARM, where="a flexible arm", others=_AXIS
)
