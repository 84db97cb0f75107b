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

    def checked(self, folder: Path) -> Path:
        """Return the path of the file in a folder.

        Raises
        ------
        FileNotFoundError
            If it is absent.
        ValueError
            If it is another file.
        """
        path = folder / self.file
        if hashlib.sha256(path.read_bytes()).hexdigest() != self.sha256:
            raise ValueError(f"{path} has another hash than {self.address}")
        return path


def listed_files(path: Path) -> dict[str, ExtraFile]:
    """Return the files of a list, by their places in the folder of extra files."""
    listed = tomllib.loads(path.read_text(encoding="utf-8"))
    return {
        file: ExtraFile(
            file=file, repository=each["name"], commit=each["commit"], path=path, sha256=sha256
        )
        for each in listed["repository"]
        for file, (path, sha256) in each["files"].items()
    }


EXTRA_FILES = listed_files(Path(__file__).with_suffix(".toml"))
"""Every extra file, by its place in the folder."""
