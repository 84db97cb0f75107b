"""``[controller]`` of PD and PID control: methods pd, pid, pid-dither and pid-reset."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import model_validator

from stickslip.control import Dither, PIDController, ResetIntegral
from stickslip.records import InputError, non_negative, positive
from stickslip.scenario.controller import Controller, PositionGain, VelocityGain
from stickslip.scenario.guess import Beliefs
from stickslip.scenario.setup import Setup
from stickslip.scenario.table import Key

__all__ = ["PDControl", "PIDControl", "PIDDither", "PIDReset"]

_INTEGRAL = ("N/(m s)", "N m/(rad s)")
_HERTZ = ("Hz", "Hz")

IntegralGain = Annotated[float | None, Key("integral gain", _INTEGRAL, non_negative)]
FilterTime = Annotated[
    float | None,
    Key("differentiates the position", "time", non_negative, default="the velocity is measured"),
]


class _Feedback(Controller):
    """Gains that act on the error, and on a velocity, measured or differentiated."""

    def _gains(self) -> dict[str, float]:
        names = ("position_gain", "integral_gain", "velocity_gain")
        return {name: getattr(self, name) for name in names if name in self.given()}

    def _parts(self) -> dict[str, Any]:
        """Return what acts beside the gains."""
        return {}

    def build(self, setup: Setup, beliefs: Beliefs) -> PIDController:
        """Return the controller, as of the base class."""
        del beliefs
        filter_time: float | None = getattr(self, "filter_time", None)
        if filter_time is None and setup.sensors.velocity == "none":
            raise InputError(
                "the gains act on a velocity, and none is measured",
                where="[controller]",
                remedy="give filter_time in s, so that the position is differentiated",
            )
        return PIDController(
            sampling_time=setup.task.sampling_time,
            target=setup.task.goals[0],
            effort_limit=self.effort_limit,
            velocity="measured" if filter_time is None else "differentiated",
            filter_time=filter_time or 0.0,
            **{"integral_gain": 0.0, **self._gains()},
            **self._parts(),
        )


class PDControl(_Feedback):
    """PD control."""

    title: ClassVar[str] = "PD control"
    position_gain: Annotated[float, Key("proportional gain", ("N/m", "N m/rad"), positive)]
    velocity_gain: Annotated[float, Key("derivative gain", ("N s/m", "N m s/rad"), non_negative)]
    filter_time: FilterTime = None


class PIDControl(_Feedback):
    """PID control, with gains of its own or by the bandwidth."""

    title: ClassVar[str] = "PID control"
    position_gain: PositionGain = None
    integral_gain: IntegralGain = None
    velocity_gain: VelocityGain = None
    filter_time: FilterTime = None
    bandwidth: Annotated[
        float | None,
        Key("in place of the gains, with `mass` in `[guess]`", _HERTZ, positive),
    ] = None
    dead_band: Annotated[
        float, Key("error within which the integral stands still", "position", non_negative)
    ] = 0.0

    @model_validator(mode="after")
    def _check_gains(self) -> "PIDControl":
        given = [*self._gains(), *(["filter_time"] if self.filter_time is not None else [])]
        if self.bandwidth is not None and given:
            raise InputError(
                f"bandwidth and {', '.join(given)} are both given",
                remedy="keep bandwidth, which gives all gains, or the gains themselves",
            )
        for name in ("position_gain", "velocity_gain", "integral_gain"):
            if self.bandwidth is None and name not in given:
                raise InputError(f"{name} is missing", remedy="give it, or bandwidth and the mass")
        return self

    def used(self) -> tuple[str, ...]:
        """Return the mass, if the bandwidth gives the gains."""
        return () if self.bandwidth is None else ("mass", "estimate")

    def _parts(self) -> dict[str, Any]:
        return {"dead_band": self.dead_band}

    def build(self, setup: Setup, beliefs: Beliefs) -> PIDController:
        """Return the controller, as of the base class."""
        if self.bandwidth is None:
            return super().build(setup, beliefs)
        return PIDController.for_mass(
            sampling_time=setup.task.sampling_time,
            target=setup.task.goals[0],
            mass=beliefs.mass(),
            bandwidth=self.bandwidth,
            effort_limit=self.effort_limit,
            **self._parts(),
        )


class PIDDither(PIDControl):
    """PID control with dither."""

    title: ClassVar[str] = "PID control with dither"
    dither_amplitude: Annotated[float, Key("peak of the dither", "effort", positive)]
    dither_frequency: Annotated[float, Key("frequency of the dither", _HERTZ, positive)]
    dither_shape: Annotated[Literal["square", "sine"], Key("wave of the dither")] = "square"

    def _parts(self) -> dict[str, Any]:
        dither = Dither(
            amplitude=self.dither_amplitude,
            frequency=self.dither_frequency,
            shape=self.dither_shape,
        )
        return {**super()._parts(), "dither": dither}


class PIDReset(PIDControl):
    """PID control with resets of its integral."""

    title: ClassVar[str] = "PID control with resets of the integral"
    reset_law: Annotated[Literal["coulomb", "stribeck"], Key("when the integral is reset")]
    reset_speed: Annotated[float, Key("largest speed taken for rest", "velocity", positive)]
    reset_samples: Annotated[int, Key("samples within that speed that are a rest")] = 1

    def _parts(self) -> dict[str, Any]:
        reset = ResetIntegral(
            law=self.reset_law, rest_speed=self.reset_speed, rest_samples=self.reset_samples
        )
        return {**super()._parts(), "reset": reset}
