"""Functional mock-up units: validated and simulated by FMPy, and compared with Python."""

import io
import os
import platform
import re
import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from exports import COULOMB, INERTIA, VISCOUS, document
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from refusals import refuses

from stickslip import CoulombViscousFriction, FlexibleArm, SingleMass, simulate
from stickslip.errors import MissingExtraError
from stickslip.estimation import EnergyEstimator
from stickslip.export import ExportSettings, render

EQUAL = 1e-14  # of the largest value of an output: functions of the mathematical library
T = 0.002
STATIC, OFFSET, LOAD, STIFFNESS = 0.6, 0.03, 0.02, 5.0
TARGETS = ("fmu", "fmu-arm", "fmu-observer")
VERSIONS = ("2.0", "3.0")
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=COULOMB, static_friction=STATIC, viscous_friction=VISCOUS, offset=OFFSET
)
PLANTS: dict[str, tuple[Any, tuple[float, ...]]] = {
    "fmu": (SingleMass(mass=INERTIA, friction=LAW, kind="rotary"), (0.1, -2.0)),
    "fmu-arm": (
        FlexibleArm(
            mass_1=INERTIA - LOAD, mass_2=LOAD, stiffness=STIFFNESS, friction=LAW, kind="rotary"
        ),
        (0.1, -2.0, 0.05, 1.0),
    ),
}
COMPILER = shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(
    COMPILER is None or platform.system() != "Linux" or platform.machine() != "x86_64",
    reason="no C compiler is found, or the folder of its binaries is another",
)
needs_ziglang = pytest.mark.skipif(find_spec("ziglang") is None, reason="ziglang is not installed")
HEADERS = Path(fmpy.__file__).parent / "c-code"
STRICT = (
    *("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wconversion", "-Werror"),
    "-Wno-unused-parameter",  # of functions of the interface
)


def unit(
    target: str, version: str, binaries: str = "none", estimate: Any = None, **settings: Any
) -> bytes:
    extra = {"load_inertia": LOAD, "stiffness": STIFFNESS} if target == "fmu-arm" else {}
    result = render(
        document(static_friction=STATIC, offset=OFFSET) if estimate is None else estimate,
        target,
        joint="elbow",
        settings=ExportSettings(
            **{"fmi_version": version, "binaries": binaries, "sampling_time": T} | extra | settings
        ),
    )
    content = result.rendered.files[""]
    assert isinstance(content, bytes)
    return content


def extract(content: Any, folder: Path) -> None:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder)


class Instance:
    """A unit compiled from its sources and instantiated by FMPy, by the names of its variables."""

    def __init__(self, content: bytes, folder: Path) -> None:
        extract(content, folder)
        self.description = fmpy.read_model_description(str(folder))
        version, name = self.description.fmiVersion, self.description.coSimulation.modelIdentifier
        where = folder / "binaries" / ("linux64" if version == "2.0" else "x86_64-linux")
        if not where.exists():
            where.mkdir(parents=True)
            command = [str(COMPILER), *STRICT, "-DFMI3_OVERRIDE_FUNCTION_PREFIX", "-shared"]
            command += ["-fPIC", "fmi.c", "-o", str(where / f"{name}.so"), "-lm"]
            subprocess.run(command, cwd=folder / "sources", check=True)
        self.numbers = {each.name: each.valueReference for each in self.description.modelVariables}
        made: Any = FMU2Slave if version == "2.0" else FMU3Slave
        self.unit = made(
            guid=self.description.guid, unzipDirectory=str(folder), modelIdentifier=name
        )
        self.second = version == "2.0"
        self.unit.instantiate()

    def begin(self, **first: float) -> "Instance":
        self.set(**first)
        if self.second:
            self.unit.setupExperiment(startTime=0.0)
            self.unit.enterInitializationMode()
        else:
            self.unit.enterInitializationMode(startTime=0.0)
        self.unit.exitInitializationMode()
        return self

    def set(self, **values: float) -> None:
        set_values = self.unit.setReal if self.second else self.unit.setFloat64
        set_values([self.numbers[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        get_values = self.unit.getReal if self.second else self.unit.getFloat64
        return list(get_values([self.numbers[name] for name in names]))

    def step(self, time: float, interval: float) -> None:
        self.unit.doStep(time, interval)

    def end(self) -> None:
        self.unit.terminate()
        self.unit.freeInstance()


@pytest.fixture(params=VERSIONS)
def version(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.parametrize("target", TARGETS)
def test_the_description_is_valid_by_schema_and_structure(target: str, version: str) -> None:
    """FMPy reads it against the schema of the standard."""
    for estimate in (
        document(),
        document("linear"),
        document(
            coulomb_friction="absent", coulomb_friction_positive=0.6, coulomb_friction_negative=0.4
        ),
    ):
        content = unit(target, version, estimate=estimate)
        assert validate_fmu(io.BytesIO(content)) == []  # type: ignore[arg-type]


def test_names_that_are_special_in_xml_and_c_are_kept_apart(version: str, tmp_path: Path) -> None:
    estimate = document()
    estimate["provenance"]["files"] = ['a"<&>*/ \x01.csv']
    result = render(
        estimate,
        "fmu",
        joint='5 <"&\n',
        settings=ExportSettings(fmi_version=version, binaries="none"),
    )
    content = result.rendered.files[""]
    assert validate_fmu(io.BytesIO(content)) == []  # type: ignore[arg-type]
    extract(content, tmp_path)
    for path in (tmp_path / "sources").glob("*.[ch]"):
        assert "*/ \x01" not in path.read_text()


def test_constants_and_units_are_in_the_description(version: str) -> None:
    content = unit("fmu-arm", version)
    description = fmpy.read_model_description(io.BytesIO(content))  # type: ignore[arg-type]
    found = {each.name: each for each in description.modelVariables}
    for name, value, its_unit in (
        ("inertia", INERTIA - LOAD, "kg m^2"),
        ("load_inertia", LOAD, "kg m^2"),
        ("stiffness", STIFFNESS, "N m/rad"),
        ("coulomb_friction_positive", COULOMB, "N m"),
        ("viscous_friction_negative", VISCOUS, "N m s/rad"),
        ("sampling_time", T, "s"),
    ):
        assert (float(found[name].start), found[name].unit) == (value, its_unit)
        assert found[name].variability == "constant"
    units = {each.name: each.baseUnit for each in description.unitDefinitions}
    viscous = units["N m s/rad"]
    assert (viscous.kg, viscous.m, viscous.s, viscous.rad) == (1, 2, -1, -1)
    assert "0123456789ab" in description.description


@needs_compiler
def test_the_functions_are_those_of_the_standard(version: str, tmp_path: Path) -> None:
    """With the header of the standard the same definitions compile, and none is missing."""
    extract(unit("fmu", version), tmp_path)
    sources, library = tmp_path / "sources", tmp_path / "unit.so"
    header = [f"-I{HEADERS}", "-DSTICKSLIP_FMI_HEADER", "-DFMI3_OVERRIDE_FUNCTION_PREFIX"]
    command = [str(COMPILER), *STRICT, *header, "-shared", "-fPIC", "fmi.c", "-o", str(library)]
    subprocess.run([*command, "-lm"], cwd=sources, check=True)
    listed = subprocess.run(
        ["nm", "-D", "--defined-only", str(library)],  # noqa: S607
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    text = (HEADERS / f"fmi{version[0]}Functions.h").read_text()
    # Version 2.0 separates the functions of co-simulation from those of model exchange
    before, _, after = text.partition("FMI2 for Model Exchange")
    text = before + after.partition("FMI2 for Co-Simulation")[2]
    wanted = set(re.findall(rf"FullName\((fmi{version[0]}\w+)\)", text))
    assert len(wanted) > 20
    assert wanted <= set(re.findall(r" T (\w+)", listed))


@needs_compiler
def test_two_units_are_linked_to_one_program(tmp_path: Path) -> None:
    """As sources, names are the unit's own."""
    for name in ("one", "two"):
        extract(unit("fmu-observer", "3.0"), tmp_path / name)
        sources = tmp_path / name / "sources"
        for path in sources.glob("*.c"):
            path.write_text(path.read_text().replace("elbow_observer", f"{name}_observer"))
        command = [str(COMPILER), "-c", "-fPIC", "-O0", "fmi.c", "-o", str(tmp_path / f"{name}.o")]
        subprocess.run(command, cwd=sources, check=True)
    both = [str(COMPILER), "-shared", "one.o", "two.o", "-o", "both.so", "-lm"]
    subprocess.run(both, cwd=tmp_path, check=True)


@needs_compiler
@pytest.mark.parametrize("target", list(PLANTS))
def test_a_plant_moves_as_in_python(target: str, version: str, tmp_path: Path) -> None:
    plant, first = PLANTS[target]
    effort = np.repeat(np.random.default_rng(5).normal(0.0, 1.0, 150), 10)
    truth = simulate(plant, effort, sampling_time=T, initial_state=first)
    names = plant.state_names
    expected = np.column_stack([getattr(truth, name) for name in names])
    instance = Instance(unit(target, version), tmp_path).begin(
        **{f"initial_{name}": value for name, value in zip(names, first, strict=True)}
    )
    found = [instance.get(*names)]
    for k in range(0, effort.size, 10):
        # Ten samples of one effort, in one communication step or in ten
        instance.set(effort=float(effort[k]))
        for j in range(10) if k % 20 else (0,):
            instance.step((k + j) * T, T if k % 20 else 10 * T)
        found.append(instance.get(*names))
    expected = expected[::10]
    moves = np.abs(np.diff(expected[:, 0])) > 0.0
    assert 0 < np.count_nonzero(moves) < moves.size, "it sticks and slips"
    errors = np.abs(np.array(found) - expected) / np.max(np.abs(expected), axis=0)
    assert np.max(errors) <= EQUAL
    instance.end()


@needs_compiler
def test_the_observer_estimates_as_in_python(version: str, tmp_path: Path) -> None:
    plant, _ = PLANTS["fmu"]
    rng = np.random.default_rng(3)
    k = np.arange(900)
    effort = 1.5 * np.sin(0.02 * k) + 0.4 * np.sin(0.053 * k + 1.0)
    truth = simulate(plant, effort, sampling_time=T)
    position = truth.position[:-1] + rng.normal(0.0, 1e-5, k.size)
    position[[200, 201]] = np.nan
    effort[500] = np.nan
    estimator = EnergyEstimator(inertia=INERTIA)
    state = estimator.init(sampling_time=T, velocity_measured=False)
    names = estimator.parameter_names("rotary")
    instance = Instance(unit("fmu-observer", version), tmp_path).begin()
    for j in k.tolist():
        state, expected = estimator.step(state, (effort[j], position[j], 0.0, 0.0, 0.0))
        instance.set(effort=effort[j], position=position[j])
        instance.step(j * T, T)
        np.testing.assert_allclose(instance.get(*names), expected, rtol=EQUAL)
    found = dict(zip(names, instance.get(*names), strict=True))
    assert found["coulomb_friction"] == pytest.approx(COULOMB, rel=0.1)
    health = estimator.health(state)
    assert health.missing_samples == 3
    assert instance.get("missing_samples", "resets") == [3.0, float(health.resets)]
    assert 0.0 < instance.get("coulomb_friction_deviation")[0] < 0.1 * COULOMB
    with pytest.raises(FMICallException):
        instance.step(k.size * T, 2 * T)  # of one position
    instance.end()


@needs_compiler
def test_a_saved_state_goes_on_as_before(version: str, tmp_path: Path) -> None:
    instance = Instance(unit("fmu", version), tmp_path).begin(initial_velocity=3.0)
    instance.set(effort=0.2)
    instance.step(0.0, 20 * T)
    fmu, second = instance.unit, instance.second
    saved = fmu.getFMUstate() if second else fmu.getFMUState()
    raw = fmu.serializeFMUstate(saved) if second else fmu.serializeFMUState(saved)
    instance.step(20 * T, 30 * T)
    once = instance.get("position", "velocity")
    again = fmu.deSerializeFMUstate(raw) if second else fmu.deserializeFMUState(raw)
    (fmu.setFMUstate if second else fmu.setFMUState)(again)
    instance.step(20 * T, 30 * T)
    assert instance.get("position", "velocity") == once
    for each in (saved, again):
        (fmu.freeFMUstate if second else fmu.freeFMUState)(each)
    fmu.reset()
    assert instance.get("position", "velocity", "initial_velocity") == [0.0, 0.0, 0.0]
    instance.end()


@needs_compiler
def test_wrong_calls_are_errors(
    version: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    instance = Instance(unit("fmu", version), tmp_path)
    with pytest.raises(FMICallException):
        instance.set(initial_position=np.nan)
    instance.begin(initial_position=0.25)
    assert instance.get("position") == [0.25]
    for name in ("initial_position", "position", "inertia", "time"):
        with pytest.raises(FMICallException):
            instance.set(**{name: 1.0})
    for interval in (0.0, -T, 0.5 * T, 1.001 * T, 1e300, np.nan):
        with pytest.raises(FMICallException):
            instance.step(0.0, interval)
    instance.step(0.0, (1.0 + 1e-9) * 3 * T)
    instance.set(effort=np.inf)
    with pytest.raises(FMICallException):
        instance.step(3 * T, T)
    instance.set(effort=0.0)
    with pytest.raises(FMICallException):
        instance.step(3 * T, T)  # its motion is lost
    instance.end()
    printed = capfd.readouterr().out
    assert f"a whole number of samples of {T} s" in printed
    assert "cannot be set now" in printed


@needs_compiler
def test_a_unit_of_another_description_is_not_instantiated(version: str, tmp_path: Path) -> None:
    description = tmp_path / "modelDescription.xml"
    instance = Instance(unit("fmu", version), tmp_path)
    instance.unit.freeInstance()
    made: Any = FMU2Slave if instance.second else FMU3Slave
    other = made(guid="{0}", unzipDirectory=str(description.parent), modelIdentifier="elbow_axis")
    with pytest.raises(Exception, match="instantiate"):
        other.instantiate()


# --- what is refused ---


@pytest.mark.parametrize("target", TARGETS)
def test_an_estimate_without_inertia_is_refused(target: str) -> None:
    with refuses("fmu_without_inertia" if target != "fmu-observer" else "nothing_to_write"):
        unit(target, "2.0", estimate=document(inertia="absent"))


@pytest.mark.parametrize("load", [0.0, -0.01, INERTIA, np.nan])
def test_the_load_is_a_part_of_the_inertia(load: float) -> None:
    with refuses("load_of_whole_inertia", name="load_inertia", limit=INERTIA):
        unit("fmu-arm", "3.0", load_inertia=load)


def test_a_spring_without_stiffness_and_a_long_sample_are_refused() -> None:
    with refuses("not_positive", name="stiffness"):
        unit("fmu-arm", "3.0", stiffness=0.0)
    with refuses("not_positive", name="sampling_time"):
        unit("fmu", "3.0", sampling_time=-1.0)
    with refuses("arm_too_stiff"):
        unit("fmu-arm", "3.0", stiffness=1e15)


def test_binaries_need_ziglang(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stickslip.export.fmu.binaries.find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"stickslip\[fmu\]"):
        unit("fmu", "2.0", binaries="all")
    unit("fmu", "2.0", binaries="none")


def test_a_host_without_a_folder_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    with refuses("fmu_host_unknown", version="3.0"):
        unit("fmu", "3.0", binaries="host")


# --- binaries ---

MAGIC = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}


@needs_ziglang
@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "version"), [("fmu", "2.0"), *((target, "3.0") for target in TARGETS)]
)
def test_binaries_of_all_platforms_are_built_alike(
    target: str, version: str, tmp_path: Path
) -> None:
    """Every model and both interfaces; the platforms of version 2.0 are some of the others."""
    content = unit(target, version, "all")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        built = [name for name in archive.namelist() if name.startswith("binaries/")]
        for name in built:
            magic = MAGIC[Path(name).suffix]
            assert archive.read(name).startswith(magic)
    expected = {
        "2.0": {"linux64", "win64", "darwin64"},
        "3.0": {
            *("x86_64-linux", "x86_64-windows", "x86_64-darwin"),
            *("aarch64-linux", "aarch64-darwin"),
        },
    }[version]
    assert {name.split("/")[1] for name in built} == expected
    if target == "fmu":
        assert content == unit(target, version, "all")
    path = tmp_path / "unit.fmu"
    path.write_bytes(content)
    assert validate_fmu(str(path)) == []


@needs_ziglang
@pytest.mark.slow
@pytest.mark.parametrize("target", list(PLANTS))
def test_the_binary_of_this_platform_is_simulated(
    target: str, version: str, tmp_path: Path
) -> None:
    """By a whole simulation of FMPy, from a file of the command line's kind."""
    path = tmp_path / "unit.fmu"
    path.write_bytes(unit(target, version, "host"))
    plant, _ = PLANTS[target]
    times = np.arange(200) * T
    effort = np.where(times < 0.2, 1.0, -0.9)
    given = np.array(
        list(zip(times, effort, strict=True)), dtype=[("time", "f8"), ("effort", "f8")]
    )
    found = fmpy.simulate_fmu(
        str(path), stop_time=200 * T, output_interval=T, input=given, output=list(plant.state_names)
    )
    truth = simulate(plant, effort, sampling_time=T)
    for name in plant.state_names:
        expected = getattr(truth, name)
        error = np.max(np.abs(found[name] - expected))
        assert error <= EQUAL * np.max(np.abs(expected))


WINE = shutil.which("wine64") or shutil.which("wine")
OUTPUTS = {
    "fmu": ("position", "velocity"),
    "fmu-arm": ("position", "velocity", "load_position", "load_velocity"),
    "fmu-observer": ("coulomb_friction", "viscous_friction"),
}


@pytest.fixture(scope="module")
def windows_host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a program for Windows that steps a unit."""
    if WINE is None or find_spec("ziglang") is None:
        pytest.skip("wine or ziglang is not installed")
    program = tmp_path_factory.mktemp("host") / "host.exe"
    command = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-O1"]
    source = Path(__file__).with_name("fmu_host.c")
    subprocess.run([*command, f"-I{HEADERS}", str(source), "-o", str(program)], check=True)
    return program


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_the_windows_binary_computes_as_that_of_linux(
    target: str,
    version: str,
    windows_host: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Run by wine, beside the unit that the compiler of this machine builds."""
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(platform, "system", lambda: "Windows")
        content = unit(target, version, "host")
    folders = [tmp_path / "windows", tmp_path / "linux"]
    extract(content, folders[0])
    (library,) = folders[0].glob("binaries/*/*.dll")
    linux = Instance(unit(target, version), folders[1]).begin()
    times = np.arange(3000) * T
    effort = 1.3 * np.sin(3.0 * times) + 0.4 * np.sin(19.0 * times)
    names: tuple[str, ...] = ("effort",)
    given = effort[:, None]
    if target == "fmu-observer":
        names = ("effort", "position")
        motion = simulate(PLANTS["fmu"][0], effort, sampling_time=T)
        given = np.column_stack([effort, motion.position[: effort.size]])
    expected = np.empty((times.size, len(OUTPUTS[target])))
    for k, values in enumerate(given.tolist()):
        linux.set(**dict(zip(names, values, strict=True)))
        linux.step(float(times[k]), T)
        expected[k] = linux.get(*OUTPUTS[target])
    numbers = [str(linux.numbers[name]) for name in (*names, *OUTPUTS[target])]
    counts = [repr(T), str(len(names)), str(len(OUTPUTS[target]))]
    done = subprocess.run(
        [
            *(str(WINE), str(windows_host), str(library), version, linux.description.guid),
            *counts,
            *numbers,
        ],
        input="\n".join(" ".join(f"{value:.17g}" for value in row) for row in given.tolist()),
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "WINEPREFIX": str(windows_host.parent / "wine"), "WINEDEBUG": "-all"},
    )
    linux.end()
    found = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    assert found.shape == expected.shape
    assert np.nanmax(np.abs(expected[-1])) > 0.0
    np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
    assert np.nanmax(np.abs(found - expected) / np.nanmax(np.abs(expected), axis=0)) <= EQUAL
