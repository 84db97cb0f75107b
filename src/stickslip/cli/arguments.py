"""Values from the command line that its own conversion would take too kindly."""

from collections.abc import Sequence
from pathlib import Path

from cyclopts import Token

__all__ = ["folder", "whole_number"]


def folder(_type: object, tokens: Sequence[Token]) -> Path:
    """Return a folder; an empty path would be the current one, which nobody named."""
    if not tokens[0].value:
        raise ValueError("it is empty; name a folder, or give . for the current one")
    return Path(tokens[0].value)


def whole_number(_type: object, tokens: Sequence[Token]) -> int:
    """Return a whole number; the command line's own conversion would cut 2.5 down to 2."""
    try:
        return int(tokens[0].value)
    except ValueError:
        raise ValueError(f'"{tokens[0].value}" is not a whole number') from None
