"""An effort in ampere: the numbers of a fit in SI, and units made of the ampere everywhere."""

import re
from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from pages import page_of

from stickslip.records import QUANTITIES, InputError, LogSource, unit_of
from stickslip.tasks import compare_log, identify


@pytest.fixture(scope="module")
def torque_log():
    time = np.arange(0, 8, 0.002)
    velocity = 1.5 * np.sin(2 * time) + np.sin(5 * time)
    acceleration = 3.0 * np.cos(2 * time) + 5.0 * np.cos(5 * time)
    position = -0.75 * np.cos(2 * time) - 0.2 * np.cos(5 * time)
    effort = 0.3 * acceleration + 0.5 * np.sign(velocity) + 0.2 * velocity + 0.1
    noise = np.random.default_rng(3).normal(scale=0.01, size=time.size)
    return axis_log(time, effort + noise, position, name="joint", kind="rotary")


def test_values_are_those_of_the_fit_in_si(torque_log):
    one = identify(torque_log).estimate
    other = identify(replace(torque_log, effort_unit="A")).estimate
    assert {n: p.value for n, p in one.parameters.items()} == {
        n: p.value for n, p in other.parameters.items()
    }
    assert {n: p.unit for n, p in other.parameters.items()} == {
        "inertia": "A s^2/rad",
        "coulomb_friction": "A",
        "viscous_friction": "A s/rad",
        "offset": "A",
    }
    assert other.to_dict()["provenance"]["effort_unit"] == "A"


def test_a_report_in_ampere_names_no_newton(torque_log):
    found = identify(replace(torque_log, effort_unit="A"))
    text = page_of(found).source
    text = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert "A s²/rad" in text
    assert not re.search(r"\bN[ \u00a0]m\b|\bkg\b|\d J\b", text)


def test_a_comparison_in_ampere_names_no_newton(torque_log):
    found = compare_log(replace(torque_log, effort_unit="A"), only=("energy", "idim-ls"))
    for each in found.applied:
        assert each.estimate.parameters["inertia"].unit == "A s^2/rad"
    text = page_of(found).source
    text = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"\bN[ \u00a0]m\b|\bkg\b", text)


@pytest.mark.parametrize(
    ("name", "linear", "rotary"),
    [
        ("effort", "A", "A"),
        ("mass", "A s^2/m", "A s^2/rad"),
        ("inertia", "A s^2/m", "A s^2/rad"),
        ("coulomb_friction_positive", "A", "A"),
        ("viscous_friction", "A s/m", "A s/rad"),
        ("stiffness", "A/m", "A/rad"),
        ("energy", "A m", "A rad"),
        ("quadratic_friction", "A s^2/m^2", "A s^2/rad^2"),
        ("two_thirds_friction", "A (s/m)^(2/3)", "A (s/rad)^(2/3)"),
        ("offset_drift", "A/s", "A/s"),
        ("velocity", "m/s", "rad/s"),
        ("friction_drift", "1/s", "1/s"),
    ],
)
def test_units_of_quantities(name, linear, rotary):
    assert unit_of(name, "linear", "A") == linear
    assert unit_of(name, "rotary", "A") == rotary


def test_no_quantity_keeps_a_newton():
    for name in QUANTITIES:
        for kind in ("linear", "rotary"):
            assert not re.search(r"\bN\b|\bkg\b|\bJ\b", unit_of(name, kind, "A")), name


def test_the_side_of_the_gear_is_stated(torque_log):
    source = LogSource(files=(), sha256="", side="joint")
    found = identify(replace(torque_log, source=source))
    assert found.to_dict()["provenance"]["side"] == "joint"
    text = page_of(found).source
    assert "The values refer to the joint side of the gear." in text


def test_another_unit_of_the_effort_is_refused(torque_log):
    with pytest.raises((InputError, TypeError)):
        replace(torque_log, effort_unit="V")
