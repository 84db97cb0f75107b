"""``[controller]`` of servos: methods profile, pd, pid, pid-dither and pid-reset."""

from dataclasses import replace
from typing import Any, Literal

from pydantic import model_validator

from stickslip.control import Dither, PIDController, ProfileController, ResetIntegral
from stickslip.records import InputError, non_negative, positive
from stickslip.scenario.controllers.base import Controller, Setup
from stickslip.scenario.guess import AXIS_GUESSES, FirstGuesses
from stickslip.scenario.table import ScenarioError, key, kind_in, required

_STIFFNESS, _INTEGRAL = ("N/m", "N m/rad"), ("N/(m s)", "N m/(rad s)")
_DAMPING = ("N s/m", "N m s/rad")
_OTHERWISE = "required without `bandwidth`"
_HERTZ = ("Hz", "Hz")

_SURELY = 6.0  # standard deviations between two positions of an axis at rest, of each sample

_FILTER_TIME: Any = key(
    "differentiates the position", "time", non_negative, says="the velocity is measured"
)


class Profile(Controller):
    """A servo along a profile, with feedforward, PID, and dither where it sticks."""

    title = "servo along a profile with limited jerk, and feedforward of friction"
    guesses = (*AXIS_GUESSES, "estimate")
    speed_limit: float | None = key(
        "largest speed of the profile", "velocity", positive, says="no limit"
    )
    delay: float = key("known delay of drive and sensors", "time", non_negative, default=0.0)
    dither: bool = key("whether an axis that sticks outside the tolerance is shaken", default=True)
    reset_factor: float = key(
        "share of the feedback's force left, reversed, after a stop beyond the target",
        check=non_negative,
        default=0.0,
    )

    def build(self, setup: Setup, first: FirstGuesses) -> ProfileController:
        sensors = setup.sensors
        return ProfileController(
            sampling_time=setup.task.sampling_time,
            target=setup.task.all_targets[0],
            tolerance=setup.task.tolerance,
            mass=first.mass(),
            friction=first.friction(default=False),
            effort_limit=self.effort_limit,
            speed_limit=self.speed_limit,
            delay=self.delay,
            position_noise=_SURELY * sensors.position_noise + sensors.encoder_step,
            velocity_measured=sensors.velocity == "measured",
            dither=self.dither,
            reset_factor=self.reset_factor,
        )


class _Feedback(Controller):
    """Gains that act on the error, and on a velocity, measured or differentiated."""

    def _gains(self) -> dict[str, float]:
        names = ("position_gain", "integral_gain", "velocity_gain")
        return {name: getattr(self, name) for name in names if name in self.given()}

    def _parts(self) -> dict[str, Any]:
        """Return the settings beside the gains."""
        return {}

    def build(self, setup: Setup, first: FirstGuesses) -> PIDController:
        filter_time: float | None = getattr(self, "filter_time", None)
        if filter_time is None and setup.sensors.velocity == "none":
            raise ScenarioError("gains_without_velocity", where="[controller]")
        return PIDController(
            sampling_time=setup.task.sampling_time,
            target=setup.task.all_targets[0],
            effort_limit=self.effort_limit,
            velocity="measured" if filter_time is None else "differentiated",
            filter_time=filter_time or 0.0,
            **{"integral_gain": 0.0, **self._gains()},
            **self._parts(),
        )


class PDControl(_Feedback):
    """PD control."""

    title = "PD control"
    position_gain: float = required("proportional gain", _STIFFNESS, positive)
    velocity_gain: float = required("derivative gain", _DAMPING, non_negative)
    filter_time: float | None = _FILTER_TIME


class PIDControl(_Feedback):
    """PID control, with gains of its own or by the bandwidth."""

    title = "PID control"
    position_gain: float | None = key("proportional gain", _STIFFNESS, positive, says=_OTHERWISE)
    integral_gain: float | None = key("integral gain", _INTEGRAL, non_negative, says=_OTHERWISE)
    velocity_gain: float | None = key("derivative gain", _DAMPING, non_negative, says=_OTHERWISE)
    filter_time: float | None = _FILTER_TIME
    bandwidth: float | None = key(
        "in place of the gains, with `mass` in `[guess]`", _HERTZ, positive
    )
    dead_band: float = key(
        "error within which the integral stands still", "position", non_negative, default=0.0
    )

    @model_validator(mode="after")
    def _check_gains(self, info: Any) -> "PIDControl":
        given = [*self._gains(), *(["filter_time"] if self.filter_time is not None else [])]
        if self.bandwidth is not None and given:
            raise InputError("bandwidth_and_gains", names=given)
        for name in ("position_gain", "velocity_gain", "integral_gain"):
            if self.bandwidth is None and name not in given:
                raise InputError(
                    "missing_key",
                    name=name,
                    unit=self.declared()[name].unit_on(kind_in(info)),
                    tag="method",
                    tag_value=self.method,
                    particular=True,
                    alternative="bandwidth",
                )
        return self

    def used(self) -> tuple[str, ...]:
        return () if self.bandwidth is None else ("mass", "estimate")

    def _parts(self) -> dict[str, Any]:
        return {"dead_band": self.dead_band}

    def build(self, setup: Setup, first: FirstGuesses) -> PIDController:
        if self.bandwidth is None:
            return super().build(setup, first)
        shaped = PIDController.for_mass(
            sampling_time=setup.task.sampling_time,
            target=setup.task.all_targets[0],
            mass=first.mass(),
            bandwidth=self.bandwidth,
            effort_limit=self.effort_limit,
        )
        return replace(shaped, **self._parts())


class PIDDither(PIDControl):
    """PID control with dither."""

    title = "PID control with dither"
    dither_amplitude: float = required("peak of the dither", "effort", positive)
    dither_frequency: float = required("frequency of the dither", _HERTZ, positive)
    dither_shape: Literal["square", "sine"] = key("wave of the dither", default="square")

    def _parts(self) -> dict[str, Any]:
        dither = Dither(
            amplitude=self.dither_amplitude,
            frequency=self.dither_frequency,
            shape=self.dither_shape,
        )
        return {**super()._parts(), "dither": dither}


class PIDReset(PIDControl):
    """PID control with resets of its integral."""

    title = "PID control with resets of the integral"
    reset_law: Literal["coulomb", "stribeck"] = required("when the integral is reset")
    reset_speed: float = required("largest speed taken for rest", "velocity", positive)
    reset_samples: int = key("samples within that speed that are a rest", default=1)

    def _parts(self) -> dict[str, Any]:
        reset = ResetIntegral(
            law=self.reset_law, rest_speed=self.reset_speed, rest_samples=self.reset_samples
        )
        return {**super()._parts(), "reset": reset}
