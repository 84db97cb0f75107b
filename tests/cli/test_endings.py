"""Exit of the program: as a process, when it is interrupted, and with closed streams."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from stage_log import Run

from stickslip import __version__

PROGRAM = (sys.executable, "-m", "stickslip")


NOTICE = "compiling the kernels"
"""Printed by the first process that uses them, so it may stand before what is tested."""


def without_notice(text: str) -> list[str]:
    return [line for line in text.splitlines() if NOTICE not in line]


def process(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False
    )


def interrupt(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


def terminate(*_: object, **__: object) -> None:
    os.kill(os.getpid(), signal.SIGTERM)


@pytest.mark.slow
def test_process_identifies_a_log(good_log: Path) -> None:
    outcome = process("identify", good_log, "--json", "-")
    assert outcome.returncode == 0, outcome.stderr
    assert json.loads(outcome.stdout)["status"] == "ok"


def test_process_refuses_in_one_line(tmp_path: Path) -> None:
    outcome = process("identify", tmp_path / "no.csv")
    assert outcome.returncode == 2
    assert outcome.stdout == ""
    assert len(outcome.stderr.splitlines()) == 1
    assert "no such file" in outcome.stderr


@pytest.mark.parametrize("arguments", [["--json", "-"], pytest.param([], marks=pytest.mark.slow)])
def test_closed_pipe_is_no_error(arguments: list[str], good_log: Path) -> None:
    running = subprocess.Popen(
        [*PROGRAM, "identify", str(good_log), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    running.stdout.close()
    messages = running.stderr.read()
    running.stderr.close()
    assert running.wait(timeout=120) == 0
    for word in ("Traceback", "Broken", "Exception"):
        assert word not in messages
    assert not [line for line in without_notice(messages) if line.startswith("stickslip: ")]


def test_closed_pipe_of_the_help_is_no_error() -> None:
    running = subprocess.Popen([*PROGRAM, "--help"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    running.stdout.close()
    _, messages = running.communicate(timeout=120)
    assert (running.returncode, messages) == (0, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full on this system")
def test_full_standard_output_is_an_error(good_log: Path) -> None:
    with Path("/dev/full").open("w") as full:
        outcome = subprocess.run(
            [*PROGRAM, "identify", str(good_log)],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=120,
            check=False,
        )
    assert outcome.returncode == 2
    (line,) = without_notice(outcome.stderr)
    assert "No space left" in line


@pytest.mark.parametrize(
    ("signalled", "code", "word"), [(interrupt, 130, "interrupted"), (terminate, 143, "terminated")]
)
@pytest.mark.parametrize("task", ["identification.identified", "compare_log", "excite"])
def test_signal_ends_with_one_line_and_no_file(
    task: str,
    signalled: Callable[[], None],
    code: int,
    word: str,
    run: Run,
    good_log: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(f"stickslip.tasks.{task}", signalled)
    written = good_log.with_suffix(".json")
    limits = ("--effort-limit", 1, "--duration", 1, "--sampling-time", 0.1)
    command = ("compare" if task == "compare_log" else "identify", good_log, "--json")
    if task == "excite":
        command = ("excite", *limits, "--out")
    outcome = run(*command, written)
    assert outcome.code == code
    assert word in outcome.line()
    assert list(good_log.parent.iterdir()) == [good_log]
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


@pytest.mark.parametrize("deep", [1, 2])
@pytest.mark.parametrize(
    ("signalled", "code", "word"), [(interrupt, 130, "interrupted"), (terminate, 143, "terminated")]
)
def test_signal_inside_a_compiled_call(
    signalled: Callable[[], None],
    code: int,
    word: str,
    deep: int,
    run: Run,
    good_log: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # CPython makes a SystemError of a function that returns a result with an exception set, whose
    # cause is that exception: here what the handler of the signal raised
    def step(*_: object, **__: object) -> None:
        try:
            signalled()
        except KeyboardInterrupt as error:
            behind: BaseException = error
            for _level in range(deep):
                outer = SystemError("returned a result with an exception set")
                outer.__cause__ = behind
                behind = outer
            raise behind from behind.__cause__

    monkeypatch.setattr("stickslip.tasks.identification.identified", step)
    outcome = run("identify", good_log, "--json", good_log.with_suffix(".json"))
    assert outcome.code == code
    assert word in outcome.line()
    assert list(good_log.parent.iterdir()) == [good_log]


@pytest.mark.parametrize("behind", [None, ValueError("of another kind")])
@pytest.mark.parametrize("error", [SystemError, ZeroDivisionError])
def test_defect_does_not_look_like_a_result(
    error: type[Exception],
    behind: Exception | None,
    run: Run,
    good_log: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error("in the depths") from behind

    monkeypatch.setattr("stickslip.tasks.identification.identified", fail)
    outcome = run("identify", good_log)
    assert (outcome.code, outcome.out) == (70, "")
    assert "Traceback" in outcome.err
    assert f"{error.__name__}: in the depths" in outcome.err
    assert outcome.err.splitlines()[-1].startswith("stickslip: this is a defect")


@pytest.mark.slow
@pytest.mark.parametrize("closed", [(1,), (2,), (0, 1, 2)])
def test_closed_streams_are_no_error(closed: tuple[int, ...], good_log: Path) -> None:
    report = good_log.with_suffix(".json")
    redirected = " ".join(f"{descriptor}>&-" for descriptor in closed)
    command = f'"$0" -m stickslip identify "$1" --json "$2" {redirected}'
    outcome = subprocess.run(
        ["/bin/sh", "-c", command, sys.executable, str(good_log), str(report)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert outcome.returncode == 0
    assert without_notice(outcome.stderr) == []
    assert json.loads(report.read_text())["status"] == "ok"


def test_version(run: Run) -> None:
    outcome = run("--version")
    assert (outcome.code, outcome.out.strip()) == (0, __version__)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["identify", "demo", "data", "Exit codes"]),
        (["--help"], ["identify", "demo", "data", "Exit codes"]),
        (["identify", "--help"], ["--schema", "--report", "--json", "Examples:", "kg m²"]),
        (["demo", "--help"], ["--out", "demo-output", "--seed", "Example:"]),
        (["data", "--help"], ["emps", "STICKSLIP_DATA"]),
    ],
)
def test_help(arguments: list[str], words: list[str], run: Run) -> None:
    outcome = run(*arguments)
    assert (outcome.code, outcome.err) == (0, "")
    for word in words:
        assert word in outcome.out


def test_help_and_a_wrong_path_load_no_numbers() -> None:
    """NumPy takes longer to load than all else of the help, or of the path."""
    code = "import sys; from stickslip.cli import main; main(sys.argv[1:]); print(*sys.modules)"
    logs = [[command, "absent.csv"] for command in ("identify", "inspect", "compare")]
    scenarios = [[command, "absent.toml"] for command in ("position", "compare")]
    design = ["--effort-limit", "1", "--duration", "1", "--sampling-time", "0.1", "--out", "a.csv"]
    estimate = ["excite", "--estimate", "absent.json", *design]
    helps = (["--help"], ["identify", "--help"], ["inspect", "--help"])
    for arguments in (*helps, *logs, *scenarios, estimate):
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
        )
        assert "numpy" not in done.stdout.splitlines()[-1].split()
