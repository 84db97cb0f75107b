"""From what a user gives as a log to its table: a file, a folder, standard input or a URL."""

import bz2
import gzip
import hashlib
import lzma
import re
import shutil
import sys
import tempfile
import weakref
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any

from stickslip.errors import RequiredExtra
from stickslip.input_files import check_exists, printable
from stickslip.logs.formats.registry import (
    FORMATS,
    LogFormat,
    folder_format,
    format_of,
    format_of_content,
)
from stickslip.logs.isolation import read_apart
from stickslip.logs.table import Column, Table, combined
from stickslip.records import InputError, LogSource

_STANDARD_INPUT = frozenset({"-", "/dev/stdin"})
_URL = re.compile(r"(?P<protocol>[A-Za-z][A-Za-z0-9+.]+):(?://|/(?!/))(?P<rest>.+)", re.DOTALL)
"""A URL, also with the one slash that remains when it has been taken for a path."""

_COMPRESSED: Mapping[str, Callable[[Path], Any]] = MappingProxyType(
    {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}
)
_SIGNATURES: Mapping[str, bytes] = MappingProxyType(
    {".gz": b"\x1f\x8b\x08", ".bz2": b"BZh", ".xz": b"\xfd7zXZ\x00"}
)
"""First bytes of a compressed file, by its ending."""

_ARCHIVE = ".zip"
_DAMAGED = (
    EOFError,
    NotImplementedError,
    OSError,
    ValueError,
    lzma.LZMAError,
    zipfile.BadZipFile,
    zlib.error,
)
"""Errors of the decompressors on damaged files."""

_LARGEST_RATIO, _SMALL = 200, 100_000_000
"""Bytes of a decompressed file are at most so many times those of the compressed one, or so many:
the dullest text is compressed less, and a file that is made to fill a disk more."""

_MOST_NAMES = 5  # files of an archive that a message lists

_LONGEST_NAME = 100  # characters at the end of the name of a file in an archive that are kept

_BLOCK = 1 << 20  # bytes read at once


class _Scratch:
    """A temporary folder, which is removed with the last reference to it."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="stickslip-"))
        self.remove = weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)


@dataclass(frozen=True, kw_only=True)
class _Opened:
    """A file or folder that a reader can be given, and what the user gave."""

    path: Path  # to read
    name: str  # of what the user gave, in results
    hashed: tuple[Path, ...]  # files whose bytes identify the log
    entry: LogFormat
    scratch: tuple[_Scratch, ...] = ()  # which hold the files

    def table(self) -> Table:
        """Return the table, which keeps a temporary folder as long as it is needed."""
        apart = self.entry.apart
        table = read_apart(self.entry, self.path) if apart else self.entry.read(self.path)
        load, kept = table.load, self.scratch
        if not kept:
            return table

        def loaded(names: Sequence[str], _: tuple[_Scratch, ...] = kept) -> Mapping[str, Column]:
            return load(names)

        return replace(table, load=loaded)


def open_log(
    location: str | Path, named: Mapping[str, str], where: str
) -> tuple[Table, LogSource, str]:
    """Return the table of a log, its source, and the name that its file gives to the log.

    ``named`` are the files of a folder by their short names, from the schema called ``where``.
    """
    try:
        Path(location)
    except TypeError:
        raise InputError("not_a_path", found=type(location).__name__) from None
    shown = printable(location)
    try:
        files = _files(location, named, where)
        tables = {short: opened.table() for short, opened in files.items()}
        source = LogSource(
            files=tuple(opened.name for opened in files.values()),
            sha256=_hash(file for opened in files.values() for file in opened.hashed),
        )
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError("unreadable", where=shown, kind="log", reason=reason) from error
    if named:
        folder = PurePosixPath(shown).name
        return combined(tables, folder), source, PurePosixPath(folder).stem
    return tables[""], source, PurePosixPath(files[""].path.name).stem


def _files(location: str | Path, named: Mapping[str, str], where: str) -> dict[str, _Opened]:
    """Return the files of a log by their short names; a log of one file has it under no name."""
    path, shown = Path(location), printable(location)
    if str(location) in _STANDARD_INPUT:
        return {"": _standard_input()}
    if (match := _URL.fullmatch(str(location))) and not path.exists():
        return {"": _downloaded(match["protocol"], match["rest"])}
    check_exists(path, "file or folder")
    if not (path.is_file() or path.is_dir()):
        raise InputError("pipe_as_log", where=shown)
    if not path.is_dir():
        if named:
            raise InputError("files_of_one_file", where=shown, schema=where)
        return {"": _opened(path)}
    if not named:
        return {"": _folder(path, where)}
    for short, name in named.items():
        if not (path / name).is_file():
            raise InputError("no_such_file_in_folder", where=shown, name=name, short=short)
    return {short: _opened(path / name) for short, name in named.items()}


def _folder(path: Path, where: str) -> _Opened:
    """Return a folder that is a log as a whole."""
    entry = folder_format(path)
    if entry is None:
        raise InputError(
            "folder_without_files",
            where=printable(path),
            schema=f" and the schema {where} names no files" if where else "",
        )
    files = sorted(file for file in path.rglob("*") if file.is_file())
    hashed = tuple(file for file in files if file.suffix.lower() in entry.hashed_endings)
    return _Opened(path=path, name=printable(path.name), hashed=hashed, entry=entry)


def _opened(path: Path) -> _Opened:
    """Return a file as it can be read: not compressed, and with a name that can be printed."""
    name, ending = printable(path.name), path.suffix.lower()
    entry = None if ending in _COMPRESSED or ending == _ARCHIVE else format_of(path)
    if not path.stat().st_size:
        raise InputError("empty_log", where=printable(path))
    if entry is None:
        return _uncompressed(path, ending)
    if name == path.name:
        return _Opened(path=path, name=name, hashed=(path,), entry=entry)
    scratch = _Scratch()
    link = scratch.path / name
    link.symlink_to(path.absolute())
    return _Opened(path=link, name=name, hashed=(path,), entry=entry, scratch=(scratch,))


def _uncompressed(path: Path, ending: str) -> _Opened:
    """Return the log in a compressed file or an archive."""
    try:
        return _unzipped(path) if ending == _ARCHIVE else _decompressed(path, ending)
    except _DAMAGED as error:
        if isinstance(error, InputError):
            raise
        raise InputError("damaged_compression", where=printable(path.name)) from error


def _decompressed(path: Path, ending: str) -> _Opened:
    with _COMPRESSED[ending](path) as stream:
        return _spooled(stream, Path(printable(path.stem)).name, given=path)


def _unzipped(path: Path) -> _Opened:
    """Return the log in an archive: its only file, or the only one that has a known ending."""
    with zipfile.ZipFile(path) as archive:
        members = [
            each
            for each in archive.infolist()
            if not each.filename.endswith("/")
            and not each.filename.startswith("__MACOSX/")
            and PurePosixPath(each.filename).name not in {"", ".."}  # of a damaged archive
        ]
        known = [each for each in members if Path(each.filename).suffix.lower() in FORMATS]
        chosen = known if len(members) > 1 else members
        if len(chosen) != 1:
            raise InputError(
                "logs_in_archive",
                where=printable(path.name),
                count=len(chosen),
                names=[each.filename for each in chosen[:_MOST_NAMES]],
            )
        if chosen[0].flag_bits & 1:
            raise InputError("archive_with_password", where=printable(path.name))
        with archive.open(chosen[0]) as stream:
            name = PurePosixPath(chosen[0].filename).name[-_LONGEST_NAME:]
            return _spooled(stream, name, given=path)


def _standard_input() -> _Opened:
    if sys.stdin is None or sys.stdin.isatty():
        raise InputError("terminal_as_log", where="-")
    return _content(_spooled(sys.stdin.buffer, "standard input"))


def _downloaded(protocol: str, rest: str) -> _Opened:
    """Return the file at a URL; what may stand before the host or behind the path stays unsaid."""
    with RequiredExtra("url", "reading a log from a URL"):
        import fsspec
    name = PurePosixPath(re.split(r"[?#]", rest)[0]).name or "log"
    try:
        with fsspec.open(f"{protocol}://{rest}", "rb") as stream:
            opened = _spooled(stream, name)
    except InputError:
        raise
    # Each protocol has a library of its own, with errors of its own.
    except Exception as error:  # noqa: BLE001
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError("cannot_fetch", where=name, protocol=protocol, reason=reason) from None
    return _content(opened)


def _content(opened: _Opened) -> _Opened:
    """Return a received file, or the log in it if it is compressed by its ending or first bytes."""
    ending = opened.path.suffix.lower()
    if ending not in {*FORMATS, *_COMPRESSED, _ARCHIVE}:
        with opened.path.open("rb") as file:
            head = file.read(max(map(len, _SIGNATURES.values())))
        ending = next((each for each, own in _SIGNATURES.items() if head.startswith(own)), "")
    if ending not in {*_COMPRESSED, _ARCHIVE}:
        return opened
    try:
        inner = _uncompressed(opened.path, ending)
    except BaseException:
        for each in opened.scratch:
            each.remove()
        raise
    return replace(inner, scratch=(*opened.scratch, *inner.scratch))


def _spooled(stream: Any, name: str, given: Path | None = None) -> _Opened:
    """Return the content of a stream as a file; that of a compressed file must not be enormous."""
    scratch = _Scratch()
    path = scratch.path / printable(name)
    limit = None if given is None else max(_SMALL, _LARGEST_RATIO * given.stat().st_size)
    try:
        _copy(stream, path, limit, printable(given.name) if given else name)
    except BaseException:  # whatever refers to the folder then, it is of no use
        scratch.remove()
        raise
    entry = FORMATS.get(path.suffix.lower()) or format_of_content(path)
    return _Opened(
        path=path,
        name=name if given is None else printable(given.name),
        hashed=(given or path,),
        entry=entry,
        scratch=(scratch,),
    )


def _copy(stream: Any, path: Path, limit: int | None, label: str) -> None:
    """Write a stream, which must not be empty, to a file of limited size."""
    size = 0
    with path.open("wb") as file:
        while block := stream.read(_BLOCK):
            size += len(block)
            if limit is not None and size > limit:
                raise InputError("too_large_decompressed", where=label, megabytes=limit / 1e6)
            file.write(block)
    if not size:
        raise InputError("empty_log", where=label)


def _hash(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(_BLOCK):
                digest.update(block)
    return digest.hexdigest()
