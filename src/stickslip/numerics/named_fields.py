"""Names for the numbers of a state vector.

The state of a compiled step is one vector of float64: it copies, goes into a kernel and comes back
at little cost, whatever its length. A structured dtype gives the layout of the vector, and kernels
read and write ``s.pulse.levels[i, 0]`` instead of counting places. In a kernel the fields are the
memory of the vector itself, without a further array: a step takes no longer than with numbered
places (`python -m benchmarks pulses`).
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from jaxtyping import Float
from numba.extending import intrinsic, overload

_PLACE = 8  # bytes of a number in the vector


class Record(np.void):
    """A structure whose fields are attributes; faster than `numpy.record`."""

    __setattr__ = np.void.__setitem__

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except ValueError as error:
            raise AttributeError(name) from error


def places(dtype: np.dtype[Any]) -> int:
    """Return how many numbers of the vector a dtype takes."""
    return dtype.itemsize // _PLACE


def place_of(dtype: np.dtype[Any], name: str, start: int = 0) -> int:
    """Return the place in the vector of a field of a dtype that begins at ``start``."""
    offsets = {field: offset for field, (_, offset, *_) in (dtype.fields or {}).items()}
    return start + offsets[name] // _PLACE


def fields_at(dtype: np.dtype[Any], start: int = 0) -> Callable[[Float[np.ndarray, " s"]], Any]:
    """Return ``fields(vector) -> record``, in a kernel and in Python: the fields of a vector.

    The dtype is structured, of 8-byte numbers: floats, integers of zero or more (a negative one
    would read as NaN), and arrays and structures of them; the first of them is at place ``start``.
    What is written to the record is written to the vector; in a kernel it must not outlive the
    vector. A field whose name is an attribute of every record, or a number of another size, is a
    ValueError.

    Examples
    --------
    >>> count = np.dtype([("total", "f8"), ("samples", "i8")])
    >>> vector = np.zeros(3)
    >>> fields_at(count, start=1)(vector).samples = 2
    >>> fields_at(count, start=1)(vector).samples
    np.int64(2)
    """
    _check(dtype)
    record: Any = numba.from_dtype(dtype)

    @intrinsic
    def in_kernel(_: Any, vector: Any) -> Any:
        def address(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            first = builder.gep(data, [context.get_constant(numba.types.intp, start)])
            return builder.bitcast(first, context.get_value_type(record))

        return record(vector), address

    # The export to C reads dtype and start from the function
    def fields(vector: Float[np.ndarray, " s"]) -> Any:
        return np.ndarray(1, _with_attributes(dtype), vector, _PLACE * start)[0]

    # Numba compares the signatures of both, which therefore have no annotations
    def typed(vector):  # pyright: ignore[reportMissingParameterType, reportUnknownParameterType]
        whole = vector.ndim == 1 and vector.layout == "C" and vector.dtype == numba.float64
        if not whole:
            return None
        return lambda vector: in_kernel(vector)  # pyright: ignore  # noqa: PLW0108

    overload(fields)(typed)
    return fields


@cache
def _with_attributes(dtype: np.dtype[Any]) -> np.dtype[Any]:
    """Return a dtype of the same layout, whose structures are records."""
    if dtype.subdtype is not None:
        return np.dtype((_with_attributes(dtype.base), dtype.shape))
    if dtype.fields is None:
        return dtype
    fields = {name: (_with_attributes(field), at) for name, (field, at, *_) in dtype.fields.items()}
    formats, offsets = zip(*fields.values(), strict=True)
    layout = {"names": list(fields), "formats": list(formats), "offsets": list(offsets)}
    return np.dtype((Record, {**layout, "itemsize": dtype.itemsize}))


def _check(dtype: np.dtype[Any]) -> None:
    """Check names and sizes of all fields."""
    for name, (field, *_) in (dtype.fields or {}).items():
        if hasattr(Record, name):
            raise ValueError(f"a record has an attribute of its own named {name}")
        inner = field.base
        if inner.names is None and inner.itemsize != _PLACE:
            raise ValueError(f"{name} has {inner.itemsize} bytes, it must have {_PLACE}")
        _check(inner)
