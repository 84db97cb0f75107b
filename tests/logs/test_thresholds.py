"""Both sides of the thresholds of reading: jitter, the length of a preamble, the side of time."""

import numpy as np
import pytest
from matlab_files import write_matlab_73

from stickslip.logs import LogSchema, read_log
from stickslip.records import InputError

SCHEMA = LogSchema(
    kind="linear",
    time="t",
    position="x",
    effort="f",
    units={"time": "s", "position": "m", "effort": "N"},
)


@pytest.mark.parametrize(("deviation", "noted"), [(0.9e-6, False), (1.1e-6, True)])
def test_jitter_is_noted_from_a_millionth_of_a_step(tmp_path, deviation, noted):
    time = np.arange(100.0)
    time[50:] += deviation
    path = tmp_path / "log.csv"
    rows = [f"{t!r},{k},1" for k, t in enumerate(time.tolist())]
    path.write_text("\n".join(["t,x,f", *rows, ""]))
    assert bool(read_log(path, SCHEMA).source.assumptions) == noted


@pytest.mark.parametrize(("preamble", "readable"), [(498, True), (499, False)])
def test_data_begin_within_500_lines(tmp_path, preamble, readable):
    path = tmp_path / "log.csv"
    rows = [f"{k},{k},1" for k in range(30)]
    path.write_text("\n".join(["% remark"] * preamble + ["t,x,f", *rows, ""]))
    if readable:
        assert len(read_log(path, SCHEMA)) == 30
    else:
        with pytest.raises(InputError):
            read_log(path, SCHEMA)


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_samples_are_the_rows_of_a_square_matrix(tmp_path, samples):
    """As MATLAB shows it; HDF5 holds the transpose. Beyond a square, the longer side is time."""
    shown = np.arange(3.0 * samples).reshape(samples, 3) ** 2
    shown[:, 0] = 0.5 * np.arange(samples)
    path = tmp_path / "log.mat"
    write_matlab_73(path, {"q": shown.T})
    schema = LogSchema(kind="linear", time="q_1", position="q_2", effort="q_3")
    if samples == 2:  # 2 x 3: three samples of two columns
        with pytest.raises(InputError):
            read_log(path, schema)
    else:
        np.testing.assert_array_equal(read_log(path, schema).effort, shown[:, 2])
