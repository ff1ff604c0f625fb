"""Atomic file writes, and files that no other user can have written."""

from __future__ import annotations

import grp
import os
import pwd
import stat
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from secrets import token_hex
from typing import BinaryIO, Literal, TypeVar

from .errors import FracsliceWarning

T = TypeVar("T")

OWNER_ONLY, BY_OTHERS = 0o600, 0o022
FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC


class NotPrivateError(PermissionError):
    """Another user can write to this place."""


@contextmanager
def replacing(target: Path) -> Iterator[BinaryIO]:
    """Write a file atomically: it appears at `target` complete when the block ends, or not at all.

    The temporary file lies beside the target, with permissions for its owner only. Any error,
    KeyboardInterrupt included, removes it.

    Parameters
    ----------
    target
        Final path.

    Yields
    ------
    BinaryIO
        Temporary file, open for writing.
    """
    part = target.with_name(f".{target.name[:100]}.{token_hex(8)}.part")
    handle = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, OWNER_ONLY)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.replace(part, target)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(part)
        raise


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
        try:
            with _private_folder(self.folder) as here, opened(name, "rb", folder=here) as file:
                return read(file)
        except NotPrivateError as error:
            self._distrust(error)
        except OSError:
            pass
        return None

    def place(self) -> Path | None:
        """Return the path of the folder, for code that needs one.

        Returns
        -------
        Path
            Resolved path; None if the folder cannot be opened or is not trusted.
        """
        try:
            with _private_folder(self.folder):
                return Path(os.path.realpath(self.folder))
        except NotPrivateError as error:
            self._distrust(error)
        except OSError:
            pass
        return None

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
        OSError
            If writing fails for another reason than that.
        """
        target = Path(os.path.realpath(self.folder), name)
        with suppress(NotPrivateError), _private_folder(self.folder), replacing(target) as file:
            write(file)

    def _distrust(self, error: NotPrivateError) -> None:
        warn(f"{error}: what is kept in {self.folder} is not used")


@contextmanager
def opened(
    path: str | Path, mode: Literal["rb", "r+b"], flags: int = 0, folder: int | None = None
) -> Iterator[BinaryIO]:
    """Open a file that no other user can write; do not follow a symbolic link.

    Parameters
    ----------
    path
        File.
    mode
        "rb" or "r+b".
    flags
        Further flags for `os.open`. A file that they create is for its owner only.
    folder
        Descriptor of the open folder that `path` is relative to.

    Yields
    ------
    BinaryIO
        Open file.

    Raises
    ------
    NotPrivateError
        If another user can write the file.
    OSError
        If it cannot be opened.
    """
    flags |= os.O_NOFOLLOW | os.O_NONBLOCK  # opening a pipe would otherwise block

    def opener(name: str, by_mode: int) -> int:
        return os.open(name, by_mode | flags, OWNER_ONLY, dir_fd=folder)

    with open(path, mode, opener=opener) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_uid not in _trusted() or status.st_mode & BY_OTHERS:
            raise NotPrivateError(f"{path}: others can write this file")
        yield file


@contextmanager
def _private_folder(folder: Path) -> Iterator[int]:
    """Open a folder whose contents and path no other user can change; create it if it does not exist.

    Descends from the root and keeps each folder open while it checks the next one, so that nothing already
    checked can be exchanged.
    """
    path = Path(os.path.realpath(folder))
    here = os.open(path.anchor, FOLDER)
    try:
        for place in [*reversed(path.parents), path][1:]:
            if _lets_exchange(os.fstat(here)):
                raise NotPrivateError(f"{place.parent}: others can write in this folder")
            above, here = here, _folder(place.name, here)
            os.close(above)
        status = os.fstat(here)
        if status.st_uid not in _trusted() or status.st_mode & BY_OTHERS:
            raise NotPrivateError(f"{path}: others can write in this folder")
        yield here
    finally:
        os.close(here)


def _folder(name: str, within: int) -> int:
    """Open a folder; create it for this user alone if it does not exist."""
    try:
        return os.open(name, FOLDER, dir_fd=within)
    except FileNotFoundError:
        with suppress(FileExistsError):
            os.mkdir(name, 0o700, dir_fd=within)
        return os.open(name, FOLDER, dir_fd=within)


def _trusted() -> tuple[int, int]:
    """User ids whose files are trusted: this user's and root's, which could change any file anyway."""
    return 0, os.geteuid()


def _lets_exchange(status: os.stat_result) -> bool:
    """True if others can replace an entry of this user in a folder."""
    others = status.st_mode & stat.S_IWOTH or (status.st_mode & stat.S_IWGRP and not _alone_in(status.st_gid))
    return status.st_uid not in _trusted() or bool(others and not status.st_mode & stat.S_ISVTX)


def _alone_in(group: int) -> bool:
    """True if a group is the user's private group. Debian creates one per user, with write permission on the
    user's files.
    """
    try:
        user, found = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return (group, found.gr_name) == (user.pw_gid, user.pw_name) and set(found.gr_mem) <= {user.pw_name}


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
