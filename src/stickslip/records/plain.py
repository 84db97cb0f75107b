"""Records as plain JSON types, field by field."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

__all__ = ["plain"]


def plain(value: Any) -> Any:
    """Return a record, or what stands in one, as plain JSON types.

    A record becomes a dictionary of its fields in their order, a sequence a list.

    Parameters
    ----------
    value
        A record, mapping, sequence, text, number, truth value or None [SI units of its fields].

    Examples
    --------
    >>> from stickslip.records import TermScore
    >>> score = TermScore(term="spring", text="a spring", selected=True, p_value=0.01, gain=0.2,
    ...                   gain_std=0.1, share=0.3)
    >>> plain((score,))[0]["term"]
    'spring'
    """
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    return value
