"""A motion with all six channels, in numbers that no format can change unnoticed."""

import numpy as np
import pytest
from sample_files import motion

from stickslip.records import AxisLog


@pytest.fixture(scope="session")
def columns():
    """By channel, 60 samples of 17 digits each."""
    return motion()


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
