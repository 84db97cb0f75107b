"""Public data sets: found on this machine, or fetched and checked."""

import hashlib
import logging
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from stickslip.outputs import check_output
from stickslip.records import InputError

_logger = logging.getLogger("stickslip")

_PLACE = "STICKSLIP_DATA"  # the environment variable that names a folder with data sets


@dataclass(frozen=True, kw_only=True)
class _Benchmark:
    """A public data set: the address of its files, and the sha256 of each by its name."""

    address: str
    files: Mapping[str, str]


_BENCHMARKS: Mapping[str, _Benchmark] = MappingProxyType(
    {
        # Janot, Gautier, Brunot (2019), "Data set and reference models of EMPS".
        "emps": _Benchmark(
            address="https://raw.githubusercontent.com/wmkouw/NSI-EMPS/"
            "d1137b8cc8a5ec3d75fe69c5d531075f7f6f616a/data/",
            files={
                "DATA_EMPS.mat": "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e",
                "DATA_EMPS_PULSES.mat": (
                    "0eab75bb1f6b16228ee78791343a88bf9bfd9a51036ac9807d7b5fc11c0e1704"
                ),
            },
        ),
    }
)


def find_benchmark(name: str) -> Path:
    """Return the folder with a public data set's files, fetching them if they are not here.

    They are looked for in the folder named by the environment variable ``STICKSLIP_DATA``, in a
    subfolder of the data set's name; then in the user's cache, to which they are fetched otherwise.
    Each must have the published sha256.

    Parameters
    ----------
    name
        ``"emps"``: the Electro-Mechanical Positioning System, ``DATA_EMPS.mat`` and
        ``DATA_EMPS_PULSES.mat``.

    Raises
    ------
    InputError
        If there is no such data set, if a file found is another one, or if it cannot be fetched
        or kept.
    """
    if name not in _BENCHMARKS:
        raise InputError("not_a_choice", name="data set", value=name, choices=tuple(_BENCHMARKS))
    benchmark = _BENCHMARKS[name]
    if place := os.environ.get(_PLACE):
        if not Path(place).is_dir():
            raise InputError("place_of_data_missing", where=place, variable=_PLACE)
        folder = Path(place) / name
        if folder.exists():
            for file, digest in benchmark.files.items():
                _check(folder / file, digest)
            return folder
    return _fetched(name, benchmark)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _check(path: Path, digest: str) -> None:
    if not path.is_file():
        raise InputError("data_file_missing", where=str(path), variable=_PLACE)
    found = _digest(path)
    if found != digest:
        raise InputError(
            "data_file_differs",
            where=str(path),
            size=path.stat().st_size,
            found=found,
            digest=digest,
        )


def _fetched(name: str, benchmark: _Benchmark) -> Path:
    """Fetch the files that the cache lacks, and return its folder."""
    import pooch

    folder = Path(pooch.os_cache("stickslip")) / name
    pooch.get_logger().setLevel("WARNING")  # fetched files are logged here
    for file, digest in benchmark.files.items():
        address = benchmark.address + file
        if (folder / file).is_file() and _digest(folder / file) == digest:
            continue
        _check_cache(folder, file)
        try:
            pooch.retrieve(address, known_hash=f"sha256:{digest}", fname=file, path=folder)
        except (OSError, ValueError) as error:  # no network or no such page; another file's hash
            raise InputError(
                "data_not_fetched" if isinstance(error, OSError) else "data_not_published",
                file=file,
                address=address,
                reason=type(error).__name__,
                folder=folder,
                name=name,
                variable=_PLACE,
            ) from error
        _logger.warning("stickslip: fetched %s", address)
    return folder


def _check_cache(folder: Path, file: str) -> None:
    """Check that the cache can be written, before anything is fetched for it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            "no_cache_of_data",
            where=str(folder),
            reason=error.strerror or type(error).__name__,
            variable=_PLACE,
        ) from error
    check_output(folder / file, what="the cache of data sets")
