"""Exported C code: built by compilers, compared with Python, checked by analysers."""

import ctypes
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_code import CONTENTS, LAW
from exports import document

from stickslip.export import ExportParameters, ExportSettings, render
from stickslip.export.c.content import CodeContent
from stickslip.export.c.folder import parts_of
from stickslip.export.c.law import CodeLaw
from stickslip.export.c.target import folder
from stickslip.export.c.vectors import vectors_of
from stickslip.friction import CoulombViscousFriction
from stickslip.friction.estimated_law import law_effort
from stickslip.plants import SingleMass
from stickslip.simulation.kernels.single_mass import mass_step
from stickslip.simulation.plant_kernels import initial_kernel_state, kernel_model

STRICT = [
    "-std=c99",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Werror",
]
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
CORTEX = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-O2"]
NAMES = ("law", "pulses", "kalman", "energy")

NEWLIB = 1e-8
"""Largest relative difference between the mathematical functions of newlib and glibc, which the
learning of short pulses amplifies: 2e-9 is measured through a whole positioning."""
LAW_IN_FLOAT = 2e-7  # of the largest force: three roundings of float
KALMAN_IN_FLOAT = 1e-3  # of the largest estimate; 2e-5 is measured
ALLOWED = frozenset(  # rules that MISRA.md of the folder lists
    ["2.5", "5.9", "8.7", "9.3", "10.1", "10.6", "10.8", "12.1", "15.4", "15.5", "17.7", "17.8"]
)


@dataclass(frozen=True)
class Exported:
    """A folder of exported code."""

    path: Path
    content: CodeContent

    def built(self, name: str, compiler: str, *options: str, program: str = "test") -> Path:
        """Return the test program of a module."""
        out = self.path / f"{program}_{name}_{compiler}_{abs(hash(options))}"
        sources = [f"test/test_{name}.c", f"src/stickslip_{name}.c"]
        sources += [f"src/stickslip_{name}_config.c"]
        self.run(compiler, *STRICT, *options, "-Isrc", *sources, "-o", str(out), "-lm")
        return out

    def run(self, *command: str) -> str:
        done = subprocess.run(command, cwd=self.path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}{done.stderr}"
        return done.stdout


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Exported]:
    """Return a function that writes a folder once."""

    @cache
    def write(name: str) -> Exported:
        root = tmp_path_factory.mktemp(name)
        for file, text in folder(CONTENTS[name], ("A note.",)).items():
            path = root / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return Exported(root, CONTENTS[name])

    return write


@pytest.fixture(params=["measured", pytest.param("rotary", marks=pytest.mark.slow)])
def exported(request: pytest.FixtureRequest, written: Callable[[str], Exported]) -> Exported:
    return written(request.param)


# The other differs in constants and sizes of arrays: enough for what depends on the form alone.
of_one_folder = pytest.mark.parametrize("exported", ["measured"], indirect=True)
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler is found")


@needs_compiler
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "compiler",
    [*COMPILERS[:1], *(pytest.param(name, marks=pytest.mark.slow) for name in COMPILERS[1:])],
)
def test_double_is_python_to_the_last_bit(exported: Exported, name: str, compiler: str) -> None:
    """Without a warning, optimised and not."""
    for optimised in ("-O0", "-O2"):
        exported.run(str(exported.built(name, compiler, optimised, "-DSTICKSLIP_DOUBLE")))


@pytest.mark.parametrize("name", list(CONTENTS))
def test_vectors_of_the_controller_hold_pulses(name: str) -> None:
    content = CONTENTS[name]
    (part,) = [part for part in parts_of(content) if part.module.name == "pulses"]
    vectors = vectors_of(part, content)
    assert vectors.final[-1] >= 2.0  # pulses
    nearest = np.nanmin(np.abs(vectors.inputs[:, 1] - content.controller.target))
    assert nearest < np.abs(vectors.inputs[0, 1] - content.controller.target) / 10.0


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("name", NAMES)
def test_sanitizers_find_nothing(exported: Exported, name: str) -> None:
    options = ["-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    if "clang" in COMPILERS:
        options.append("-fsanitize=float-cast-overflow")
    compiler = "clang" if "clang" in COMPILERS else COMPILERS[0]
    exported.run(str(exported.built(name, compiler, *options)))


@needs_compiler
@pytest.mark.parametrize(
    ("name", "bound"), [("law", LAW_IN_FLOAT), ("kalman", KALMAN_IN_FLOAT), ("energy", 0.0)]
)
def test_float_is_within_its_bound(exported: Exported, name: str, bound: float) -> None:
    options = ("-O2", "-DSTICKSLIP_FLOAT", f"-DTOLERANCE={bound}")
    for compiler in COMPILERS:
        exported.run(str(exported.built(name, compiler, *options)))


@needs_compiler
@of_one_folder
def test_wrong_numbers_fail_the_test_program(exported: Exported) -> None:
    """The programs can fail: with another configuration they do."""
    config = exported.path / "src" / "stickslip_law_config.c"
    right = config.read_text()
    try:
        config.write_text(re.sub(r"\.viscous = \{STICKSLIP_REAL\(", r"\g<0>1.0 + ", right))
        program = exported.built("law", COMPILERS[0], "-O2")
        assert subprocess.run([str(program)], capture_output=True, check=False).returncode == 1
    finally:
        config.write_text(right)


@needs_compiler
@of_one_folder
def test_the_makefile_and_the_example_work(exported: Exported) -> None:
    if shutil.which("make") is None:
        pytest.skip("make is not found")
    out = exported.run("make", "test", f"CC={COMPILERS[0]}")
    assert out.count(" 0 failures, largest error 0") == len(NAMES)
    exported.run("make", f"CC={COMPILERS[0]}")
    out = exported.run("make", "example", f"CC={COMPILERS[0]}", f"CFLAGS={' '.join(STRICT)}")
    assert "samples of the energy estimator 100" in out
    exported.run("make", "clean")


@needs_compiler
def test_the_makefile_works_in_float(tmp_path: Path) -> None:
    """Also with an offset near zero, where an error relative to the offset itself is large."""
    if shutil.which("make") is None:
        pytest.skip("make is not found")
    written = render(
        document(offset=1e-5),
        "c",
        settings=ExportSettings(precision="single", sampling_time=0.001),
    )
    for file, text in written.rendered.files.items():
        assert isinstance(text, str)
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    done = subprocess.run(
        ["make", "test", f"CC={COMPILERS[0]}"],  # noqa: S607
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert done.stdout.count(" 0 failures") == len(NAMES)
    assert "law: 0 failures, largest error 0\n" not in done.stdout, "float differs"


@pytest.mark.slow
@of_one_folder
def test_cmake_builds_and_tests(exported: Exported) -> None:
    if shutil.which("cmake") is None:
        pytest.skip("cmake is not found")
    exported.run("cmake", "-S", ".", "-B", "cmake-build")
    exported.run("cmake", "--build", "cmake-build")
    exported.run("ctest", "--test-dir", "cmake-build")


@needs_compiler
@of_one_folder
def test_headers_are_those_of_cpp_too(exported: Exported) -> None:
    if shutil.which("g++") is None:
        pytest.skip("g++ is not found")
    lines = [f'#include "stickslip_{name}.h"' for name in NAMES]
    (exported.path / "all.cpp").write_text("\n".join([*lines, "int main() { return 0; }"]))
    exported.run("g++", "-Wall", "-Wextra", "-Werror", "-Isrc", "-c", "all.cpp", "-o", "all.o")


# --- what the code must not have ---


def test_the_code_has_no_heap_globals_recursion_or_open_loops(exported: Exported) -> None:
    for name in NAMES:
        text = (exported.path / "src" / f"stickslip_{name}.c").read_text()
        code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        assert not re.search(r"\b(malloc|calloc|free)\(|\b(while|goto|do)\b", code)
        # Every loop counts to a bound in steps of a constant
        loops = re.findall(r"\bfor \((.*?)\) \{", code, flags=re.DOTALL)
        form = r"int64_t (\w+) = .*?; \1 [<>] .*?; \1 [+-]= \d+"
        assert loops or name == "law"
        assert all(re.fullmatch(form, loop, flags=re.DOTALL) for loop in loops)
        # A function calls only those that are defined above it
        defined: list[str] = []
        for match in re.finditer(
            r"^(?:static )?\w+ (\w+)\(([^;{]*)\)\n\{(.*?)^\}", code, re.M | re.S
        ):
            called = set(re.findall(r"\b(\w+)\(", match[3]))
            own = set(re.findall(r"^static \w+ (\w+)\(", code, re.M))
            assert called & own <= set(defined), match[1]
            defined.append(match[1])
        assert len(defined) > 2


@pytest.mark.slow
@of_one_folder
@pytest.mark.parametrize("name", NAMES)
def test_cortex_m4_has_no_data_but_the_state(exported: Exported, name: str) -> None:
    if shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("arm-none-eabi-gcc is not found")
    for precision in ("DOUBLE", "FLOAT"):
        output = f"{name}.o"
        exported.run(
            "arm-none-eabi-gcc", *CORTEX, *STRICT, f"-DSTICKSLIP_{precision}", "-Isrc",
            "-c", f"src/stickslip_{name}.c", "-o", output,
        )  # fmt: skip
        sizes = exported.run("arm-none-eabi-size", output).splitlines()[1].split()
        assert sizes[1:3] == ["0", "0"], "initialised and zeroed data"
        undefined = exported.run("arm-none-eabi-nm", "-u", output)
        assert not re.search(r"\b(malloc|free|printf)\b", undefined)
        if precision == "FLOAT" and name != "energy":
            # No arithmetic in double by mistake
            assert not re.search(r"__aeabi_d(add|mul|sub|div)", undefined)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_cortex_m4_computes_the_same(exported: Exported, name: str) -> None:
    if not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")):
        pytest.skip("arm-none-eabi-gcc or qemu-system-arm is not found")
    here = Path(__file__).parent
    program = exported.path / f"{name}.elf"
    exported.run(
        "arm-none-eabi-gcc", *CORTEX, *STRICT, f"-DTOLERANCE={NEWLIB}", "-Isrc",
        f"test/test_{name}.c", f"src/stickslip_{name}.c", f"src/stickslip_{name}_config.c",
        str(here / "start.c"), "-T", str(here / "mps2.ld"), "--specs=rdimon.specs",
        "-nostartfiles", "-o", str(program), "-lm",
    )  # fmt: skip
    out = exported.run(
        "timeout", "120", "qemu-system-arm", "-M", "mps2-an386", "-nographic",
        "-semihosting-config", "enable=on,target=native", "-kernel", str(program),
    )  # fmt: skip
    assert f"{name}: 0 failures" in out


@pytest.mark.slow
@of_one_folder
def test_misra_deviations_are_those_that_are_listed(exported: Exported) -> None:
    if shutil.which("cppcheck") is None:
        pytest.skip("cppcheck is not found")
    done = subprocess.run(
        ["cppcheck", "--addon=misra", "--std=c99", "-Isrc", "src", "--quiet"],  # noqa: S607
        cwd=exported.path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    found = set(re.findall(r"misra-c2012-([\d.]+)", done.stderr))
    assert found <= ALLOWED
    listed = (exported.path / "MISRA.md").read_text()
    assert all(rule in listed for rule in found)
    others = re.findall(r"(error|warning|portability): .*", done.stderr)
    assert not others


# --- the law ---


def test_the_law_is_that_of_the_estimate() -> None:
    from stickslip.export.c.kernels import friction
    from stickslip.numerics.named_fields import fields_at

    values = {
        "coulomb_friction_positive": 20.0,
        "coulomb_friction_negative": 18.0,
        "static_friction_positive": 26.0,
        "static_friction_negative": 21.0,
        "viscous_friction": 200.0,
        "offset": -3.0,
        "stribeck_velocity": 0.02,
        "quadratic_friction": 40.0,
        "two_thirds_friction": 5.0,
        "low_speed_friction": -2.0,
        "low_speed_velocity": 0.005,
    }
    law = CodeLaw.estimated(ExportParameters(kind="linear", values=values))
    fields = fields_at(friction.LAW)(law.numbers(95.0, 0.0))
    v = np.concatenate([-np.geomspace(1e-5, 1.0, 30), np.geomspace(1e-5, 1.0, 30)])
    expected = law_effort(values, v, np.sign(v))
    found = [friction.friction_force(fields, each) + law.offset for each in v.tolist()]
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_the_law_of_a_plant_is_its_friction() -> None:
    from stickslip.export.c.kernels import friction
    from stickslip.numerics.named_fields import fields_at

    for law in (LAW, replace(LAW, shape="exponential"), LAW.mirrored()):
        fields = fields_at(friction.LAW)(CodeLaw.of(law).numbers(150.0, 0.0))
        v = np.linspace(-0.1, 0.1, 41)
        found = [friction.friction_force(fields, each) for each in v.tolist()]
        np.testing.assert_allclose(found, law.friction(v), rtol=1e-14)


def structured_text(source: str) -> Any:
    """Return structured text of assignments and conditions as a Python function."""
    constants = dict(re.findall(r"^    (\w+) : LREAL := (\S+);", source, flags=re.M))
    body = source.rsplit("END_VAR", maxsplit=1)[-1].split("END_FUNCTION_BLOCK", maxsplit=1)[0]
    lines: list[str] = []
    depth = 0
    for raw in body.splitlines():
        line = raw.strip()
        if line.startswith(("ELSIF", "ELSE", "END_IF")):
            depth -= 1
        if line.startswith("END_IF") or not line:
            continue
        line = re.sub(r"^ELSIF (.*) THEN", r"elif \1:", line)
        line = re.sub(r"^IF (.*) THEN", r"if \1:", line).replace("ELSE", "else:")
        lines.append("    " * depth + line.replace(":=", "=").rstrip(";"))
        depth += line.endswith(":")

    def run(**inputs: float) -> dict[str, float]:
        names = {
            "ABS": abs, "EXP": np.exp, "EXPT": pow,
            **{name: float(value) for name, value in constants.items()}, **inputs,
        }  # fmt: skip
        exec("\n".join(lines), names)  # noqa: S102 - the text is our own
        return names  # type: ignore[return-value]

    return run


def test_structured_text_computes_the_law(exported: Exported) -> None:
    from stickslip.export.c.kernels import friction
    from stickslip.numerics.named_fields import fields_at

    content = exported.content
    fields = fields_at(friction.LAW)(content.law.numbers(content.inertia, content.dead_band))
    run = structured_text((exported.path / "stickslip_law.st").read_text())
    for v in (-2.0, -0.01, -1e-5, 0.0, 1e-5, 0.01, 3.0):
        found = run(velocity=v, referenceVelocity=v, referenceAcceleration=0.7)
        assert found["force"] == pytest.approx(friction.friction_force(fields, v), rel=1e-14)
        assert found["effort"] == pytest.approx(friction.feedforward(fields, v, 0.7), rel=1e-14)


# --- float in a closed loop ---

SHIM = """
#include "stickslip_pulses.h"
static stickslip_pulses_state_t state;
void begin(double target);
int step(double t, double x, double v, double *effort);
void begin(double target) {
    stickslip_pulses_init(&stickslip_pulses, &state);
    (void)stickslip_pulses_retarget(&stickslip_pulses, &state, (stickslip_real)target);
}
int step(double t, double x, double v, double *effort) {
    const stickslip_sample_t sample = {(stickslip_real)t, (stickslip_real)x, (stickslip_real)v,
        STICKSLIP_NAN, STICKSLIP_NAN};
    stickslip_real f = STICKSLIP_REAL(0.0);
    (void)stickslip_pulses_step(&stickslip_pulses, &state, &sample, &f);
    *effort = (double)f;
    return (int)state.motion.outcome;
}
"""
REACHED = 1  # outcome


def positions(exported: Exported, precision: str, axes: int, samples: int) -> list[float]:
    """Return the final errors of random axes that exported code moves; infinite if it stopped."""
    (exported.path / "shim.c").write_text(SHIM)
    library = f"./pulses_{precision}.so"
    exported.run(
        COMPILERS[0], *STRICT, "-O2", f"-DSTICKSLIP_{precision}", "-Isrc", "-shared", "-fPIC",
        "shim.c", "src/stickslip_pulses.c", "src/stickslip_pulses_config.c", "-o", library, "-lm",
    )  # fmt: skip
    code = ctypes.CDLL(str(exported.path / library))
    code.begin.argtypes = [ctypes.c_double]
    code.step.argtypes = [ctypes.c_double] * 3 + [ctypes.POINTER(ctypes.c_double)]
    controller = exported.content.controller
    assert controller.friction is not None
    rng = np.random.default_rng(11)
    law, T = controller.friction, controller.sampling_time
    errors: list[float] = []
    for _ in range(axes):
        scale = rng.uniform(0.8, 1.4, 3)
        friction = CoulombViscousFriction.symmetric(
            coulomb_friction=scale[0] * law.coulomb_friction_positive,
            static_friction=1.1 * scale[0] * law.coulomb_friction_positive,
            viscous_friction=scale[1] * law.viscous_friction_positive,
        )
        axis = SingleMass(mass=scale[2] * (controller.mass or 1.0), friction=friction)
        model, moving = kernel_model(axis, T), initial_kernel_state(axis, None)
        target = 1e4 * controller.tolerance * rng.uniform(0.3, 1.0)
        code.begin(target)
        effort, outcome = ctypes.c_double(0.0), 0
        for k in range(samples):
            outcome = code.step(k * T, moving[0], moving[1], ctypes.byref(effort))
            moving, _ = mass_step(model, moving, effort.value)
        errors.append(abs(target - moving[0]) if outcome == REACHED else np.inf)
    return errors


@pytest.mark.slow
@needs_compiler
def test_the_controller_positions_in_float_as_in_double(exported: Exported) -> None:
    """Not the efforts but the outcomes are the same: within the tolerance on every axis."""
    tolerance = exported.content.controller.tolerance  # type: ignore[union-attr]
    for precision in ("DOUBLE", "FLOAT"):
        errors = positions(exported, precision, axes=12, samples=4000)
        assert max(errors) <= 1.01 * tolerance, precision
