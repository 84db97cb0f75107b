"""The most informative effort within the limits of an axis, and its file for a drive."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from stickslip import __version__
from stickslip.outputs import whole_file
from stickslip.records import (
    AxisKind,
    Excitation,
    ExpectedParameter,
    InputError,
    mass_name,
    positive,
    quantity_name,
    unit_of,
    whole,
)
from stickslip.scenario import AXES, estimate_in, table_from
from stickslip.simulation import Sensors

if TYPE_CHECKING:
    from stickslip.estimation import InputLimits

_MOST_SAMPLES = 200_000  # of an input: a design tries some hundred inputs, which takes minutes


def excite(
    first_guess: Mapping[str, float],
    *,
    kind: AxisKind | None = None,
    estimate: Path | str | None = None,
    duration: float,
    sampling_time: float,
    effort_limit: float,
    speed_limit: float | None = None,
    travel_limit: float | None = None,
    position_noise: float = 0.0,
    encoder_step: float = 0.0,
    velocity_noise: float | None = None,
    seed: int = 1,
) -> Excitation:
    """Design an effort that determines the parameters of an axis as well as its limits allow.

    Parameters
    ----------
    first_guess
        First guesses of the parameters by name [SI]: ``inertia`` (or mass), friction of both
        directions or of each, ``offset``, and ``load_inertia`` and ``stiffness`` of an arm. Rough
        values are enough.
    kind
        ``"linear"`` or ``"rotary"``; None takes that of the estimate, or linear.
    estimate
        File that ``stickslip identify --json`` wrote; ``first_guess`` takes precedence over it.
    duration, sampling_time
        Of the effort [s].
    effort_limit, speed_limit, travel_limit
        Largest effort and speed, and largest distance from the start [N or N m, m/s or rad/s, m or
        rad]; None for no limit.
    position_noise, encoder_step
        Of the position sensors: standard deviation and step [m or rad].
    velocity_noise
        Standard deviation of measured velocities [m/s or rad/s]; None if none is measured.
    seed
        Seed of the inputs at the start of the search.

    Returns
    -------
    The effort, and the smallest intervals to expect.

    Raises
    ------
    InputError
        If the axis is not described, a value is out of its range, or no input within the limits
        separates the parameters.
    """
    from stickslip.estimation import InputLimits, design_input

    samples = positive("duration", duration, "s") / positive("sampling_time", sampling_time, "s")
    if samples > _MOST_SAMPLES:
        raise InputError(
            "input_too_long",
            duration=duration,
            samples=samples,
            sampling_time=sampling_time,
            most=_MOST_SAMPLES,
        )
    whole("seed", seed)
    file = None if estimate is None else Path(estimate)
    if kind is None:
        kind = "linear" if file is None else _kind_in(file)
    values: dict[str, Any] = {
        name.replace("inertia", "mass") if kind == "linear" else name: value
        for name, value in first_guess.items()
    }
    if file is not None:
        values = _from_estimate(file, kind, values) | values
    try:
        limits = InputLimits(effort=effort_limit, speed=speed_limit, travel=travel_limit)
        sensors = Sensors(
            position_noise=position_noise,
            encoder_step=encoder_step,
            velocity="none" if velocity_noise is None else "measured",
            velocity_noise=velocity_noise or 0.0,
        )
        plant = table_from(AXES, {"kind": kind, **values}, name="", kind=kind).build()
        designed = design_input(
            plant,
            duration=duration,
            sampling_time=sampling_time,
            sensors=sensors,
            limits=limits,
            generator=np.random.default_rng(seed),
        )
    except InputError as error:
        raise error.on(kind) from None
    bound = designed.bound
    options: dict[str, tuple[float | str, str]] = {
        name: (value, unit_of(name.removeprefix("load_"), kind)) for name, value in values.items()
    }
    if file is not None:
        options["estimate"] = (file.name, "")
    options |= _shown(limits, sensors, kind) | {"seed": (float(seed), "")}
    return Excitation(
        kind=kind,
        sampling_time=sampling_time,
        effort=designed.effort,
        expected={
            name: ExpectedParameter(first_guess=_first_guess(name, values), std=bound.std[name])
            for name in bound.names
        },
        largest_speed=designed.largest_speed,
        largest_travel=designed.largest_travel,
        options=options,
        stickslip_version=__version__,
    )


def _shown(limits: "InputLimits", sensors: Sensors, kind: AxisKind) -> dict[str, tuple[float, str]]:
    """Return the limits and noises that are given, with their units."""
    given = {
        "effort_limit": (limits.effort, "effort"),
        "speed_limit": (limits.speed, "velocity"),
        "travel_limit": (limits.travel, "position"),
        "position_noise": (sensors.position_noise, "position"),
        "encoder_step": (sensors.encoder_step, "position"),
        "velocity_noise": (sensors.velocity_noise, "velocity"),
    }
    return {name: (value, unit_of(unit, kind)) for name, (value, unit) in given.items() if value}


def _first_guess(name: str, values: Mapping[str, float]) -> float:
    """Return the given value of a parameter, or that of friction in both directions."""
    both = quantity_name(name)
    return values.get(name, values.get(both, values.get(f"{both}_positive", 0.0)))


def _kind_in(path: Path) -> AxisKind:
    """Return the kind of axis of an estimate; errors of the file are found later."""
    try:
        document = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return "linear"
    return "rotary" if isinstance(document, dict) and document.get("kind") == "rotary" else "linear"


def _from_estimate(path: Path, kind: AxisKind, given: Mapping[str, float]) -> dict[str, float]:
    """Return the values of an estimate that are not given, by the names of ``[axis]``."""
    held = estimate_in(path, kind)
    known = {quantity_name(name) for name in given}
    known |= {"mass"} if "inertia" in given else set[str]()
    for name, error in held.missing.items():
        if name not in known and name != "static_friction":
            raise error
    values: dict[str, float] = {}
    for name, (forward, backward) in held.values.items():
        if name in known:
            continue
        if name == "mass":
            values[mass_name(kind)] = forward
        elif forward == backward or name == "offset":
            values[name] = forward
        else:
            values[f"{name}_positive"], values[f"{name}_negative"] = forward, backward
    return values


def write_effort(
    effort: Float[np.ndarray, " n"], sampling_time: float, path: Path | str, *, kind: AxisKind
) -> Path:
    """Write an effort with its time stamps; the file appears when it is complete.

    Parameters
    ----------
    effort
        Held over each sample [N or N m].
    sampling_time
        [s].
    path
        The file to write; an existing one is replaced.
    kind
        ``"linear"`` or ``"rotary"``, for the unit in the heading.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    target = Path(path)
    with whole_file(target, what="the CSV file") as stream:
        stream.write(f"time [s],effort [{unit_of('effort', kind)}]\n")
        for k, value in enumerate(effort.tolist()):
            stream.write(f"{k * sampling_time:.9g},{value:.9g}\n")
    return target
