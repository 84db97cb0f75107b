"""The registry of log formats: one reader a format, chosen by a file's ending.

``docs/contributing.md`` has the steps to add one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from stickslip.input_files import printable
from stickslip.logs.formats.arrays import read_npy, read_npz
from stickslip.logs.formats.frames import read_feather, read_parquet
from stickslip.logs.formats.hdf5 import read_hdf5
from stickslip.logs.formats.lerobot import INFO, read_lerobot
from stickslip.logs.formats.matlab import read_matlab
from stickslip.logs.formats.measurement import read_mdf, read_tdms
from stickslip.logs.formats.messages.ros import SIGNATURES, read_bag, read_mcap
from stickslip.logs.formats.sysid import read_sysid
from stickslip.logs.formats.text import CANDUMP, read_text
from stickslip.logs.table import Table
from stickslip.records import InputError


@runtime_checkable
class Reader(Protocol):
    """Reader of one format: the layout of a file at once, columns when the table loads them.

    It raises `InputError` if the file is damaged or holds no numbers, and `MissingExtraError` if a
    library is not installed. Nothing in the file is run.
    """

    def __call__(self, path: Path, /) -> Table:
        """Return the table in a file that exists and is not empty."""
        ...


@dataclass(frozen=True, kw_only=True)
class LogFormat:
    """A format of the registry."""

    name: str  # in prose
    endings: tuple[str, ...]  # of its files, in lower case
    read: Reader
    libraries: str = ""  # that read it, with their licences
    extra: str = ""  # of this package that installs them
    signature: bytes = b""  # with which its files begin, if all of them do
    folder: str = ""  # file by which a folder of that format is known
    hashed_endings: tuple[str, ...] = ()  # of the files in such a folder that make up the log
    apart: bool = True  # whether a library parses it that may crash: in a process of its own


ENTRIES = (
    LogFormat(
        name="text",
        endings=(".csv", ".tsv", ".txt", ".dat", ".asc", ".log", ".lvm"),
        read=read_text,
        apart=False,
    ),
    LogFormat(
        name="Parquet",
        endings=(".parquet", ".pq"),
        read=read_parquet,
        libraries="pyarrow (Apache-2.0)",
        extra="parquet",
        signature=b"PAR1",
    ),
    LogFormat(
        name="Feather",
        endings=(".feather", ".arrow"),
        read=read_feather,
        libraries="pyarrow (Apache-2.0)",
        extra="parquet",
        signature=b"ARROW1",
    ),
    LogFormat(
        name="MATLAB",
        endings=(".mat",),
        read=read_matlab,
        libraries="scipy, h5py and mat-io (BSD-3-Clause)",
        extra="matlab",
        signature=b"MATLAB ",
    ),
    LogFormat(
        name="HDF5",
        endings=(".h5", ".hdf5", ".hdf"),
        read=read_hdf5,
        libraries="h5py (BSD-3-Clause)",
        extra="hdf5",
        signature=b"\x89HDF\r\n\x1a\n",
    ),
    LogFormat(
        name="ROS bag",
        endings=(".bag", ".db3"),
        read=read_bag,
        libraries="rosbags (Apache-2.0)",
        extra="ros",
        signature=SIGNATURES[".bag"],
        folder="metadata.yaml",
        hashed_endings=(".yaml", ".db3", ".mcap", ".zstd"),
    ),
    LogFormat(
        name="MCAP",
        endings=(".mcap",),
        read=read_mcap,
        libraries="rosbags (Apache-2.0), mcap and mcap-protobuf-support (MIT)",
        extra="ros",
        signature=SIGNATURES[".mcap"],
    ),
    LogFormat(
        name="LeRobot",
        endings=(),
        read=read_lerobot,
        libraries="pyarrow (Apache-2.0)",
        extra="parquet",
        folder=INFO,
        hashed_endings=(".json", ".parquet"),
    ),
    LogFormat(
        name="TDMS",
        endings=(".tdms",),
        read=read_tdms,
        libraries="npTDMS (LGPL-3.0-only)",
        extra="tdms",
        signature=b"TDSm",
    ),
    LogFormat(
        name="MDF",
        endings=(".mf4", ".mdf"),
        read=read_mdf,
        libraries="asammdf (LGPL-3.0-or-later)",
        extra="mdf",
        signature=b"MDF ",
    ),
    LogFormat(name="SysId", endings=(".json",), read=read_sysid, signature=b"{"),
    LogFormat(name="NPY", endings=(".npy",), read=read_npy, signature=b"\x93NUMPY"),
    LogFormat(name="NPZ", endings=(".npz",), read=read_npz, signature=b"PK\x03\x04"),
)

FORMATS: Mapping[str, LogFormat] = MappingProxyType(
    {ending: entry for entry in ENTRIES for ending in entry.endings}
)
"""The format of every known ending."""


WORKBOOK = ("a workbook", "save the sheet of the log as CSV (UTF-8)")
PICKLE = ("a pickle", 'pandas.read_pickle("log.pkl").to_csv("log.csv")')
"""Name of the format, and how it is converted."""

CONVERTED: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        ".ulg": ("a ULog of PX4", "ulog2csv log.ulg (pip install pyulog)"),
        ".wpilog": ("a WPILOG", "export it as CSV in AdvantageScope or the DataLog Tool"),
        ".rrd": (
            "a recording of Rerun",
            "rerun rrd ... or the dataframe API of rerun-sdk to Parquet",
        ),
        ".svdx": ("a project of TwinCAT Scope", "export it as CSV, or TC3ScopeExportTool.exe"),
        ".candump": CANDUMP,
        ".xlsx": WORKBOOK,
        ".xls": WORKBOOK,
        ".ods": WORKBOOK,
        ".pkl": PICKLE,
        ".pickle": PICKLE,
    }
)
"""Formats that other tools convert, by the ending of their files."""


def format_named(name: str) -> LogFormat:
    """Return the format of that name, which must be one."""
    return next(entry for entry in ENTRIES if entry.name == name)


def format_of(path: Path) -> LogFormat:
    """Return the format of a file by its ending, in either case."""
    ending = path.suffix.lower()
    entry = FORMATS.get(ending)
    if ending in CONVERTED:
        name, command = CONVERTED[ending]
        raise InputError("other_format", where=str(path), format=name, command=command)
    if entry is None:
        raise InputError(
            "unknown_format",
            where=printable(path),
            ending=printable(path.suffix) or "of a name without an ending",
            endings=list(FORMATS),
        )
    return entry


def format_of_content(path: Path) -> LogFormat:
    """Return the format of a file without a known name by its first bytes, or else text."""
    with path.open("rb") as file:
        head = file.read(max(len(entry.signature) for entry in ENTRIES))
    found = (entry for entry in ENTRIES if entry.signature and head.startswith(entry.signature))
    return next(found, ENTRIES[0])


def folder_format(path: Path) -> LogFormat | None:
    """Return the format of a folder that is a log as a whole, or None."""
    return next(
        (entry for entry in ENTRIES if entry.folder and (path / entry.folder).is_file()), None
    )
