"""Cache files, in folders that no other user can write to."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import BinaryIO, TypeVar

from ..errors import ExportError, FracsliceWarning
from .files import replacing, reported
from .private import OWNER_ONLY, NotPrivateError, opened, private_folder

T = TypeVar("T")


@dataclass(frozen=True)
class Kept:
    """Cache files in a folder that no other user can write to.

    A folder or file that others can write to is ignored, with one warning.

    Attributes
    ----------
    folder
        Cache folder, created at first use for this user alone.
    """

    folder: Path

    def get(self, name: str, read: Callable[[BinaryIO], T]) -> T | None:
        """Read a cached file.

        Parameters
        ----------
        name
            File name.
        read
            Reads the open file.

        Returns
        -------
        object
            Result of `read`; None if the file is missing or not trusted.
        """
        return self._trusted(lambda here: self._read(name, read, here))

    def place(self) -> Path | None:
        """Return the path of the folder, for code that needs one.

        Returns
        -------
        Path
            Resolved path; None if the folder cannot be opened or is not trusted.
        """
        return self._trusted(lambda _: Path(os.path.realpath(self.folder)))

    def put(self, name: str, write: Callable[[BinaryIO], object]) -> None:
        """Write a cached file atomically; ignore a folder that is not trusted.

        Parameters
        ----------
        name
            File name.
        write
            Writes to the open file.

        Raises
        ------
        ExportError
            If writing fails for another reason than that.
        """
        target = Path(os.path.realpath(self.folder), name)
        with (
            reported(self.folder),
            suppress(NotPrivateError),
            private_folder(self.folder),
            replacing(target, OWNER_ONLY) as file,
        ):
            write(file)

    def cached(self, name: str, make: Callable[[], bytes]) -> bytes:
        """Read a cached file with a checksum; without one, or if it is damaged, make and cache its contents.

        Parameters
        ----------
        name : str
            File name.
        make : callable
            Returns the contents.
        """
        data = self.get(name, _checked)
        if data is None:
            data = make()
            self.put_checked(name, data)
        return data

    def put_checked(self, name: str, data: bytes) -> None:
        """Replace a cached file of `cached`; ignore a folder that cannot be written.

        Parameters
        ----------
        name : str
            File name.
        data : bytes
            Contents.
        """
        with suppress(ExportError):
            self.put(name, lambda file: file.write(hashlib.sha256(data).digest() + data))

    def _read(self, name: str, read: Callable[[BinaryIO], T], here: int | None) -> T:
        with opened(self.folder / name, "rb", folder=here) as file:
            return read(file)

    def _trusted(self, use: Callable[[int | None], T]) -> T | None:
        """Result for the open folder; None if it cannot be opened or is not trusted."""
        try:
            with private_folder(self.folder) as here:
                return use(here)
        except NotPrivateError as error:
            warn(f"{error}: the files in {self.folder} are not used")
        except OSError:
            pass
        return None


def _checked(file: BinaryIO) -> bytes | None:
    """Contents after their checksum; None if they do not match."""
    digest, data = file.read(hashlib.sha256().digest_size), file.read()
    return data if hashlib.sha256(data).digest() == digest else None


@cache
def warn(text: str) -> None:
    """Issue a `FracsliceWarning` once.

    Parameters
    ----------
    text
        Message of one line.
    """
    warnings.warn(text, FracsliceWarning, stacklevel=2)


def users_folder(variable: str, default: str) -> Path:
    """Return the folder of this program within one of the user's folders.

    Parameters
    ----------
    variable
        Environment variable that names the user's folder.
    default
        Folder used if the variable is not set.

    Returns
    -------
    Path
        Folder; a path that cannot exist if the user has no home.
    """
    base = os.path.expanduser(os.environ.get(variable) or default)
    return Path(base if os.path.isabs(base) else os.devnull, "fracslice")


def cache_folder() -> Path:
    """Return the cache folder of kernels: $FRACSLICE_CACHE, else one in the user's cache folder."""
    given = os.environ.get("FRACSLICE_CACHE")
    return Path(given).expanduser() if given else users_folder("XDG_CACHE_HOME", "~/.cache") / "kernels"
