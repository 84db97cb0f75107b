"""Damaged logs: ``python -m benchmarks.fuzzing [--mutations N]`` damages samples of every format.

Each damaged file is read whole, in a process of limited time and memory. A refusal is an
`InputError` of one line; anything else that is not a log is counted as a fault.
"""

import importlib
import multiprocessing
import os
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import App, Parameter

from stickslip.errors import StickslipError
from stickslip.logs import opening, read_log
from stickslip.logs.formats.registry import FORMATS
from stickslip.logs.isolation import limit_this_process, memory_limit, read_guarded

_SECONDS = 10.0  # of the processor: others may use the machine
_BYTES = 1_000_000_000
_AT_ONCE = 200
"""Files that one process reads: a process for each takes longer than to read it."""

_LIBRARIES = (
    "pyarrow.parquet",
    "scipy.io",
    "h5py",
    "matio",
    "rosbags.highlevel",
    "mcap.reader",
    "mcap_protobuf.decoder",
    "nptdms",
    "asammdf",
    "pint",
    "narwhals",
)

_READ, _REFUSED, _FAULT = b"r", b"-", b"!"
_MEANING = b"0-+eE.,;:\t \n\"'#{}[]\0"
_EXTREMES = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40, (1 << 64) - 1)

app = App(name="python -m benchmarks.fuzzing", help="Read damaged logs of every format.")


@dataclass
class Outcome:
    """Numbers of files by their outcome."""

    counts: Counter[str] = field(default_factory=Counter[str])
    faults: list[str] = field(default_factory=list[str])  #: Sample and number of each.
    crashes: Counter[str] = field(
        default_factory=Counter[str]
    )  #: By sample; read apart, so refused.
    stopped: Counter[str] = field(default_factory=Counter[str])  #: By sample; read apart too.
    largest: int = 0  #: Memory of a process [bytes].
    slowest: float = 0.0  #: Time of the processor for a file [s].


def damaged(content: bytes, others: list[bytes], generator: np.random.Generator) -> bytes:
    """Return a file with one to four damages."""
    data = bytearray(content)
    for _ in range(int(generator.integers(1, 5))):
        if not data:
            break
        place = int(generator.integers(len(data)))
        length = int(min(len(data) - place, 2 ** generator.integers(0, 9)))
        match int(generator.integers(8)):
            case 0:  # one bit
                data[place] ^= 1 << int(generator.integers(8))
            case 1:  # random bytes
                data[place : place + length] = generator.bytes(length)
            case 2:  # cut short
                del data[place:]
            case 3:  # a hole
                del data[place : place + length]
            case 4:  # a repetition
                data[place:place] = data[place : place + length]
            case 5:  # an extreme number
                value = _EXTREMES[int(generator.integers(len(_EXTREMES)))]
                size = int(generator.choice([1, 2, 4, 8]))
                raw = (value & ((1 << 8 * size) - 1)).to_bytes(size, "little")
                data[place : place + size] = raw if generator.random() < 0.7 else raw[::-1]
            case 6:  # a piece of another file
                other = others[int(generator.integers(len(others)))]
                start = int(generator.integers(max(1, len(other))))
                data[place : place + length] = other[start : start + length]
            case _:  # a byte that means something in text
                data[place] = _MEANING[int(generator.integers(len(_MEANING)))]
    return bytes(data)


def _read(path: Path) -> bytes:
    """Return what becomes of one file."""
    try:
        table, _, _ = opening.open_log(path, {}, "")
        columns = table.load(list(table.headers))
        for name in list(columns)[:2]:
            if columns[name].size:
                table.place(name, columns[name].size - 1)
    except StickslipError as error:
        return _FAULT if "\n" in str(error) else _REFUSED
    except Exception:  # noqa: BLE001 - this is what is looked for
        return _FAULT
    try:
        read_log(path)
    except StickslipError as error:
        return _FAULT if "\n" in str(error) else _READ
    except Exception:  # noqa: BLE001
        return _FAULT
    return _READ


def _child(pipe: int, numbers: range, samples: Mapping[str, bytes], seed: int) -> None:
    """Read damaged files one after another, and write what became of each to a pipe."""
    warnings.simplefilter("ignore")
    silent = os.open(os.devnull, os.O_RDWR)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    limit_this_process(memory_limit(max(map(len, samples.values()))))
    names, contents = list(samples), list(samples.values())
    # The limits of this process stand for those of the process that reads apart.
    opening.read_apart = read_guarded
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            generator = np.random.default_rng([seed, number])
            name = names[number % len(names)]
            path = Path(folder, name)
            path.write_bytes(damaged(samples[name], contents, generator))
            signal.setitimer(signal.ITIMER_PROF, _SECONDS)
            # One that waits for ever; on a busy machine others take 60 s for a second of their own
            signal.setitimer(signal.ITIMER_REAL, 30 * _SECONDS)
            begin = time.process_time()
            outcome = _read(path)
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            spent = min(255, int((time.process_time() - begin) * 20))
            os.write(pipe, outcome + bytes([spent]))


def fuzz(samples: Mapping[str, bytes], mutations: int, seed: int) -> Iterator[Outcome]:
    """Read damaged files of samples; yield the outcome so far after each group of them.

    The endings of the names say the formats. File ``k`` is the same whatever the number of files.
    """
    os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for library in _LIBRARIES:  # once, not in each process
            importlib.import_module(library)
    outcome = Outcome()
    names = list(samples)
    text = {name for name in names if not FORMATS.get(Path(name).suffix, FORMATS[".csv"]).apart}
    begin = 0
    while begin < mutations:
        end = min(mutations, begin + _AT_ONCE)
        receiving, sending = os.pipe()
        process = os.fork()
        if process == 0:
            try:
                os.close(receiving)
                _child(sending, range(begin, end), samples, seed)
            finally:
                os._exit(0)
        os.close(sending)
        with os.fdopen(receiving, "rb") as pipe:
            answers = pipe.read()
        _, status, usage = os.wait4(process, 0)
        outcome.largest = max(outcome.largest, usage.ru_maxrss * 1024)
        done = len(answers) // 2
        for k in range(done):
            result, spent = answers[2 * k : 2 * k + 1], answers[2 * k + 1] / 20
            outcome.slowest = max(outcome.slowest, spent)
            outcome.counts[{_READ: "read", _REFUSED: "refused"}.get(result, "faults")] += 1
            if result == _FAULT:
                outcome.faults.append(f"{names[(begin + k) % len(names)]} {begin + k}")
        begin += done
        if begin < end and os.WIFSIGNALED(status):
            name = names[begin % len(names)]
            late = os.WTERMSIG(status) in {signal.SIGALRM, signal.SIGPROF}
            if os.WTERMSIG(status) == signal.SIGPROF and name not in text:
                # The process that reads apart is ended by its own limit of 8 s, and refused
                outcome.counts["stopped by the limit of time"] += 1
                outcome.stopped[name] += 1
            elif late or name in text:
                outcome.counts["hangs" if late else "faults"] += 1
                outcome.faults.append(f"{name} {begin} (signal {os.WTERMSIG(status)})")
            else:
                outcome.counts["crashes of a library"] += 1
                outcome.crashes[name] += 1
            begin += 1
        elif begin < end and done == 0:
            raise RuntimeError(f"file {begin} cannot be read at all")
        yield outcome


def written(only: str = "") -> dict[str, bytes]:
    """Return the samples of all formats whose name has a text in it."""
    # What the tests write samples with, which is no package
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "factories"))
    from sample_files import EVERY_FILE, motion  # pyright: ignore[reportMissingImports]

    warnings.simplefilter("ignore")
    samples: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, writer in EVERY_FILE.items():
            if only in name:
                writer(Path(folder, name), motion())
                samples[name] = Path(folder, name).read_bytes()
    return samples


@app.default
def run(
    *,
    mutations: int = 10_000,
    seed: int = 1,
    only: Annotated[str, Parameter(help="Samples whose name has this in it.")] = "",
    write: Annotated[int | None, Parameter(help="Write this damaged file and stop.")] = None,
) -> None:
    """Read damaged files of every format.

    Parameters
    ----------
    mutations
        How many files.
    seed
        Of the damages.
    """
    # The libraries that write take memory and threads, which the readers are not to inherit.
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        samples = pool.apply(written, (only,))
    if write is not None:
        name = list(samples)[write % len(samples)]
        generator = np.random.default_rng([seed, write])
        Path(name).write_bytes(damaged(samples[name], list(samples.values()), generator))
        print(f"wrote {name}")
        return
    begin = time.perf_counter()
    outcome, known = Outcome(), 0
    for number, outcome in enumerate(fuzz(samples, mutations, seed), 1):
        for fault in outcome.faults[known:]:
            print(f"fault: {fault}", file=sys.stderr)
        known = len(outcome.faults)
        if number % 200 == 0:
            print(f"{sum(outcome.counts.values())}: {dict(outcome.counts)}", file=sys.stderr)
    print(f"{sum(outcome.counts.values())} files of {len(samples)} samples, seed {seed}")
    print(f"in {time.perf_counter() - begin:.0f} s: {dict(outcome.counts)}")
    print(f"largest process {outcome.largest / 1e6:.0f} MB, slowest file {outcome.slowest:.1f} s")
    print(f"crashes of a library by sample: {dict(outcome.crashes)}")
    print(f"stopped by the limit of time by sample: {dict(outcome.stopped)}")
    for fault in outcome.faults:
        print(f"fault: {fault}")
    if outcome.faults or outcome.largest > _BYTES:
        raise SystemExit(1)


if __name__ == "__main__":
    app()
