"""Fields of a state vector, read and written in kernels and in Python."""

import numpy as np
import pytest
from jaxtyping import Float
from numba.core.errors import TypingError

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import fields_at, places

INNER = np.dtype([("count", "i8"), ("levels", "f8", (3, 2))])
OUTER = np.dtype([("gain", "f8"), ("now", INNER), ("before", INNER), ("covariance", "f8", (2, 2))])
START = 2
SIZE = START + places(OUTER) + 1

fields = fields_at(OUTER, start=START)


@compiled(cached=False)
def changed(vector: Float[np.ndarray, " s"]) -> float:
    s = fields(vector)
    s.gain = 0.5
    s.now.count = 7
    s.now.levels[2, 1] = 3.0
    s.before = s.now
    s.now.count += 1
    s.covariance[1, 0] = s.gain * s.now.count
    return s.before.levels[2, 1]


def test_fields_lie_where_the_dtype_says() -> None:
    vector = np.zeros(SIZE)
    assert changed(vector) == 3.0
    # gain | count, 6 levels | count, 6 levels | covariance by rows
    expected = np.zeros(SIZE)
    expected[START] = 0.5
    expected[START + 7] = expected[START + 14] = 3.0
    expected[START + 17] = 4.0
    expected.view("i8")[START + 1], expected.view("i8")[START + 8] = 8, 7
    np.testing.assert_array_equal(vector.view("i8"), expected.view("i8"))


def test_python_sees_and_changes_the_same_numbers() -> None:
    vector = np.zeros(SIZE)
    changed(vector)
    s = fields(vector)
    assert (s.now.count, s.before.count, s.before.levels[2, 1]) == (8, 7, 3.0)
    s.before.levels[0, 0] = 9.0
    s.covariance = [[1.0, 2.0], [3.0, 4.0]]
    assert vector[START + 9] == 9.0
    np.testing.assert_array_equal(vector[START + 15 : START + 19], [1.0, 2.0, 3.0, 4.0])
    assert vector[0] == vector[1] == vector[-1] == 0.0


def test_a_padded_dtype_has_the_same_places_in_kernels_and_in_python() -> None:
    layout = {"names": ["gain", "inner"], "formats": ["f8", INNER], "offsets": [8, 24]}
    padded = np.dtype({**layout, "itemsize": 96})
    of_padded = fields_at(padded)

    @compiled(cached=False)
    def write(vector: Float[np.ndarray, " s"]) -> None:
        of_padded(vector).inner.count = 7

    vector = np.zeros(places(padded))
    write(vector)
    s = of_padded(vector)
    s.gain = 0.5
    assert s.inner.count == 7
    np.testing.assert_array_equal(np.flatnonzero(vector), [1, 3])


def test_a_name_that_a_record_lacks_is_no_attribute() -> None:
    s = fields(np.zeros(SIZE))
    assert not hasattr(s, "missing")
    with pytest.raises(ValueError, match="missing"):
        s.missing = 1.0


def test_a_name_that_every_record_has_is_refused() -> None:
    with pytest.raises(ValueError, match="named size"):
        fields_at(np.dtype([("size", "f8")]))
    inner = np.dtype([("trace", "f8")])
    with pytest.raises(ValueError, match="named trace"):
        fields_at(np.dtype([("gain", "f8"), ("inner", inner, (2,))]))


def test_a_number_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="count has 4 bytes"):
        fields_at(np.dtype([("count", "i4"), ("other", "i4")]))


def test_a_strided_vector_is_refused_by_kernels() -> None:
    with pytest.raises(TypingError):
        changed(np.zeros(2 * SIZE)[::2])
