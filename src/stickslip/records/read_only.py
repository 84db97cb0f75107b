"""A mapping that cannot be changed and, unlike `types.MappingProxyType`, can be pickled."""

from collections.abc import Iterator, Mapping
from typing import TypeVar

__all__ = ["ReadOnlyMapping"]

Key = TypeVar("Key")
Value = TypeVar("Value")


class ReadOnlyMapping(Mapping[Key, Value]):
    """Read-only copy of a mapping.

    Parameters
    ----------
    values
        Items to copy, in their order.

    Examples
    --------
    >>> options = ReadOnlyMapping({"offset": True})
    >>> options | {"cutoff": None}
    {'offset': True, 'cutoff': None}
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[Key, Value]) -> None:
        self._values = dict(values)

    def __getitem__(self, key: Key) -> Value:
        return self._values[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __or__(self, other: Mapping[Key, Value]) -> dict[Key, Value]:
        return {**self._values, **other}

    def __ror__(self, other: Mapping[Key, Value]) -> dict[Key, Value]:
        return {**other, **self._values}

    def __repr__(self) -> str:
        return f"ReadOnlyMapping({self._values!r})"
