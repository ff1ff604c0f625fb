"""Files and folders that no other user can have written.

Windows has neither the permissions nor the flags that this checks; there, folders in the user's profile are
private by inheritance.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Literal

try:
    import grp
    import pwd

    POSIX = True
except ImportError:
    POSIX = False

OWNER_ONLY, BY_OTHERS = 0o600, 0o022
NO_LINK = getattr(os, "O_NOFOLLOW", 0)
NO_WAIT = getattr(os, "O_NONBLOCK", 0)
"""Flag without which opening a pipe would block."""


class NotPrivateError(PermissionError):
    """Another user can write to this place."""


@contextmanager
def opened(
    path: str | Path,
    mode: Literal["rb", "r+b"],
    flags: int = 0,
    folder: int | None = None,
    buffering: int = -1,
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
        Descriptor of the open folder of the file, as from `private_folder`.
    buffering
        As for `open`.

    Raises
    ------
    NotPrivateError
        If another user can write the file.
    OSError
        If it cannot be opened.
    """

    def opener(name: str, by_mode: int) -> int:
        return os.open(name, by_mode | flags | NO_LINK | NO_WAIT, OWNER_ONLY, dir_fd=folder)

    with open(path if folder is None else Path(path).name, mode, buffering, opener=opener) as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or not _is_private(status):
            raise NotPrivateError(f"{path}: others can write this file")
        yield file


@contextmanager
def private_folder(folder: Path) -> Iterator[int | None]:
    """Open a folder whose contents and path no other user can change; create it if it does not exist.

    Descends from the root and keeps each folder open while it checks the next one, so that nothing already
    checked can be exchanged.

    Yields
    ------
    int or None
        Descriptor of the folder; None on a system without such descriptors.

    Raises
    ------
    NotPrivateError
        If another user can change the folder.
    OSError
        If it cannot be opened.
    """
    path = Path(os.path.realpath(folder))
    if not POSIX:
        path.mkdir(parents=True, exist_ok=True)
        yield None
        return
    here = _folder(path.anchor, None)
    try:
        for place in [*reversed(path.parents), path][1:]:
            if _lets_exchange(os.fstat(here)):
                raise NotPrivateError(f"{place.parent}: others can write in this folder")
            above, here = here, _folder(place.name, here)
            os.close(above)
        if not _is_private(os.fstat(here)):
            raise NotPrivateError(f"{path}: others can write in this folder")
        yield here
    finally:
        os.close(here)


def _folder(name: str, within: int | None) -> int:
    """Open a folder; create it for this user alone if it does not exist."""
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
    try:
        return os.open(name, flags, dir_fd=within)
    except FileNotFoundError:
        with suppress(FileExistsError):
            os.mkdir(name, 0o700, dir_fd=within)
        return os.open(name, flags, dir_fd=within)


def _is_private(status: os.stat_result) -> bool:
    """True if no other user can write."""
    return not POSIX or (status.st_uid in _trusted() and not status.st_mode & BY_OTHERS)


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
        user, entry = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    return (group, entry.gr_name) == (user.pw_gid, user.pw_name) and set(entry.gr_mem) <= {user.pw_name}
