"""Files are written whole or not at all, and a place that cannot be written is found beforehand.

A leaf beside the packages, which write pages, logs, saved results and exports through it.
"""

import contextlib
import os
import secrets
import shutil
from collections.abc import Generator, Iterable
from pathlib import Path
from typing import TextIO

from stickslip.errors import InputError


def check_output(path: Path, *, inputs: Iterable[Path] = (), what: str = "the output") -> None:
    """Check that a file can be written at ``path``, before any work is done for it.

    Nothing is left behind: the check makes a file of another name in the same folder and removes
    it. ``inputs`` are files that must not be overwritten, as the output is made from them; ``what``
    names the file in the message, such as ``"--json"``.
    """
    try:
        _check(path, inputs, what)
    except OSError as error:
        raise _unwritable(path, error, what) from error


def _check(path: Path, inputs: Iterable[Path], what: str) -> None:
    if path.is_dir():
        raise InputError("output_is_folder", where=str(path), what=what)
    if path.exists() and not path.is_file():
        # A terminal, a pipe or /dev/null: opened as it stands, nothing to replace.
        return
    for taken in inputs:
        if path.exists() and taken.exists() and path.samefile(taken):
            raise InputError("output_is_input", where=str(path), what=what)
    if not path.parent.is_dir():
        where, folder = str(path), str(path.parent)
        raise InputError("output_without_folder", where=where, what=what, folder=folder)
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError(13, "the file is write-protected")
    trial = _sibling(path)
    with trial.open("x"):
        pass
    trial.unlink()


def check_page_suffix(path: Path, *, what: str = "the report") -> None:
    """Check that the name of an HTML page does not end like that of another file."""
    if path.suffix.lower() not in {"", ".html", ".htm"}:
        raise InputError("output_is_page", where=str(path), what=what, suffix=path.suffix)


@contextlib.contextmanager
def whole_file(path: Path, *, what: str = "the output") -> Generator[TextIO]:
    """Open a UTF-8 text file that appears under its name only once it is complete.

    `check_output` runs first; an existing file is replaced.
    """
    with (
        _complete(path, what) as written,
        written.open("w", encoding="utf-8", newline="") as stream,
    ):
        yield stream


def write_whole(path: Path, content: bytes, *, what: str = "the output") -> None:
    """Write a file of any content, as `whole_file` does."""
    with _complete(path, what) as written:
        written.write_bytes(content)


@contextlib.contextmanager
def _complete(path: Path, what: str) -> Generator[Path]:
    """Yield the path to write to, which is renamed when it is complete."""
    check_output(path, what=what)
    replaceable = path.is_file() or not path.exists()
    written = _sibling(path) if replaceable else path
    try:
        yield written
        if replaceable:
            written.replace(path)
    except OSError as error:
        raise _unwritable(path, error, what) from error
    finally:
        if replaceable:
            written.unlink(missing_ok=True)


@contextlib.contextmanager
def files_at_once(folder: Path, *, what: str = "the output") -> Generator[Path]:
    """Write several files into a folder that appear there together, once all are complete.

    What is written into the folder yielded, also into folders in it, is moved to ``folder`` when
    the block ends; existing files of the same names are replaced. If it fails nothing appears, and
    a folder that was made for it is removed.
    """
    for each in (folder, *folder.parents):
        if each.exists() and not each.is_dir():
            raise InputError("output_needs_folder", where=str(each), what=what)
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    scratch = folder / f".{secrets.token_hex(4)}.part"
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            scratch.mkdir()
        except OSError as error:
            raise _unwritable(folder, error, what) from error
        yield scratch
        written = {
            path: folder / path.relative_to(scratch)
            for path in sorted(scratch.rglob("*"))
            if path.is_file()
        }
        for place in written.values():  # before the first is moved: all or none
            if place.is_dir():
                raise _unwritable(place, IsADirectoryError(21, "it is a folder"), what)
        for path, place in written.items():
            try:
                place.parent.mkdir(parents=True, exist_ok=True)
                path.replace(place)
            except OSError as error:
                raise _unwritable(place, error, what) from error
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        for made in missing:
            with contextlib.suppress(OSError):  # it holds the files, or was never made
                made.rmdir()


def _sibling(path: Path) -> Path:
    """Name a hidden file in the same folder, so that renaming it is one step of the file system."""
    return path.with_name(f".{path.name[:50]}.{secrets.token_hex(4)}.part")


def _unwritable(path: Path, error: OSError, what: str) -> InputError:
    reason = error.strerror or type(error).__name__
    return InputError("output_failed", where=str(path), what=what, reason=reason)
