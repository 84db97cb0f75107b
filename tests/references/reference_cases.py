"""The stored reference cases: how they are defined, written and read.

A `Case` holds the problem in floats, which the reference takes as the exact binary numbers they
are. Efforts are stored as runs (value, number of samples).
"""

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path

FOLDER = Path(__file__).parent
STORED_DIGITS = 30


@dataclass(frozen=True, kw_only=True)
class Case:
    """One run of one plant."""

    name: str
    about: str
    plant: dict[str, float]
    """mass, or mass_1, mass_2 and stiffness."""
    coulomb: tuple[float, float]
    """For the positive and the negative direction; so are the next two."""
    static: tuple[float, float]
    viscous: tuple[float, float]
    offset: float = 0.0
    sampling_time: float
    initial_state: tuple[float, ...]
    effort_runs: tuple[tuple[float, int], ...]
    kept: int = 12
    """About how many states are stored."""
    exact_tie: bool = False
    """The case rests on an exact equality, which any perturbation breaks."""

    @property
    def effort(self) -> list[float]:
        """Effort of each sample."""
        return [value for value, count in self.effort_runs for _ in range(count)]

    @property
    def kept_samples(self) -> list[int]:
        """Indexes of the stored states: evenly spaced, the last one always."""
        n = len(self.effort)
        step = max(1, -(-n // self.kept))
        return sorted({*range(step, n, step), n})


@dataclass(frozen=True, kw_only=True)
class StoredRun:
    """A case with what the reference found."""

    case: Case
    states: dict[int, tuple[str, ...]]
    """By sample: the state with 30 digits."""
    at_rest: dict[int, bool]
    """By sample: whether the (first) mass is at rest there."""
    events: dict[str, int]
    """How often each kind happened."""
    hidden: int
    """Samples whose stop cannot be seen from their ends (double crossings)."""
    largest_position: float
    largest_velocity: float
    """Largest magnitudes over all samples and both masses."""
    amplification: float | None
    """How many times a relative error in the efforts and masses shows in the states."""


def runs_of(effort: Iterable[float]) -> tuple[tuple[float, int], ...]:
    """Join equal neighbours."""
    return tuple((value, len(list(group))) for value, group in groupby(effort))


def write(path: Path, command: str, runs: Iterable[StoredRun]) -> None:
    """Write runs as JSON, one line a run."""
    lines = []
    for run in runs:
        record = asdict(run)
        record["states"] = [[str(k), *state] for k, state in run.states.items()]
        record["at_rest"] = "".join("01"[flag] for flag in run.at_rest.values())
        lines.append(json.dumps(record, separators=(",", ":")))
    head = json.dumps({"schema": 1, "command": command, "digits": STORED_DIGITS})[:-1]
    path.write_text(head + ', "runs": [\n' + ",\n".join(lines) + "\n]}\n")


def read(name: str) -> list[StoredRun]:
    """Read ``name``.json from this folder."""
    runs = []
    for record in json.loads((FOLDER / f"{name}.json").read_text())["runs"]:
        case = record["case"]
        for key in ("coulomb", "static", "viscous", "initial_state"):
            case[key] = tuple(case[key])
        case["effort_runs"] = tuple((value, count) for value, count in case["effort_runs"])
        states = {int(k): tuple(state) for k, *state in record["states"]}
        at_rest = {k: flag == "1" for k, flag in zip(states, record["at_rest"], strict=True)}
        runs.append(
            StoredRun(**{**record, "case": Case(**case), "states": states, "at_rest": at_rest})
        )
    return runs
