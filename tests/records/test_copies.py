"""Public objects can be sent to another process and copied."""

import copy
import pickle

import numpy as np
import pytest

from stickslip import AxisSchema, LearnedPulses, LogSchema
from stickslip.records import InputError, MissingExtraError

OBJECTS = (
    AxisSchema(kind="linear", position="encoder", units={"position": "mm"}),
    LogSchema(files={"a": "axis.csv"}, axes={"x": AxisSchema(units={"effort": "A"})}),
)


@pytest.mark.parametrize("original", OBJECTS, ids=lambda each: type(each).__name__)
def test_schemas_pickle_and_copy(original: AxisSchema) -> None:
    for again in (
        pickle.loads(pickle.dumps(original)),  # noqa: S301 - its own bytes
        copy.deepcopy(original),
    ):
        assert again == original
        assert again is not original


def test_learned_pulses_pickle_and_copy() -> None:
    learned = LearnedPulses(
        method="pwc", kind="linear", values={"pulse_gain": 2.5}, covariance=np.array([[1e5]])
    )
    for again in (
        pickle.loads(pickle.dumps(learned)),  # noqa: S301 - its own bytes
        copy.deepcopy(learned),
    ):
        assert again.to_dict() == learned.to_dict()


@pytest.mark.parametrize(
    "original",
    [
        InputError("mass is -1 kg, it must be positive", where="a.toml", remedy="give the mass"),
        MissingExtraError("a.parquet is a Parquet file; reading it", extra="parquet"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_pickle_and_copy(original: Exception) -> None:
    for copied in (
        pickle.loads(pickle.dumps(original)),  # noqa: S301 - its own bytes
        copy.deepcopy(original),
    ):
        assert type(copied) is type(original)
        assert str(copied) == str(original)
        assert vars(copied) == vars(original)
