"""The translator: C that computes what the kernel does, and an error for anything else."""

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from stickslip.export.c.folder import template
from stickslip.export.c.translator.types import INT, REAL, Array, Structs, UntranslatableError
from stickslip.export.c.translator.unit import Unit
from stickslip.export.c.translator.values import Value

COMPILER = shutil.which("gcc") or shutil.which("cc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler is found")


def translated(kernel: Callable[..., Any], *arguments: Value, open_loops: bool = False) -> Unit:
    unit = Unit(Structs({}, {}), prefix="test", open_loops=open_loops)
    three.py_func.__module__ = "stickslip.test"
    kernel.__module__ = "stickslip.test"  # only kernels of the package are translated
    unit.translate(lambda each: each.function(kernel, list(arguments)))  # type: ignore[arg-type]
    return unit


def real(name: str) -> Value:
    return Value(REAL, name)


def compiled_in_c(unit: Unit, kernel: Callable[..., Any], folder: Path, inputs: int) -> Any:
    """Return the translated kernel of real arguments as a Python function."""
    for name in ("types", "math"):
        text = template(
            f"{name}.h", banner="", arithmetic="DOUBLE", library={"abs": "fabs"},
            functions=("sqrt", "exp", "ceil", "abs", "floor", "sin"),
            pairs=("pow", "fmod", "atan2", "hypot"),
        )  # fmt: skip
        (folder / f"stickslip_{name}.h").write_text(text)
    names = [f"x{k}" for k in range(inputs)]
    source = "\n".join(
        [
            '#include "stickslip_math.h"',
            unit.tuples(),
            unit.functions(),
            f"double call({', '.join(f'double {name}' for name in names)});",
            f"double call({', '.join(f'double {name}' for name in names)})",
            f"{{ return (double){unit.name_of(kernel)}({', '.join(names)}); }}",  # type: ignore[arg-type]
        ]
    )
    (folder / "kernel.c").write_text(source)
    command = [str(COMPILER), "-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra"]
    command += ["-Wconversion", "-Werror", "-shared", "-fPIC", "kernel.c", "-o", "kernel.so", "-lm"]
    subprocess.run(command, check=True, cwd=folder)
    function = ctypes.CDLL(str(folder / "kernel.so")).call
    function.restype = ctypes.c_double
    function.argtypes = [ctypes.c_double] * inputs
    return function


def whole_numbers(a: float, b: float) -> float:
    n, m = int(a), int(b)
    total = n % 7 + m // 3 - (n + 5) % 4
    for k in range(3, -2, -2):
        total += k * (n >> 1 & 3)
    return total + (1 if n < m <= 9 or not n > 0 else 0)


def extremes(a: float, b: float) -> float:
    return max(a, b) + 10.0 * min(b, a, 3.0) + max(int(a), 2)


def arrays(a: float, b: float) -> float:
    P, Q = np.zeros((3, 3)), np.ones((3, 3))
    P[0, :2] = a
    P[1:, 2] = Q[1:, 0]
    Q[:] = P
    row = P[0].copy()
    row[2], row[0] = row[0] + b, row[2]
    x, y = 1.0, 2.0
    x, y = y + a, x - b
    total = x - y
    for i in (0, 2):
        if row[i] == 0.0:
            continue
        total += Q[1, 2] * row[i]
    for sign, value in ((1.0, a), (-1.0, b)):
        total += sign * value**3
    return total


def powers(a: float, b: float) -> float:
    y = abs(a) ** 2.5 - b**2 + a**5 / 3
    return y if y > -1e300 else -math.inf


TABLE = np.array([[0.25, 0.0, 0.0], [1.0, -3.0, 0.5]])
PAIR = (1.5, -2.0)


@numba.njit(error_model="numpy")
def three(a: float, pair: tuple[float, float]) -> tuple[float, ...]:
    return (a, *pair)


def tuples(a: float, b: float) -> float:
    first, flags = three(a, PAIR)[:2], 0
    if a > 0.0:
        flags |= 1
    if b > 0.0:
        flags |= 2
    first = (*first[1:], b * TABLE[1, flags % 3])
    return (first[0] - 2.0 * first[1] + TABLE[0, 2]) * (1.0 if a in (b, 7.0) else 3.0)


def functions(a: float, b: float) -> float:
    angle = math.atan2(a, b) - math.floor(a / 3.0)
    return angle + math.sin(a) * math.hypot(a, b) + a % 2.5 + a % -0.75


def loop(a: float, b: float) -> float:
    steps, x = 0, abs(a) + 1.0
    while x > 1.0:
        x *= 0.5
        steps += 1
    while True:
        x += 0.125
        if x > b:
            break
        if steps > 3:
            steps -= 1
            continue
        x += 0.5
    return x + 10.0 * steps


KERNELS = [whole_numbers, extremes, arrays, powers, tuples, functions, loop]


@needs_compiler
@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.__name__)
def test_c_computes_what_the_compiled_kernel_does(
    kernel: Callable[..., Any], tmp_path: Path
) -> None:
    compiled: Any = numba.njit(error_model="numpy")(kernel)
    unit = translated(kernel, real("a"), real("b"), open_loops=kernel is loop)
    function = compiled_in_c(unit, kernel, tmp_path, 2)
    rng = np.random.default_rng(3)
    pairs = [*rng.uniform(-9.0, 9.0, (200, 2)).tolist(), (0.0, -0.0), (-3.0, 4.0), (7.0, -7.0)]
    for a, b in pairs:
        assert function(a, b) == float(compiled(a, b)), (a, b)


@needs_compiler
def test_a_nan_goes_the_way_that_it_goes_in_python(tmp_path: Path) -> None:
    def largest(a: float, b: float) -> float:
        return max(a, b)

    function = compiled_in_c(translated(largest, real("a"), real("b")), largest, tmp_path, 2)
    assert function(math.nan, 1.0) != function(math.nan, 1.0)
    assert function(1.0, math.nan) == 1.0


def endless(a: float) -> float:
    while a > 1.0:
        a *= 0.5
    return a


def unknown_function(a: float) -> float:
    return math.gamma(a)


def recursive(a: float) -> float:
    return recursive(a - 1.0) if a > 0.0 else a


def unknown_size(a: float) -> float:
    return np.zeros(int(a))[0]


def last_index(a: float) -> float:
    for k in range(3):
        a += k
    return a + k


def changed_index(a: float) -> float:
    for k in range(3):
        k += 1  # noqa: PLW2901
        a += k
    return a


def keyword(a: float) -> float:
    return helper(a, factor=2.0)


def helper(a: float, factor: float) -> float:
    return a * factor


def two_types(a: float) -> float:
    x = np.zeros(3)
    x = a
    return x  # noqa: RET504


def comprehension(a: float) -> float:
    return sum([a, a])


def outside(a: float) -> float:
    x = np.zeros(3)
    return x[3] + a


UNKNOWN = [
    endless, unknown_function, recursive, unknown_size, last_index, changed_index, keyword,
    two_types, comprehension, outside,
]  # fmt: skip


@pytest.mark.parametrize("kernel", UNKNOWN, ids=lambda kernel: kernel.__name__)
def test_what_is_not_known_is_an_error_with_its_place(kernel: Callable[..., Any]) -> None:
    recursive.__module__ = helper.__module__ = "stickslip.test"
    with pytest.raises(UntranslatableError) as error:
        translated(kernel, real("a"))
    if kernel is not recursive:
        assert kernel.__name__ in str(error.value)
        assert "line" in str(error.value)


def test_memory_that_is_only_read_can_be_constant() -> None:
    def first(values: Any, n: int) -> float:
        return values[0] + n

    unit = translated(first, Value(Array((3,), REAL), "values"), Value(INT, "n"))
    assert "const real values[3]" in unit.functions()


def test_two_changes_in_one_expression_are_refused() -> None:
    with pytest.raises(UntranslatableError, match="two calls"):
        translated(twice, Value(Array((2,), REAL), "values"))


def change(values: Any) -> float:
    values[0] += 1.0
    return values[0]


def twice(values: Any) -> float:
    return change(values) - change(values)


change.__module__ = "stickslip.test"
