"""The table of messages against the errors that the package raises, and their rendering."""

import ast
import copy
import pickle
import string
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

import stickslip
from stickslip.errors import InputError, MissingExtraError
from stickslip.messages import messages

ERRORS = {
    "InputError",
    "StickslipError",
    "EventBudgetError",
    "NoPulseSeriesError",
    "ScenarioError",
}
PACKAGE = Path(stickslip.__file__).parent
ITEMS = {"names", "list", "and", "or", "any", "all"}  # formats of several items
PURELY_INTERNAL = {"missing_extra", "option_needed"}


@dataclass(frozen=True)
class Raised:
    """A call that makes an error."""

    place: str
    codes: tuple[str, ...]
    quantities: frozenset[str]


def codes_in(node: ast.expr, scope: ast.AST) -> tuple[str, ...]:
    """Return the codes that the first argument of an error can be, assigned in the scope or not."""
    match node:
        case ast.Constant(value=str(code)):
            return (code,)
        case ast.IfExp(body=body, orelse=other):
            return codes_in(body, scope) + codes_in(other, scope)
        case ast.Name(id=name):
            assigned = [value for key, value in assignments(scope) if key == name]
            assert assigned, f"line {node.lineno}: the code is no literal"
            return tuple(code for value in assigned for code in codes_in(value, scope))
        case _:
            raise AssertionError(f"line {node.lineno}: the code is no literal")


def assignments(scope: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Yield names and the values that are assigned to them."""
    for node in ast.walk(scope):
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                yield name, value
            case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)):
                yield from zip((getattr(each, "id", "") for each in names), values, strict=True)


def calls() -> Iterator[Raised]:
    for path in sorted(PACKAGE.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        scopes = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call) or getattr(node.func, "id", "") not in ERRORS:
                continue
            names = frozenset(each.arg or "**" for each in node.keywords)
            own = [each for each in scopes if each.lineno <= node.lineno <= (each.end_lineno or 0)]
            place = f"{path.relative_to(PACKAGE)}:{node.lineno}"
            yield Raised(place, codes_in(node.args[0], own[-1]), names - {"where"})


def fields_of(code: str) -> dict[str, set[str]]:
    """Return the formats of each quantity in a template."""
    message = messages()[code]
    formats: dict[str, set[str]] = {}
    for name, spec in named_in(f"{message.what} {message.remedy}"):
        if not name.startswith("option."):
            formats.setdefault(name, set()).add(spec)
    return formats


def named_in(template: str) -> Iterator[tuple[str, str]]:
    """Yield fields and their formats, also those inside formats."""
    for _, field, spec, _ in string.Formatter().parse(template):
        if field:
            yield from named_in(spec or "")
            yield field, spec or ""


CALLS = list(calls())


@pytest.mark.parametrize("raised", CALLS, ids=[each.place for each in CALLS])
def test_an_error_has_a_message_and_its_quantities(raised: Raised) -> None:
    for code in raised.codes:
        assert code in messages()
        assert set(fields_of(code)) <= raised.quantities, code


def test_every_message_is_of_an_error() -> None:
    raised = {code for each in CALLS for code in each.codes}
    assert set(messages()) - raised <= PURELY_INTERNAL


@pytest.mark.parametrize("code", messages())
def test_a_message_is_two_sentences_without_ends(code: str) -> None:
    values = {
        name: ["a", "b"] if formats & ITEMS else 0.25 for name, formats in fields_of(code).items()
    }
    error = InputError(code, where="log.csv, row 3", **values)
    for text in (error.what, error.remedy):
        assert text.strip(" .;:") == text != "", text
        assert "  " not in text
    assert str(error) == f"log.csv, row 3: {error.what}; {error.remedy}"


def test_a_front_end_names_the_settings() -> None:
    error = InputError("not_positive", name="effort_limit", value=-1.0, unit="N")
    flags = error.sentence(lambda name: f"--{name.replace('_', '-')}")
    assert flags == "--effort-limit is -1 N, it must be positive; give a positive value"
    in_file = error.at("[controller]", keys=True).at("a.toml")
    assert in_file.sentence(lambda name: f"--{name}").startswith(
        "a.toml, [controller]: effort_limit is -1 N,"
    )


def test_units_of_a_kind() -> None:
    error = InputError("negative", name="noise", value=-1.0, unit="m or rad")
    assert "-1 m or rad," in str(error)
    assert error.on("linear").quantities["unit"] == "m"
    assert "-1 rad," in str(error.on("rotary"))


@pytest.mark.parametrize("unit", ["", "-"])
def test_no_unit(unit: str) -> None:
    error = InputError("not_a_number", name="exponent", value="two", unit=unit)
    assert str(error) == "exponent is 'two', it must be a number; give a number"


@pytest.mark.parametrize(
    "error",
    [
        InputError("negative", where="[task]", name="noise", value=-1.0, unit="m").at(
            "a", keys=True
        ),
        MissingExtraError("reading Parquet files", extra="parquet"),
    ],
)
def test_errors_copy_with_their_quantities(error: InputError) -> None:
    for other in (pickle.loads(pickle.dumps(error)), copy.deepcopy(error)):  # noqa: S301
        assert type(other) is type(error)
        assert str(other) == str(error)
        assert (other.code, other.where, other.keys) == (error.code, error.where, error.keys)
        assert other.quantities == error.quantities
    with pytest.raises(TypeError, match="does not support item assignment"):
        error.quantities["value"] = 1.0  # type: ignore[index]


def test_a_percentage_is_a_plain_number() -> None:
    error = InputError("known_load_uncertain", where="a", percent=210.0, most=10.0)
    assert "torque constant to 210.0 % only" in str(error)
