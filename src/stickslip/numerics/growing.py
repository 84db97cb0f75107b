"""Sequence that grows by one element a sample, of which every earlier state stays valid."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

_PART = 128  # elements of a part; `after` copies fewer

E = TypeVar("E")


@dataclass(frozen=True)
class Growing(Generic[E]):
    """Immutable sequence in parts, so that an element more copies the last part only."""

    parts: tuple[tuple[E, ...], ...] = ()
    last: tuple[E, ...] = ()

    def __len__(self) -> int:
        return _PART * len(self.parts) + len(self.last)

    def __iter__(self) -> Iterator[E]:
        for part in self.parts:
            yield from part
        yield from self.last

    def after(self, element: E) -> "Growing[E]":
        """Return the sequence with an element more."""
        last = (*self.last, element)
        return Growing((*self.parts, last)) if len(last) == _PART else Growing(self.parts, last)
