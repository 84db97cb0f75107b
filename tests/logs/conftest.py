"""A motion with all six channels, in numbers that no format can change unnoticed."""

import numpy as np
import pytest

from stickslip.records import AxisLog


@pytest.fixture(scope="session")
def columns():
    """By channel, 60 samples of 17 digits each."""
    generator = np.random.default_rng(20)
    n = 60
    time = np.arange(n) / 100  # which whole nanoseconds hold
    return {
        "time": time,
        "position": np.sin(5 * time) + generator.normal(scale=1e-3, size=n),
        "velocity": 5 * np.cos(5 * time),
        "load_position": np.sin(5 * time - 0.1),
        "load_velocity": 5 * np.cos(5 * time - 0.1),
        "effort": generator.normal(size=n) * 1e3,
    }


@pytest.fixture(scope="session")
def expected(columns):
    """The log of that motion."""
    return AxisLog(
        name="stage",
        kind="linear",
        time=columns["time"],
        effort=columns["effort"],
        measured_position=columns["position"],
        measured_velocity=columns["velocity"],
        measured_load_position=columns["load_position"],
        measured_load_velocity=columns["load_velocity"],
    )


@pytest.fixture(scope="session")
def same():
    """Return a function that asserts that two logs are equal, bit for bit."""

    def check(log, other, *, name=True):
        assert log.kind == other.kind
        assert not name or log.name == other.name
        for field in (
            "time",
            "effort",
            "measured_position",
            "measured_velocity",
            "measured_load_position",
            "measured_load_velocity",
        ):
            one, two = getattr(log, field), getattr(other, field)
            if one is None or two is None:
                assert one is two, field
            else:
                np.testing.assert_array_equal(one, two, err_msg=field)

    return check
