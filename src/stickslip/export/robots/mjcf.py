"""Joint friction in MJCF, the format of MuJoCo, edited as text."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stickslip.export.base import (
    IN_A_JOINT,
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Rendered,
    prefix,
)
from stickslip.export.parameters import ExportParameters
from stickslip.export.robots.joints import PresentValues, armature, check_kind, edited_file
from stickslip.export.robots.xml_text import Edit, Element, XmlText, attribute
from stickslip.export.templates import heading, notes_on, number
from stickslip.records import InputError, mass_name, positive

_KINDS = {"hinge": "rotary", "slide": "linear"}
_TIME_STEP = 0.002  # MuJoCo's default [s]
_IMPEDANCE = "0.9999 0.9999 0.001 0.5 2"
_IMPEDANCE_AT_REST = 0.9999  # the largest that MuJoCo allows
_FIT_POINTS = 400  # speeds to which a polynomial is fitted
_LUGRE = re.compile(rb"""\blugre\s*=\s*["']([^"']*)""")
_PLACES = ("body", "frame", "replicate")

# Bristles of the LuGre friction, over the inertia J and the time step h: stiffness 0.04 J/h^2 (31
# steps a period) and damping 0.2 J/h (half of the critical one). They stay stable if the model's
# inertia is a tenth of that identified. Stiffer ones would bend less; more damped ones would brake
# a joint whose velocity jumps, in a collision, by the same share of its momentum.
_STIFFNESS = 0.04
_DAMPING = 0.2


@dataclass(frozen=True, kw_only=True)
class MjcfExporter(Exporter):
    """``damping``, ``frictionloss`` and ``armature`` of a joint, or passive LuGre friction.

    MuJoCo's dry friction is a soft constraint: with its defaults a joint creeps under a load far
    below the friction. ``solreffriction`` is set to twice the time step, the fastest that MuJoCo
    accepts, and ``solimpfriction`` to a nearly rigid constraint. Quadratic friction is the second
    coefficient of ``damping`` (MuJoCo 3.7 and later), friction with the 2/3 power of the speed a
    polynomial up to a given speed. Static friction above the Coulomb friction is
    a passive ``<dcmotor input="none" lugre=...>`` (MuJoCo 3.12 and later). ``damping`` and
    ``frictionloss`` are in SI units also in a model with ``<compiler angle="degree"/>``.

    Source: https://mujoco.readthedocs.io/en/stable/XMLreference.html (joint, dcmotor, compiler) and
    https://mujoco.readthedocs.io/en/stable/modeling.html (solver parameters).
    """

    name: str = "mjcf"
    title: str = "MJCF (MuJoCo)"
    represents: tuple[str, ...] = (
        "viscous_friction",
        "coulomb_friction",
        "quadratic_friction",
        "two_thirds_friction",
        "static_friction",
        "stribeck_velocity",
    )
    cannot: Mapping[str, str] = field(default_factory=lambda: IN_A_JOINT)
    ending: str = ".xml"
    edits: Literal["never", "always"] = "always"
    options: tuple[str, ...] = ("link_inertia", "sampling_time", "top_speed")

    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return the edited file; see `Exporter.render`."""
        text = XmlText(edited_file(into, self.title).content, "MJCF")
        includes = [each.attributes.get("file", "") for each in text.elements("include")]
        hint = f", which may be one of those included ({', '.join(includes)})" if includes else ""
        joints = [
            each
            for each in text.elements("joint")
            if each.parent is not None and each.parent.tag in _PLACES
        ]
        defaults = _Defaults(text.root)
        time_step, assumed = _time_step(text, settings, included=bool(includes))
        edits: list[Edit] = []
        present = PresentValues()
        motors: dict[str, bytes | None] = {}
        notes: list[str] = [*notes_on(self, axes), *assumed]
        for name, parameters in axes.items():
            joint = text.joint(name, joints, hint)
            inherited = defaults.of(joint)
            check_kind(
                name, (inherited | joint.attributes).get("type", "hinge"), _KINDS, parameters
            )
            values, motor, own = _values(name, parameters, settings, time_step)
            overridden = [
                f"{key} {inherited[key]}"
                for key in values
                if key in inherited and key not in joint.attributes
            ]
            if overridden:
                own.append(f"Joint {name} no longer has {', '.join(overridden)} of its class")
            present.add(name, joint.attributes, values)
            if "frictionloss" in values:
                motors[name] = motor
            one = {name: parameters}
            remark = heading(self, one, (*notes_on(self, one), *assumed, *own))
            edits += text.insert_before(joint, text.comment(remark, text.indent(joint)))
            edits += text.set_attributes(joint, values)
            notes += [prefix(name, axes) + each for each in own]
        edits += _motor_edits(text, motors, present)
        present.check(overwrite=settings.overwrite)
        return Rendered(files={"": text.edited(edits)}, notes=tuple(notes))


class _Defaults:
    """Attributes of joints by default classes."""

    def __init__(self, root: Element) -> None:
        self.classes: dict[str, dict[str, str]] = {}
        for child in root.children:
            if child.tag == "default":
                self._read(child, {}, top=True)

    def _read(self, element: Element, inherited: Mapping[str, str], *, top: bool = False) -> None:
        own = dict(inherited)
        for child in element.children:
            if child.tag == "joint":
                own |= child.attributes
        self.classes[element.attributes.get("class", "main" if top else "")] = own
        for child in element.children:
            if child.tag == "default":
                self._read(child, own)

    def of(self, joint: Element) -> dict[str, str]:
        """Return the attributes that a joint has from its class."""
        around = (each.attributes.get("childclass") for each in joint.ancestors())
        name = joint.attributes.get("class") or next(filter(None, around), "main")
        return self.classes.get(name, {})


def _time_step(
    text: XmlText, settings: ExportSettings, *, included: bool
) -> tuple[float, tuple[str, ...]]:
    """Return the time step of the model [s], and what was assumed about it."""
    if settings.sampling_time is not None:
        return positive("sampling_time", settings.sampling_time, "s"), ()
    stated = [
        each.attributes["timestep"]
        for each in text.elements("option")
        if "timestep" in each.attributes
    ]
    if stated:
        try:
            time_step = float(stated[-1])
        except ValueError:
            raise InputError("not_a_number", name="timestep", value=stated[-1], unit="s") from None
        return positive("timestep", time_step, "s"), ()
    if not included:
        return _TIME_STEP, ()
    return _TIME_STEP, (
        f"solreffriction is for a time step of {_TIME_STEP:g} s, MuJoCo's default, as this file "
        "states none; sampling-time is the option for another",
    )


def _values(
    name: str, parameters: ExportParameters, settings: ExportSettings, time_step: float
) -> tuple[dict[str, str], bytes | None, list[str]]:
    """Return the attributes of a joint, its actuator of LuGre friction, and what to say of them."""
    values: dict[str, str] = {}
    notes: list[str] = []
    damping, remark = _damping(parameters, settings)
    notes += remark
    if damping:
        values["damping"] = " ".join(map(number, damping))
    inertia, remark = armature(parameters, settings)
    notes += remark
    if inertia is not None:
        values["armature"] = number(inertia)
    coulomb = parameters.mean("coulomb_friction")
    if coulomb is None:
        return values, None, notes
    motor, remark = _lugre(name, parameters, coulomb, time_step)
    notes += remark
    # The bristles of the actuator hold the Coulomb friction too
    values["frictionloss"] = number(0.0 if motor is not None else coulomb)
    if motor is None:
        if parameters.inertia:
            # (1 - d) a/b with the impedance d, the acceleration a without friction and b = 1/h
            creep = (1.0 - _IMPEDANCE_AT_REST) * time_step * coulomb / parameters.inertia
            notes.append(
                f"A joint that friction holds creeps by up to {creep:.2g} "
                f"{parameters.unit('velocity')}; MuJoCo allows no stiffer constraint, and a "
                "smaller time step creeps less"
            )
        values["solreffriction"] = f"{number(2.0 * time_step)} 1"
        values["solimpfriction"] = _IMPEDANCE
    return values, motor, notes


def _damping(
    parameters: ExportParameters, settings: ExportSettings
) -> tuple[list[float], list[str]]:
    """Return the coefficients of ``damping`` for v, v |v| and v^3, and what to say of them."""
    viscous, quadratic, two_thirds = (
        parameters.mean(f"{name}_friction") for name in ("viscous", "quadratic", "two_thirds")
    )
    notes: list[str] = []
    fitted = np.zeros(3)
    if two_thirds and settings.top_speed is None:
        notes.append(
            "Friction with the 2/3 power of the speed is left out; top-speed is the option for a "
            "polynomial up to that speed"
        )
    elif two_thirds and settings.top_speed is not None:
        top = positive("top_speed", settings.top_speed, parameters.unit("velocity"))
        speed = np.linspace(0.0, top, _FIT_POINTS)
        powers = np.stack([speed, speed**2, speed**3], axis=1)
        law = two_thirds * speed ** (2.0 / 3.0)
        # In powers of the relative speed, which are of one size
        scale = top ** np.arange(1.0, 4.0)
        fitted = np.linalg.lstsq(powers / scale, law, rcond=None)[0] / scale
        error = float(np.max(np.abs(powers @ fitted - law)))
        notes.append(
            f"Largest deviation of the polynomial of friction up to {top:g} "
            f"{parameters.unit('velocity')}: {error:.2g} {parameters.unit('effort')}"
        )
    if viscous is None and not quadratic and not fitted.any():
        return [], notes
    polynomial = fitted + np.array([viscous or 0.0, quadratic or 0.0, 0.0])
    return polynomial.tolist() if polynomial[1:].any() else polynomial[:1].tolist(), notes


def _lugre(
    name: str, parameters: ExportParameters, coulomb: float, time_step: float
) -> tuple[bytes | None, list[str]]:
    """Return the actuator of static friction above the Coulomb friction, if the law has that."""
    static = parameters.mean("static_friction")
    speed = parameters.mean("stribeck_velocity")
    if static is None or static <= coulomb:
        return None, []
    inertia = parameters.inertia
    missing = mass_name(parameters.kind) if inertia is None else "Stribeck velocity"
    if inertia is None or speed is None:
        return None, [
            f"Static friction {static:.4g} {parameters.unit('static_friction')} is left out, as "
            f"the estimate has no {missing}"
        ]
    stiffness = _STIFFNESS * inertia / time_step**2
    damping = _DAMPING * inertia / time_step
    numbers = " ".join(map(number, (stiffness, damping, coulomb, static, speed)))
    motor = (
        b"<dcmotor name=%b joint=%b " % (attribute(_actuator_name(name)), attribute(name))
        + f'input="none" motorconst="0 0" resistance="1" lugre="{numbers}"/>'.encode()
    )
    bend = f"{static / stiffness:.2g} {parameters.unit('position')}"
    return motor, [
        "Coulomb and static friction are those of the actuator "
        f"{_actuator_name(name)} (MuJoCo 3.12 or later), which adds one activation to the model; "
        f"its bristles bend by {bend} before the joint slips, and a load of nearly the static "
        "friction that is applied at once frees it",
    ]


def _motor_edits(
    text: XmlText, motors: Mapping[str, bytes | None], present: PresentValues
) -> list[Edit]:
    """Return the edits that write the actuator of each joint in place of that of an earlier export.

    The earlier actuator of a joint without a new one is removed, as its friction would act beside
    that of the joint. Actuators that change are added to the present values.
    """
    actuators = next((each for each in text.root.children if each.tag == "actuator"), None)
    edits: list[Edit] = []
    new: list[bytes] = []
    for joint, motor in motors.items():
        name = _actuator_name(joint)
        old = None if actuators is None else next(_named(actuators, name), None)
        if old is None:
            new += [] if motor is None else [motor]
        elif motor is not None or old.attributes.get("lugre"):
            before = text.content[old.start : old.end]
            if before != motor:
                lugre = (None if each is None else _LUGRE.search(each) for each in (before, motor))
                shown = [None if each is None else each[1].decode() for each in lugre]
                key = f"lugre of actuator {name}"
                present.add(joint, {key: shown[0] or old.tag}, {key: shown[1]})
            edits.append(text.replace(old, motor))
    if not new:
        return edits
    if actuators is None:
        lines = [b"<actuator>", *(b"  " + each for each in new), b"</actuator>"]
        return [*edits, *text.insert_child(text.root, lines)]
    return [*edits, *text.insert_child(actuators, new)]


def _actuator_name(joint: str) -> str:
    """Return the name of the actuator that holds the friction of a joint."""
    return f"{joint}_friction"


def _named(actuators: Element, name: str) -> Iterator[Element]:
    return (each for each in actuators.children if each.attributes.get("name") == name)
