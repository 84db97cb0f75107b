"""The house rules that a machine can check: documented units, file sizes, a light import."""

import ast
import dataclasses
import functools
import importlib
import inspect
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import TypeCheckError
from shape_checks import CALLS

import stickslip

ROOT = Path(__file__).parents[1]
LARGEST_FILE = 800  # files are split by meaning; one thought may be long
MOST_MODULES = 12
MOST_PARAMETERS = 7
FRONTS = ("cli", "tasks")  # their functions take what a person asks for
FRONT_FUNCTIONS = ("simulate_closed_loop",)
QUICK_EXAMPLES = ("02_stop_short.py", "03_estimate_on_line.py")
HARDWARE_EXAMPLES = (  # tests/control/test_hardware_examples.py runs them
    "07_a_drive_over_udp.py",
    "08_mujoco_in_real_time.py",
    "09_a_cia402_drive_over_can.py",
)
HEAVY = ("numba", "scipy", "pint", "narwhals", "pydantic", "matplotlib", "pandas")


def test_a_wrong_shape_is_an_error_in_the_tests() -> None:
    from stickslip.estimation.signals.kinematics import noise_level

    for _ in range(CALLS):
        with pytest.raises(TypeCheckError):
            noise_level(np.zeros((20, 2)))


def public_objects() -> Iterator[tuple[str, object]]:
    """Yield every class and function that a package exports, by its public name."""
    seen: set[int] = set()
    for info in pkgutil.iter_modules(stickslip.__path__, "stickslip."):
        if not info.ispkg:
            continue
        package = importlib.import_module(info.name)
        for name in package.__all__:
            thing = getattr(package, name)
            if (inspect.isclass(thing) or inspect.isroutine(thing)) and id(thing) not in seen:
                seen.add(id(thing))
                yield f"{info.name}.{name}", thing


def numeric_arguments(thing: object) -> Iterator[tuple[str, bool]]:
    """Yield each argument that holds numbers, and whether its unit is declared with its field."""
    fields = getattr(thing, "__dataclass_fields__", {})
    for name, parameter in inspect.signature(thing).parameters.items():  # type: ignore[arg-type]
        annotation = str(parameter.annotation)
        if re.search(r"\bfloat\b|Float\[", annotation):
            yield name, name in fields and "quantity" in fields[name].metadata


def entry(document: str, name: str) -> str | None:
    """Return what a numpydoc docstring says of one argument, or None if it says nothing."""
    lines = document.splitlines()
    for k, line in enumerate(lines):
        stripped = line.strip()
        heads = [part.strip() for part in stripped.split(":")[0].split(",")]
        if name in heads and k + 1 < len(lines):
            indent = len(line) - len(line.lstrip())
            body: list[str] = []
            for following in lines[k + 1 :]:
                if following.strip() and len(following) - len(following.lstrip()) <= indent:
                    break
                body.append(following)
            if any(text.strip() for text in body):
                return "\n".join([stripped, *body])
    return None


def comment(thing: type, name: str) -> str | None:
    """Return the comment of a field in the body of its class (``#: ...``), above it or behind it.

    Sphinx shows it in the reference, as what a docstring says of an attribute.
    """
    field = rf"((?:^    #:.*\n)*)^    {name}:(?:[^#\n]|\n(?!    [\w#]))*(#:.*)?"
    for base in thing.__mro__[:-1]:
        found = re.search(field, inspect.getsource(base), re.MULTILINE)
        if found is not None and any(found.groups()):
            return "".join(filter(None, found.groups()))
    return None


PUBLIC = list(public_objects())


@pytest.mark.parametrize(("name", "thing"), PUBLIC, ids=[name for name, _ in PUBLIC])
def test_public_names_are_documented_with_units(name: str, thing: object) -> None:
    document = inspect.getdoc(thing) or ""
    assert document, f"{name} has no docstring"
    if isinstance(thing, type):  # inherited fields are documented where they are declared
        document = "\n".join(inspect.getdoc(base) or "" for base in thing.__mro__[:-1])
    if isinstance(thing, type) and (
        issubclass(thing, Exception) or not dataclasses.is_dataclass(thing)
    ):
        return
    for argument, declared in numeric_arguments(thing):
        text = entry(document, argument)
        if text is None and isinstance(thing, type):
            text = comment(thing, argument)
        assert text is not None, f"{name} does not document {argument}"
        assert declared or re.search(r"\[[^\]]+\]", text), f"{name}: {argument} has no [unit]"


def test_sphinx_finds_no_type_in_the_text_of_a_property() -> None:
    """Napoleon takes what stands before a colon in the first line for the type of a property."""
    for name, thing in PUBLIC:
        for member in vars(thing).values() if inspect.isclass(thing) else ():
            if isinstance(member, property | functools.cached_property):
                line = (inspect.getdoc(member) or " ").splitlines()[0]
                assert ":" not in line, f"{name}: {line}"


def test_no_file_outgrows_its_reader() -> None:
    long = {
        str(path.relative_to(ROOT)): lines
        for folder in ("src", "tests", "benchmarks", "examples", "studies", "docs")
        for path in (ROOT / folder).rglob("*.py")
        if (lines := len(path.read_text().splitlines())) > LARGEST_FILE
    }
    assert not long, f"split these files (over {LARGEST_FILE} lines): {long}"


def test_no_folder_holds_too_many_modules() -> None:
    full = {
        str(folder.relative_to(ROOT)): len(modules)
        for folder in (ROOT / "src").rglob("*/")
        if len(modules := [p for p in folder.glob("*.py") if p.name != "__init__.py"])
        > MOST_MODULES
    }
    assert not full, f"split these folders by meaning (over {MOST_MODULES} modules): {full}"


def test_no_function_has_too_many_parameters() -> None:
    package = ROOT / "src" / "stickslip"
    many = {
        f"{path.relative_to(package)}: {node.name}": count
        for path in package.rglob("*.py")
        if path.relative_to(package).parts[0] not in FRONTS
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef) and node.name not in FRONT_FUNCTIONS
        if (count := _parameters(node)) > MOST_PARAMETERS
    }
    assert not many, f"gather parameters in records (over {MOST_PARAMETERS}): {many}"


def _parameters(function: ast.FunctionDef) -> int:
    """Return the number of parameters without ``self`` and ``cls``."""
    given = function.args
    named = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    own = [name for name in named if name not in ("self", "cls")]
    return len(own) + sum(each is not None for each in (given.vararg, given.kwarg))


def test_notices_begin_with_the_name_of_the_package() -> None:
    """Without a handler of its own, a logger prints the message alone."""
    calls = re.compile(r"_logger\.(?:warning|exception|error|info)\(\s*f?\"(.*)")
    sources = (path.read_text("utf-8") for path in (ROOT / "src").rglob("*.py"))
    notices = [notice for source in sources for notice in calls.findall(source)]
    assert len(notices) > 3
    assert all(notice.startswith("stickslip: ") for notice in notices), notices


def test_no_test_of_the_package_imports_studies() -> None:
    """The import contract keeps the package itself free of them."""
    importing = [
        str(path.relative_to(ROOT))
        for path in sorted((ROOT / "tests").rglob("*.py"))
        if re.search(r"^\s*(from|import) studies\b", path.read_text(), flags=re.MULTILINE)
    ]
    assert importing == []


@pytest.mark.parametrize("module", ["stickslip", "stickslip.cli"])
def test_importing_a_front_loads_nothing_heavy(module: str) -> None:
    code = f"import sys, {module}; print(*[m for m in {HEAVY!r} if m in sys.modules])"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert loaded == []


def test_the_readme_example_runs(tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)
    assert blocks, "the README shows no Python example"
    for block in blocks:
        subprocess.run([sys.executable, "-W", "error", "-c", block], check=True, cwd=tmp_path)


@pytest.mark.parametrize(
    "script",
    [
        pytest.param(
            path, id=path.name, marks=[] if path.name in QUICK_EXAMPLES else pytest.mark.slow
        )
        for path in sorted((ROOT / "examples").glob("[0-9]*.py"))
        if path.name not in HARDWARE_EXAMPLES
    ],
)
def test_every_example_runs(script: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-W", "error", str(script)], check=True, cwd=tmp_path)
