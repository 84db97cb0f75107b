import ast
import operator
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.logs import LogSchema, read_log
from stickslip.logs.expressions import parse_expression, quoted
from stickslip.records import InputError

COLUMN = np.array([1.0, -2.5, 4.0])
OTHER = np.array([0.5, 8.0, -1.0])
VALUES = {"a": COLUMN, "b.c": OTHER, "my column": COLUMN + OTHER, "f:x": OTHER, "g": 3.0}

# The same text, read by Python's own parser, is the reference.
OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}

numbers = st.one_of(
    st.integers(1, 10**6).map(str),
    st.floats(1e-3, 1e3).map(repr),
    st.sampled_from(["1e3", "2.5E-2", ".5", "3."]),
)
blanks = st.sampled_from(["", " ", "  "])


def scalars(depth):
    inner = st.deferred(lambda: scalars(depth - 1)) if depth else numbers
    return st.one_of(numbers, inner.map("({})".format), inner.map("-{}".format))


def terms(depth):
    columns = st.sampled_from(["a", "g"])
    inner = st.deferred(lambda: sums(depth - 1)).map("({})".format) if depth else columns
    factor = st.one_of(columns, inner, inner.map("-{}".format))
    return st.one_of(
        factor,
        st.builds("{1}{0}*{0}{2}".format, blanks, scalars(1), factor),
        st.builds("{1}{0}*{0}{2}".format, blanks, factor, scalars(1)),
        st.builds("{1}{0}/{0}{2}".format, blanks, factor, scalars(1)),
    )


def sums(depth):
    sign = st.sampled_from("+-")
    return st.recursive(
        terms(depth),
        lambda inner: st.builds("{1}{0}{2}{0}{3}".format, blanks, inner, sign, terms(depth)),
        max_leaves=4,
    )


def by_python(text):
    def value(node):
        if isinstance(node, ast.BinOp):
            return OPERATORS[type(node.op)](value(node.left), value(node.right))
        if isinstance(node, ast.UnaryOp):
            return OPERATORS[type(node.op)](value(node.operand))
        return float(node.value) if isinstance(node, ast.Constant) else VALUES[node.id]

    return value(ast.parse(text.strip(), mode="eval").body)


@given(sums(2))
def test_reads_as_python_does(text):
    expression = parse_expression(text)
    np.testing.assert_array_equal(expression.evaluate(VALUES), by_python(text))
    assert set(expression.names) == {
        node.id for node in ast.walk(ast.parse(text.strip())) if isinstance(node, ast.Name)
    }


@given(st.text(max_size=30))
def test_any_text_is_read_or_refused(text):
    with suppress(InputError):  # any other error passes
        parse_expression(text)


@given(st.text(min_size=1, max_size=20).filter(lambda name: "'" not in name or '"' not in name))
def test_a_quoted_name_is_that_name(name):
    expression = parse_expression(f"2 * {quoted(name)}")
    assert expression.names == (name,)
    assert expression.evaluate({name: 4.0}) == 8.0


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("35.1506519 * a", 35.1506519 * COLUMN),
        ("a*35.15 + 0.2", COLUMN * 35.15 + 0.2),
        ("g * a", 3.0 * COLUMN),
        ("a / -48", COLUMN / -48),
        ("32 * f:x", 32 * OTHER),
        ("'my column' - `b.c`", COLUMN),
        ('2 * "my column"', 2 * (COLUMN + OTHER)),
        ("b.c", OTHER),
        ("1e-3*a", 1e-3 * COLUMN),
    ],
)
def test_values(text, value):
    np.testing.assert_array_equal(parse_expression(text).evaluate(VALUES), value)


@pytest.mark.parametrize(
    "text",
    ["", "  ", "a b", "2 3", "2 *", "* a", "(a", "a)", "a ** 2", "a % 2", "f(a)", "a[0]", "2a",
     "1.2.3", "'a", "a:b:c", "__import__('os')", "a; b", "-", "(" * 200 + "a" + ")" * 200,
     "-" * 5000 + "a"],
)  # fmt: skip
def test_what_is_not_a_linear_expression(text):
    with pytest.raises(InputError):
        parse_expression(text)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("a * b.c", "product_of_columns"),
        ("2 / a", "quotient_by_column"),
        ("a / (2 - 2)", "quotient_by_zero"),
        ("a / 0.0", "quotient_by_zero"),
    ],
)
def test_what_is_not_linear(text, code):
    with refuses(code):
        parse_expression(text).evaluate(VALUES)


@pytest.mark.parametrize(("text", "expected"), [("a", True), ("'a b'", True), ("-a", False)])
def test_a_column_as_it_stands(text, expected):
    assert parse_expression(text).is_column is expected


def test_pi_is_a_number_unless_it_is_a_column(tmp_path):
    path = tmp_path / "log.csv"
    schema = LogSchema(position="angle * pi / 180", kind="rotary")
    path.write_text("t [s],angle,torque [N m]\n0,0,1\n1,90,1\n2,180,2\n")
    assert read_log(path, schema).measured_position[-1] == pytest.approx(np.pi)
    path.write_text("t [s],angle,torque [N m],pi\n0,0,1,1\n1,90,1,2\n2,180,2,3\n")
    with refuses("product_of_columns"):
        read_log(path, schema)
