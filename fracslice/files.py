"""Files that appear whole, and files that nobody else can have written."""

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
    """Somebody else can write there."""


@contextmanager
def replacing(target: Path) -> Iterator[BinaryIO]:
    """Opens a file that appears at `target` complete when the block ends, and never otherwise.

    It is this user's alone, and lies beside the target until then; any error, KeyboardInterrupt too, removes
    it.
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
    """Files that are kept in a folder for later, for as long as nobody else can write there.

    folder: made when first looked into, for this user alone. A folder or a file that others can write is not
    used, and a warning says so, once.
    """

    folder: Path

    def get(self, name: str, read: Callable[[BinaryIO], T]) -> T | None:
        """What `read` makes of a file; None if there is none, or none to be trusted."""
        try:
            with _private_folder(self.folder) as here, opened(name, "rb", folder=here) as file:
                return read(file)
        except NotPrivateError as error:
            self._distrust(error)
        except OSError:
            pass
        return None

    def place(self) -> Path | None:
        """The folder itself, for what has to be given a path; None if there is none to be trusted."""
        try:
            with _private_folder(self.folder):
                return Path(os.path.realpath(self.folder))
        except NotPrivateError as error:
            self._distrust(error)
        except OSError:
            pass
        return None

    def put(self, name: str, write: Callable[[BinaryIO], object]) -> None:
        """Keeps a file. Raises OSError where that cannot be, other than for what `get` warns of."""
        target = Path(os.path.realpath(self.folder), name)
        with suppress(NotPrivateError), _private_folder(self.folder), replacing(target) as file:
            write(file)

    def _distrust(self, error: NotPrivateError) -> None:
        warn(f"{error}: what is kept in {self.folder} is not used")


@contextmanager
def opened(
    path: str | Path, mode: Literal["rb", "r+b"], flags: int = 0, folder: int | None = None
) -> Iterator[BinaryIO]:
    """Opens a file that nobody else can write, and follows no link to it.

    flags: of `os.open`; a file that they make is for this user alone. folder: an open folder that `path` is
    in. Raises `NotPrivateError` and OSError.
    """
    flags |= os.O_NOFOLLOW | os.O_NONBLOCK  # a pipe in its place would wait for its other end

    def opener(name: str, by_mode: int) -> int:
        return os.open(name, by_mode | flags, OWNER_ONLY, dir_fd=folder)

    with open(path, mode, opener=opener) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or status.st_uid not in _trusted() or status.st_mode & BY_OTHERS:
            raise NotPrivateError(f"{path}: others can write this file")
        yield file


@contextmanager
def _private_folder(folder: Path) -> Iterator[int]:
    """Opens a folder that nobody else can change: neither what is in it, nor where its path leads.

    It is made if it is not there. Goes down from the root, holding each folder while it looks at the next:
    what was looked at cannot be exchanged.
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
    """Opens a folder, made for this user alone if it is not there."""
    try:
        return os.open(name, FOLDER, dir_fd=within)
    except FileNotFoundError:
        with suppress(FileExistsError):
            os.mkdir(name, 0o700, dir_fd=within)
        return os.open(name, FOLDER, dir_fd=within)


def _trusted() -> tuple[int, int]:
    """Whose files are this user's own: root could change any."""
    return 0, os.geteuid()


def _lets_exchange(status: os.stat_result) -> bool:
    """Whether others can put something of theirs in the place of what this user has in a folder."""
    others = status.st_mode & stat.S_IWOTH or (status.st_mode & stat.S_IWGRP and not _alone_in(status.st_gid))
    return status.st_uid not in _trusted() or bool(others and not status.st_mode & stat.S_ISVTX)


def _alone_in(group: int) -> bool:
    """Whether a group is the user's own: Debian gives each user one, which may write what its user makes."""
    try:
        user, found = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return (group, found.gr_name) == (user.pw_gid, user.pw_name) and set(found.gr_mem) <= {user.pw_name}


@cache
def warn(text: str) -> None:
    """Says something, in one line, once."""
    warnings.warn(text, FracsliceWarning, stacklevel=2)


def users_folder(variable: str, default: str) -> Path:
    """The program's folder in one of the user's, which an environment variable names or else is `default`.

    A user without a home gets one that cannot be.
    """
    base = os.path.expanduser(os.environ.get(variable) or default)
    return Path(base if os.path.isabs(base) else os.devnull, "fracslice")
