import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.logs.unit_spelling import header_unit, is_unit
from stickslip.logs.units import effort_unit, kind_of_unit, scale_to_si
from stickslip.records import InputError

ROUNDING = 4e-16
"""Two roundings of a double: the library may build a factor from two others."""


@pytest.mark.parametrize(
    ("channel", "unit", "kind", "factor"),
    [
        ("time", "ms", "linear", 1e-3),
        ("time", "µs", "linear", 1e-6),
        ("time", "us", "rotary", 1e-6),
        ("time", "sec", "linear", 1.0),
        ("position", "mm", "linear", 1e-3),
        ("position", "um", "linear", 1e-6),
        ("position", "inch", "linear", 0.0254),
        ("load_position", "deg", "rotary", math.pi / 180),
        ("position", "°", "rotary", math.pi / 180),
        ("position", "rev", "rotary", 2 * math.pi),
        ("position", "turn", "rotary", 2 * math.pi),
        ("velocity", "mm/s", "linear", 1e-3),
        ("velocity", "rpm", "rotary", 2 * math.pi / 60),
        ("velocity", "rev/min", "rotary", 2 * math.pi / 60),
        ("velocity", "1/min", "rotary", 2 * math.pi / 60),
        ("load_velocity", "deg/s", "rotary", math.pi / 180),
        ("effort", "kN", "linear", 1e3),
        ("effort", "lbf", "linear", 4.4482216152605),
        ("effort", "Nm", "rotary", 1.0),
        ("effort", "N m", "rotary", 1.0),
        ("effort", "N·m", "rotary", 1.0),
        ("effort", "N.m", "rotary", 1.0),
        ("effort", "mNm", "rotary", 1e-3),
        ("effort", "kgf*m", "rotary", 9.80665),
        ("position", "Degrees", "rotary", math.pi / 180),
        ("position", "rotations", "rotary", 2 * math.pi),
        ("position", "mrad", "rotary", 1e-3),
        ("position", "rads", "rotary", 1.0),
        ("velocity", "krpm", "rotary", 1e3 * 2 * math.pi / 60),
        ("velocity", "min-1", "rotary", 2 * math.pi / 60),
        ("velocity", "U/min", "rotary", 2 * math.pi / 60),
        ("velocity", "rotations_per_second", "rotary", 2 * math.pi),
        ("velocity", "meters_per_second", "linear", 1.0),
        ("effort", "N.mm", "rotary", 1e-3),
        ("effort", "Nmm", "rotary", 1e-3),
        ("effort", "mN.m", "rotary", 1e-3),
        ("effort", "oz-in", "rotary", 0.028349523125 * 9.80665 * 0.0254),
        ("effort", "in-lb", "rotary", 0.45359237 * 9.80665 * 0.0254),
        ("effort", "ft-lb", "rotary", 0.45359237 * 9.80665 * 0.3048),
        ("effort", "lb_in", "rotary", 0.45359237 * 9.80665 * 0.0254),
        ("effort", "kg-cm", "rotary", 0.0980665),
        ("effort", "Newton-meters", "rotary", 1.0),
        ("effort", "milliamps", "rotary", 1e-3),
        ("effort", "amps", "rotary", 1.0),
        ("effort", "A_rms", "rotary", 1.0),
        ("effort", "pct", "rotary", 1.0),
        ("effort", "0.1 Nm", "rotary", 0.1),
        ("effort", "0.1%", "rotary", 0.1),
        ("position", "0.001 deg", "rotary", 1e-3 * math.pi / 180),
        ("position", "1/4096 rev", "rotary", 2 * math.pi / 4096),
        ("velocity", "rad.s-1", "rotary", 1.0),
        ("velocity", "m s⁻¹", "linear", 1.0),
    ],
)
def test_factors_to_si(channel, unit, kind, factor):
    assert scale_to_si(channel, unit, kind) == pytest.approx(factor, rel=ROUNDING)


@pytest.mark.parametrize(
    ("channel", "unit", "kind", "named"),
    [
        ("position", "N", "linear", ("N", "m")),
        ("position", "deg", "linear", ("deg", "m")),
        ("position", "mm", "rotary", ("mm", "rad")),
        ("position", "%", "rotary", ("%", "rad")),
        ("velocity", "Hz", "rotary", ("Hz", "rad/s")),
        ("velocity", "m/s^2", "linear", ("m/s^2", "m/s")),
        ("effort", "N", "rotary", ("N", "N m")),
        ("effort", "V", "linear", ("V", "N")),
        ("time", "mm", "linear", ("mm", "s")),
        ("effort", "nm", "rotary", ("nm", "N m")),
    ],
)
def test_a_unit_of_another_dimension_is_named_with_the_right_one(channel, unit, kind, named):
    with pytest.raises(InputError) as caught:
        scale_to_si(channel, unit, kind)
    assert f"is in {named[0]}," in caught.value.what
    assert caught.value.what.endswith(f" {named[1]}")


@pytest.mark.parametrize(("channel", "unit"), [("position", "cnt"), ("velocity", "inc/s")])
def test_encoder_counts_are_refused_with_a_unit_that_states_them(channel, unit):
    with refuses("encoder_counts", name=channel, unit=unit) as caught:
        kind_of_unit(channel, unit)
    assert kind_of_unit(channel, caught.value.quantities["example"]) == "rotary"


def test_an_effort_in_counts_is_no_encoder():
    with refuses("other_quantity", name="effort", unit="counts"):
        kind_of_unit("effort", "counts")


def test_an_effort_may_be_a_current_or_a_percentage():
    for kind in ("linear", "rotary"):
        assert scale_to_si("effort", "mA", kind) == 1e-3
        assert scale_to_si("effort", "%", kind) == 1.0
        assert scale_to_si("effort", "‰", kind) == 0.1
    assert kind_of_unit("effort", "mA") is None
    assert [effort_unit(each) for each in ("mA", "amps", "pct", "N", "mNm", "V")] == [
        "A", "A", "%", "", "", ""
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("channel", "unit", "kind"),
    [
        ("position", "mm", "linear"),
        ("velocity", "rpm", "rotary"),
        ("effort", "Nm", "rotary"),
        ("time", "ms", None),
    ],
)
def test_kind_of_unit(channel, unit, kind):
    assert kind_of_unit(channel, unit) == kind


@given(st.one_of(st.text(max_size=12), st.text("msNrad/*^°()- 0123456789", max_size=8)))
def test_any_text_is_a_unit_or_refused(text):
    with suppress(InputError):  # any other error passes
        kind_of_unit("position", text)


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("position [mm]", "position", "mm"),
        ("vel (rad/s)", "vel", "rad/s"),
        ("Torque(N m)", "Torque", "N m"),
        ("position (filtered)", "position (filtered)", None),
        ("x [wibble]", "x", "wibble"),
        ("x []", "x", None),
        ("time_ms", "time_ms", "ms"),
        ("vel_rad_s", "vel_rad_s", "rad_s"),
        ("q_m", "q_m", None),
        ("Position (deg) act", "Position act", "deg"),
        ("Speed / rpm", "Speed", "rpm"),
        ("t/s", "t", "s"),
        ("v/(mm/s)", "v", "mm/s"),
        ("vel in deg/sec", "vel", "deg/sec"),
        ("Torque, N m", "Torque", "N m"),
        ("position_degrees", "position_degrees", "degrees"),
        ("velocity_meters_per_second", "velocity_meters_per_second", "meters_per_second"),
        ("torque_nm", "torque_nm", "Nm"),
        ("current_ma", "current_ma", "mA"),
        ("posDeg", "posDeg", "Deg"),
        ("timeMs", "timeMs", "ms"),
        ("Speed rpm", "Speed rpm", "rpm"),
        ("pos_min", "pos_min", None),
        ("Status", "Status", None),
        ("q_d[0]", "q_d[0]", None),
        ("t_s", "t_s", "s"),
        ("angle (measured, rad)", "angle", "rad"),
        ("torque (Nm, filtered)", "torque", "Nm"),
        ("ActTorque (% rated)", "ActTorque", "%"),
        ("ActTorque [‰]", "ActTorque", "‰"),
        ("torque in ‰", "torque", "‰"),
        ("Torque/‰", "Torque", "‰"),
        ("time (seconds since start)", "time", "seconds"),
        ("angle [0.001 deg]", "angle", "0.001 deg"),
        ("/joint_states/elbow/position", "/joint_states/elbow/position", None),
        ("  torque ", "torque", None),
        ("[mm]", "[mm]", None),
        ("", "", None),
    ],
)
def test_unit_in_a_header(header, name, unit):
    assert header_unit(header) == (name, unit)


@pytest.mark.parametrize(
    "text", ["mm", "[s]", "(N m)", "m/s^2", "deg/s", "-", "°", "oz-in", "Degrees", "A rms", "U/min"]
)
def test_units_of_motion(text):
    assert is_unit(text)


@pytest.mark.parametrize("text", ["position", "t x", "42", "abc", "elbow", "U", "r", "q axis"])
def test_what_is_no_unit_of_motion(text):
    assert not is_unit(text)
