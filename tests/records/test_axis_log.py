"""A log is validated when it is made, and stays as it was made."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.records import AxisLog, InputError

EXACT_GRID = 1e-12
"""Relative spread of time steps that decimal rounding of the stamps leaves."""


def make_log(**changes: object) -> AxisLog:
    columns: dict[str, object] = {
        "name": "stage",
        "kind": "linear",
        "time": np.arange(5) * 0.01,
        "effort": np.ones(5),
        "measured_position": np.linspace(0.0, 1.0, 5) ** 2,
    }
    return AxisLog(**(columns | changes))  # pyright: ignore[reportArgumentType]


def test_arrays_are_copied_in_and_cannot_be_written() -> None:
    effort = np.ones(5)
    log = make_log(effort=effort)
    effort[0] = 7.0
    assert log.effort[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        log.effort[0] = 2.0


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"time": np.array([0.0, 0.1, 0.1, 0.2, 0.3])}, "time_not_increasing"),
        ({"time": np.array([0.0, 0.2, 0.1, 0.3, 0.4])}, "time_not_increasing"),
        ({"effort": np.array([0.0, np.nan, 1.0, 1.0, 1.0])}, "samples_not_finite"),
        ({"measured_position": np.full(5, np.inf)}, "samples_not_finite"),
        ({"effort": np.ones(4)}, "unequal_lengths"),
        ({"effort": np.ones((5, 1))}, "not_a_vector"),
        ({"time": np.array([0.0]), "effort": np.ones(1)}, "too_few_samples"),
    ],
)
def test_bad_columns_are_refused_with_place_and_remedy(
    changes: dict[str, object], code: str
) -> None:
    with refuses(code, of=changes):
        make_log(**changes)


def test_units_follow_the_kind_of_axis() -> None:
    assert make_log(kind="linear").unit("viscous_friction") == "N s/m"
    assert make_log(kind="rotary").unit("viscous_friction_negative") == "N m s/rad"
    with refuses("samples_not_finite", unit="N m"):
        make_log(kind="rotary", effort=np.full(5, np.nan))


@given(
    lengths=st.lists(st.integers(2, 6), min_size=1, max_size=4),
    gap=st.floats(4.0, 50.0),
    step=st.sampled_from([1e-3, 0.25, 2.0]),
)
def test_gaps_split_a_log_into_its_uniform_stretches(
    lengths: list[int], gap: float, step: float
) -> None:
    times: list[float] = []
    start = 0.0
    for length in lengths:
        times.extend(start + step * k for k in range(length))
        start = times[-1] + gap * step
    n = len(times)
    single_steps = sum(length - 1 for length in lengths)
    log = make_log(time=np.array(times), effort=np.ones(n), measured_position=np.arange(float(n)))
    if single_steps <= len(lengths) - 1:
        return  # more gaps than steps: which of the two is the sampling time is undecidable
    assert [len(part) for part in log.segments()] == lengths
    assert log.sampling_time == pytest.approx(step, rel=EXACT_GRID)
    assert np.concatenate([part.measured_position for part in log.segments()]).tolist() == list(
        range(n)
    )


def test_jitter_is_the_largest_deviation_from_the_sampling_time() -> None:
    time = np.array([0.0, 1.0, 2.1, 3.0, 4.0])
    assert make_log(time=time).timing_jitter == pytest.approx(0.1, rel=EXACT_GRID)


def test_lost_samples_are_no_gap_and_jitter_hardly_shifts_the_sampling_time() -> None:
    generator = np.random.default_rng(1)
    grid = np.delete(np.arange(2001), [100, 101, 700, 1500])
    time = 0.001 * (grid + np.where(grid % 2000 == 0, 0.0, generator.uniform(-0.3, 0.3, grid.size)))
    log = make_log(time=time, effort=np.ones(grid.size), measured_position=1.0 * grid)
    assert log.segment_starts.tolist() == [0]
    # Some steps of 1.5 periods are taken for two; the stamps themselves stay what they are
    assert log.sampling_time == pytest.approx(0.001, rel=0.02)


MASKED = np.ma.masked_array([1.0, 2.0, 3.0], mask=[False, True, False])


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize(
    ("effort", "code"),
    [
        (MASKED, "samples_masked"),
        (np.array([1.0, 2.0, 3.0 + 1.0j]), "not_real_numbers"),
        (np.array(["2024-03-01"] * 3, "datetime64[s]"), "not_real_numbers"),
        (np.array([1, 2, 3], "timedelta64[s]"), "not_real_numbers"),
        (np.array(["1", "2", "3"]), "not_real_numbers"),
        (np.array([1.0, None, 3.0], dtype=object), "samples_not_finite"),
        (np.array([1.0, 2j, 3.0], dtype=object), "not_real_numbers"),
        (np.array([1.0, "2", 3.0], dtype=object), "not_real_numbers"),
        ([[1.0], [2.0, 3.0], [4.0]], "not_real_numbers"),
        ("text", "not_real_numbers"),
        (np.ones((3, 1)), "not_a_vector"),
        (None, "not_a_vector"),
    ],
)
def test_a_channel_holds_real_numbers(effort, code):
    with pytest.raises(InputError) as caught:
        AxisLog(name="stage", kind="linear", time=np.arange(3.0), effort=effort,
                measured_position=np.arange(3.0))  # fmt: skip
    assert caught.value.code == code
    assert "effort" in str(caught.value)


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("channel", ["time", "effort", "measured_position"])
def test_a_required_channel_is_missing(channel):
    with refuses("not_a_vector", name=channel):
        make_log(**{channel: None})


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("effort", [np.ma.masked_array([1.0, 2.0, 3.0]), [1, 2, 3],
                                    np.array([1, 2.0, np.float32(3)], dtype=object)])  # fmt: skip
def test_a_channel_may_come_in_any_array_of_real_numbers(effort):
    log = AxisLog(name="stage", kind="linear", time=np.arange(3.0), effort=effort,
                  measured_position=np.arange(3.0))  # fmt: skip
    np.testing.assert_array_equal(log.effort, [1.0, 2.0, 3.0])
    assert type(log.effort) is np.ndarray


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("kind", ["round", None, ["linear"], np.array(["linear", "rotary"]), 3])
def test_an_unknown_kind(kind):
    with refuses("not_a_choice"):
        AxisLog(name="stage", kind=kind, time=np.arange(3.0), effort=np.ones(3),
                measured_position=np.arange(3.0))  # fmt: skip
