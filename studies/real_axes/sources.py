"""The extra public logs: origin and hash of each file, as listed in sources.toml.

The files are not part of the project. To add one, clone its repository and run

    git show COMMIT:PATH > FOLDER/FILE

or fetch `ExtraFile.address`; ``python -m studies.real_axes --extra FOLDER`` then reads them.
"""

import hashlib
import tomllib
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class ExtraFile:
    """One public file."""

    file: str  #: Path in the folder of extra logs.
    #: The GitHub repository, its commit and the path in it.
    repository: str
    commit: str
    path: str
    sha256: str  #: Hash of the bytes.

    @property
    def address(self) -> str:
        """Address of the raw file."""
        return f"https://raw.githubusercontent.com/{self.repository}/{self.commit}/{self.path}"


def checked(folder: Path, file: str) -> Path | None:
    """Return the path of an extra file, or None if it is absent.

    Raises
    ------
    ValueError
        If the file is another one.
    """
    path = folder / file
    if not path.is_file():
        return None
    if hashlib.sha256(path.read_bytes()).hexdigest() != EXTRA_FILES[file].sha256:
        raise ValueError(f"{path} has another hash than {EXTRA_FILES[file].address}")
    return path


def _extra_files() -> dict[str, ExtraFile]:
    listed = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {
        file: ExtraFile(
            file=file, repository=each["name"], commit=each["commit"], path=path, sha256=sha256
        )
        for each in listed["repository"]
        for file, (path, sha256) in each["files"].items()
    }


EXTRA_FILES = _extra_files()
"""Every extra file, by its place in the folder."""
