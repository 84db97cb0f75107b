"""Public objects can be sent to another process and copied."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from estimates import doubtful_estimate

from stickslip import ESTIMATORS, AxisSchema, LearnedPulses, LogSchema
from stickslip.records import InputError, MissingExtraError

OBJECTS = (
    ESTIMATORS,
    AxisSchema(kind="linear", position="encoder", units={"position": "mm"}),
    LogSchema(files={"a": "axis.csv"}, axes={"x": AxisSchema(units={"effort": "A"})}),
    doubtful_estimate(),
    LearnedPulses(method="pwc", kind="linear", values={"pulse_gain": 2.5}, covariance=np.eye(1)),
    InputError("not_positive", where="a.toml", name="mass", value=-1.0, unit="kg"),
    MissingExtraError("a.parquet is a Parquet file; reading it", extra="parquet"),
)


@pytest.mark.parametrize("original", OBJECTS, ids=lambda each: type(each).__name__)
def test_public_objects_pickle_and_copy(original: Any) -> None:
    for again in (
        pickle.loads(pickle.dumps(original)),  # noqa: S301 - its own bytes
        copy.deepcopy(original),
    ):
        assert type(again) is type(original)
        assert again is not original
        if original is ESTIMATORS:  # its factories compare by identity
            assert {n: e.settings for n, e in again.items()} == {
                n: e.settings for n, e in original.items()
            }
        elif isinstance(original, Exception):
            assert (str(again), vars(again)) == (str(original), vars(original))
        else:
            assert again == original
