"""Drives and tables: values, units, and the placement of points."""

import math
import struct

import numpy as np
import pytest
from exports import COULOMB, VISCOUS, document
from refusals import refuses
from scipy.optimize import differential_evolution

from stickslip.export import EstimateReading, ExportSettings, Transmission, axes_of, render
from stickslip.export.law_table import law_table

GEAR = 50.0
CURVED = {"static_friction": 0.8, "stribeck_velocity": 0.1, "quadratic_friction": 0.05}


def text(target, estimate=None, transmission=None, **settings):
    result = render(
        document() if estimate is None else estimate,
        target,
        reading=EstimateReading(transmission=transmission or Transmission(gear_ratio=GEAR)),
        settings=ExportSettings(**settings),
    )
    return result.rendered.files[""], result.rendered.notes


def parameters(**changes):
    return axes_of(document(**changes), EstimateReading())[""]


def test_ax8000_has_values_of_the_motor():
    content, notes = text("ax8000")
    rows = [line.split(",") for line in content.splitlines() if line.startswith("PS,")]
    values = {row[2]: float(row[4]) for row in rows}
    assert values == {
        "0x02": pytest.approx(COULOMB / GEAR),
        "0x03": pytest.approx(VISCOUS / GEAR**2),
    }
    for row in rows:  # the bytes of a REAL32, the lowest first
        assert struct.unpack("<f", bytes.fromhex(row[6]))[0] == pytest.approx(float(row[4]))
    assert any("spring rate" in each for each in notes)


def test_ax8000_has_the_spring_rate_of_presliding():
    estimate = document(presliding_friction=-0.4, presliding_distance=(0.002, "rad"))
    content, _ = text("ax8000", estimate, Transmission(side="motor"))
    row = next(line for line in content.splitlines() if line.startswith("PS,0x3144,0x01"))
    assert float(row.split(",")[4]) == pytest.approx(200.0)


def test_drives_never_get_the_static_friction():
    estimate = document(**CURVED)
    for target, settings in (
        ("ax8000", {}),
        ("ax2000", {"torque_constant": 0.1}),
        ("indradrive", {"torque_constant": 0.1, "rated_current": 2.0}),
    ):
        content, notes = text(target, estimate, **settings)
        values = [line for line in content.splitlines() if not line.startswith(("#", ";"))]
        assert not any("0.016" in line for line in values)  # 0.8/50
        assert any("hunt" in each for each in notes)


def test_ax2000_has_a_current():
    content, _ = text("ax2000", torque_constant=0.1)
    assert f"ISTFR {COULOMB / GEAR / 0.1:.3f}" in content


def test_indradrive_has_a_share_of_the_rated_torque():
    content, _ = text("indradrive", torque_constant=0.1, rated_current=2.0)
    assert f"S-0-0155  {100.0 * COULOMB / GEAR / 0.2:.1f} %" in content


@pytest.mark.parametrize("kind", ["rotary", "linear"])
def test_twincat_cnc_has_speeds_of_the_axis_and_currents_of_the_motor(kind):
    lead = 0.01 if kind == "linear" else None
    gear = None if kind == "linear" else GEAR
    content, _ = text(
        "twincat-cnc",
        document(kind),
        Transmission(gear_ratio=gear, lead=lead),
        torque_constant=0.001,
        rated_current=2.0,
        top_speed=3.0,
        points=4,
    )
    lines = [line.split() for line in content.splitlines() if line.startswith("frict_comp.table[")]
    speeds = [int(value) for name, value in lines if name.endswith(".in")]
    outputs = [int(value) for name, value in lines if name.endswith(".out")]
    assert speeds == sorted(set(speeds))
    assert speeds[0] > 0  # the CNC requires that
    unit = 1e6 if kind == "linear" else 1e3 * 180.0 / math.pi
    ratio = GEAR if kind == "rotary" else 2.0 * math.pi / 0.01
    assert speeds[-1] == pytest.approx(3.0 * unit, rel=1e-4)
    for speed, output in zip(speeds, outputs, strict=True):
        torque = (COULOMB + VISCOUS * speed / unit) / ratio
        assert output == pytest.approx(1000.0 * torque / 0.002, abs=1.0)


def test_twincat_cnc_states_the_deviation_of_what_is_written():
    """Whole numbers of 0.1 % of the rated current are coarser than the interpolation."""
    estimate, constant, current, top = document(**CURVED), 0.1, 3.0, 3.0
    settings = {"torque_constant": constant, "rated_current": current, "top_speed": top}
    content, notes = text("twincat-cnc", estimate, **settings)
    lines = [line.split() for line in content.splitlines() if line.startswith("frict_comp.table[")]
    speeds, outputs = (
        np.array([int(value) for name, value in lines if name.endswith(end)])
        for end in (".in", ".out")
    )
    effort = outputs * 1e-3 * constant * current * GEAR
    speed = np.linspace(1.0, top, 500)  # above the Stribeck effect, which is left out
    law = COULOMB + VISCOUS * speed + CURVED["quadratic_friction"] * speed**2
    found = np.max(np.abs(np.interp(speed, speeds * math.pi / 180e3, effort) - law))
    (note,) = [each for each in notes if "Largest deviation" in each]
    stated = float(note.split(": ")[1].split()[0])
    assert 0.4 * stated < found <= 1.05 * stated


def test_twincat_cnc_has_no_speed_twice():
    settings = {"torque_constant": 0.1, "rated_current": 2.0, "top_speed": 1e-4}
    content, _ = text("twincat-cnc", **settings)
    lines = [line.split() for line in content.splitlines() if "].in" in line]
    speeds = [int(value) for _, value in lines]
    assert speeds[0] > 0
    assert speeds == sorted(set(speeds))
    assert f"table_entries         {len(speeds)}\n" in content


def test_ax8000_of_a_linear_motor_has_forces():
    content, _ = text("ax8000", document("linear"), Transmission(side="motor"))
    assert [line.split(",")[5] for line in content.splitlines() if line.startswith("PS,")] == [
        "N",
        "N s/m",
    ]


def test_twincat_cnc_has_at_most_20_points():
    settings = {"torque_constant": 0.1, "rated_current": 2.0, "top_speed": 3.0}
    content, _ = text("twincat-cnc", document(**CURVED), **settings)
    assert content.count("].in ") == 20
    with refuses("out_of_range", value=21, most=20):
        text("twincat-cnc", points=21, **settings)


def read_table(content):
    rows = [line for line in content.splitlines() if not line.startswith("#")]
    assert rows[0] == "speed [rad/s],effort forward [N m],effort backward [N m]"
    return np.array([[float(each) for each in row.split(",")] for row in rows[1:]])


def test_the_table_of_an_affine_law_is_exact():
    estimate = document(offset=0.1)
    content, _ = text("table", estimate, top_speed=10.0, points=4)
    table = read_table(content)
    assert table[:, 0] == pytest.approx([0.0, 10.0 / 3.0, 20.0 / 3.0, 10.0])
    assert table[:, 1] == pytest.approx(COULOMB + VISCOUS * table[:, 0] + 0.1, abs=1e-9)
    assert table[:, 2] == pytest.approx(-COULOMB - VISCOUS * table[:, 0] + 0.1, abs=1e-9)


def test_the_table_of_a_log_per_direction_contains_the_offset_once():
    estimate = document(
        coulomb_friction="absent", coulomb_friction_positive=0.7, coulomb_friction_negative=0.4
    )
    table = read_table(text("table", estimate, top_speed=10.0, points=2)[0])
    assert table[0] == pytest.approx([0.0, 0.7, -0.4], abs=1e-9)


def lowest_friction(speed):
    """Return the smallest friction of each speed and all higher ones, up to 10 rad/s."""
    fine = np.linspace(0.0, 10.0, 20_001)
    law = COULOMB + 0.3 * np.exp(-((fine / 0.1) ** 2)) + VISCOUS * fine + 0.05 * fine**2
    return np.interp(speed, fine, np.minimum.accumulate(law[::-1])[::-1])


@pytest.mark.parametrize("points", [2, 3, 5, 10, 20])
def test_the_table_leaves_the_static_peak_out(points):
    table = law_table(parameters(**CURVED), points=points, top_speed=10.0)
    assert table.speed.size == points
    assert table.forward[0] <= lowest_friction(0.0) + 1e-6 < 0.8
    assert table.flat_below == pytest.approx(0.2, abs=0.03)
    speed = np.linspace(0.0, 10.0, 5001)
    deviation = np.interp(speed, table.speed, table.forward) - lowest_friction(speed)
    assert np.max(np.abs(deviation)) == pytest.approx(table.error, rel=0.05, abs=1e-4)
    assert table.backward == pytest.approx(-table.forward, abs=1e-9)


@pytest.mark.parametrize("points", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_no_other_table_has_a_much_smaller_error(points):
    """Knots and efforts by a global search that shares nothing with the table."""
    speed = np.linspace(0.0, 10.0, 501)
    law = lowest_friction(speed)

    def error(x):
        knots = np.concatenate([[0.0], np.sort(x[: points - 2]), [10.0]])
        efforts = np.concatenate([[min(x[points - 2], law[0])], x[points - 1 :]])
        return np.max(np.abs(np.interp(speed, knots, efforts) - law))

    bounds = [(0.0, 10.0)] * (points - 2) + [(0.0, 8.0)] * points
    best = differential_evolution(error, bounds, seed=1, tol=1e-10, maxiter=600).fun
    table = law_table(parameters(**CURVED), points=points, top_speed=10.0)
    assert table.error <= 1.05 * best


@pytest.mark.parametrize("points", [1, 101])
def test_the_number_of_points_is_limited(points):
    with refuses("out_of_range", value=points):
        law_table(parameters(), points=points, top_speed=1.0)


@pytest.mark.parametrize("top", [0.0, -1.0, math.inf, math.nan])
def test_the_top_speed_is_positive(top):
    with pytest.raises(ValueError, match="top_speed"):
        law_table(parameters(), points=3, top_speed=top)
