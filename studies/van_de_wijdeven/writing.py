"""Arguments of every part of the source, and the writing of its files."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from stickslip.outputs import check_output, files_at_once
from stickslip.records import InputError, whole
from stickslip.tasks.json_file import json_text
from studies.van_de_wijdeven.page import picture, reproduction_page
from studies.van_de_wijdeven.records import Reproduction

Progress = Callable[[int, int], None]
"""Called with the number of pieces of work that are done, and of all."""

_LIST_OF_NUMBERS = re.compile(r"\[[-+.\de,\snul]+\]")


@dataclass(frozen=True, kw_only=True)
class Reproduced:
    """A reproduction and where it was written."""

    reproduction: Reproduction  #: The reproduction.
    #: The page and its numbers as JSON.
    page: Path
    numbers: Path
    pictures: tuple[Path, ...]  #: One PNG file a figure.


def counted(progress: Progress, pieces: int) -> Callable[[], None]:
    """Return a function to call after each piece of work, which reports how many are done."""
    done = count(1)
    return lambda: progress(next(done), pieces)


def write_reproduction(
    folder: Path | str,
    name: str,
    compute: Callable[[int, int, Progress], Reproduction],
    *,
    seed: int,
    workers: int | None,
    progress: Progress | None,
) -> Reproduced:
    """Compute a reproduction and write its page, its numbers and its pictures, all or none.

    The folder is made if it is missing; that files can be written there is found out before
    anything is computed. ``name`` is that of the page and of the numbers, without their endings.
    ``compute`` takes the seed, the number of processes (None takes one for each processor) and the
    progress; a bad seed or number is an InputError.
    """
    seed = whole("seed", seed)
    processes = (os.cpu_count() or 1) if workers is None else whole("workers", workers, least=1)
    if not str(folder):
        raise InputError("missing", name="out", unit="")
    place, page, numbers = Path(folder), f"{name}.html", f"{name}.json"
    with files_at_once(place, what="the reproduction") as scratch:
        for each in (page, numbers):
            check_output(place / each, what="the reproduction")
        reproduction = compute(seed, processes, progress or (lambda _done, _all: None))
        drawn = {each.number: picture(each) for each in reproduction.figures}
        for figure in reproduction.figures:
            (scratch / figure.file_name).write_bytes(drawn[figure.number])
        (scratch / numbers).write_text(_numbers(reproduction), encoding="utf-8")
        (scratch / page).write_text(reproduction_page(reproduction, drawn), encoding="utf-8")
    return Reproduced(
        reproduction=reproduction,
        page=place / page,
        numbers=place / numbers,
        pictures=tuple(place / each.file_name for each in reproduction.figures),
    )


def _numbers(reproduction: Reproduction) -> str:
    """Return a reproduction as JSON, each list of numbers on one line."""
    text = json_text(reproduction.to_dict())
    return _LIST_OF_NUMBERS.sub(lambda found: " ".join(found[0].split()), text)
