"""Linear expressions over columns, such as ``35.15 * vir + 0.2``: read, never evaluated as code."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from stickslip.records import InputError

Value = float | np.ndarray
"""Value of a name: a constant of the file, or a column of shape (n,)."""

_Node = Callable[[Mapping[str, Value]], Value]

_DEEPEST = 50
"""Parentheses and signs nested deeper than this are refused, well before the stack ends."""

_TOKEN = re.compile(
    r"""\s*(?:
        (?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?(?![\w.]))
      | (?P<name>[^\W\d][\w.]*(?::[^\W\d][\w.]*)?)
      | (?P<quoted>'[^']*'|"[^"]*"|`[^`]*`)
      | (?P<operator>[-+*/()])
    )""",
    re.VERBOSE,
)


@dataclass(frozen=True, kw_only=True)
class Expression:
    """A linear expression; ``evaluate`` takes the value of each name."""

    text: str  # as written
    names: tuple[str, ...]  # each once, in order
    evaluate: _Node
    is_column: bool  # whether it is one name, with nothing computed


def quoted(name: str) -> str:
    """Return a name as it can be written in an expression.

    >>> quoted("tau"), quoted("motor angle")
    ('tau', "'motor angle'")
    """
    match = _TOKEN.match(name)
    if match and match["name"] == name:
        return name
    return f"'{name}'" if "'" not in name else f'"{name}"'


def column_expression(name: str) -> Expression:
    """Return the expression that is the named column."""
    return Expression(
        text=name, names=(name,), evaluate=lambda values: values[name], is_column=True
    )


def parse_expression(text: str) -> Expression:
    """Read a linear expression.

    Numbers, names, quoted names, ``+ - * /`` and parentheses are understood. A product may have
    one column at most and a divisor none, which is what makes it linear. A product of two columns
    is refused when it is evaluated, since a name may stand for a constant of the file.

    >>> expression = parse_expression("2 * (a - 'b c') / 4")
    >>> expression.names
    ('a', 'b c')
    >>> expression.evaluate({"a": np.array([3.0, 4.0]), "b c": 1.0})
    array([1. , 1.5])
    """
    return _Parser(text).expression()


class _Parser:
    """Recursive descent: a sum of products of signed factors."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = list(_tokens(text))
        self._next = self._depth = 0
        self._names: list[str] = []

    def expression(self) -> Expression:
        evaluate = self._sum()
        if self._next < len(self._tokens):
            raise self._unexpected()
        return Expression(
            text=self._text,
            names=tuple(dict.fromkeys(self._names)),
            evaluate=evaluate,
            is_column=len(self._tokens) == 1 and len(self._names) == 1,
        )

    def _take(self, *wanted: str) -> str | None:
        """Move past the next operator if it is one of those wanted."""
        kind, text = self._tokens[self._next] if self._next < len(self._tokens) else ("", "")
        if kind != "operator" or text not in wanted:
            return None
        self._next += 1
        return text

    def _sum(self) -> _Node:
        node = self._product()
        while operator := self._take("+", "-"):
            node = self._join(operator, node, self._product())
        return node

    def _product(self) -> _Node:
        node = self._factor()
        while operator := self._take("*", "/"):
            node = self._join(operator, node, self._factor())
        return node

    def _factor(self) -> _Node:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise InputError("nested_too_deep", kind="expression")
        node = self._signed_factor()
        self._depth -= 1
        return node

    def _signed_factor(self) -> _Node:
        if sign := self._take("+", "-"):
            inner = self._factor()
            return inner if sign == "+" else lambda values: -inner(values)
        if self._take("("):
            inner = self._sum()
            if not self._take(")"):
                raise self._unexpected()
            return inner
        if self._next >= len(self._tokens) or self._tokens[self._next][0] == "operator":
            raise self._unexpected()
        kind, text = self._tokens[self._next]
        self._next += 1
        if kind == "number":
            number = self._number(text)
            return lambda _: number
        self._names.append(text)
        return lambda values: values[text]

    def _number(self, text: str) -> float:
        number = float(text)
        vanished = number == 0.0 and not set(text.lower().partition("e")[0]).isdisjoint("123456789")
        if math.isinf(number) or vanished:
            raise InputError("number_range", text=self._text, number=text)
        return number

    def _unexpected(self) -> InputError:
        if self._next == len(self._tokens):
            reason = "something is missing at the end"
        else:
            reason = f"unexpected {self._tokens[self._next][1]!r}"
        return InputError("not_an_expression", text=self._text, reason=reason)

    def _join(self, operator: str, left: _Node, right: _Node) -> _Node:
        """Return the node that applies an operator, and refuses what would not be linear."""

        def evaluate(values: Mapping[str, Value]) -> Value:
            a, b = left(values), right(values)
            if operator == "+":
                return a + b
            if operator == "-":
                return a - b
            if operator == "*":
                if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
                    raise InputError("product_of_columns", text=self._text)
                return a * b
            if isinstance(b, np.ndarray) or b == 0:
                raise InputError(
                    "quotient_by_column" if isinstance(b, np.ndarray) else "quotient_by_zero",
                    text=self._text,
                )
            return a / b

        return evaluate


def _tokens(text: str) -> Iterator[tuple[str, str]]:
    position, end = 0, len(text.rstrip())
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            raise InputError(
                "not_an_expression", text=text, reason=f"cannot read {text[position:end].strip()!r}"
            )
        kind = str(match.lastgroup)
        word = match[kind]
        yield ("name", word[1:-1]) if kind == "quoted" else (kind, word)
        position = match.end()
