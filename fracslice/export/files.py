"""Files that are whole or not there, brought to the disk, and errors of the file system in words."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from fracslice import files
from fracslice.errors import ExportError


def check_target(path: str | Path) -> Path:
    """Where a file for `path` would go (links followed), if it can be made there; changes nothing.

    Raises ExportError if the folder is missing or not writable, or if `path` is itself a folder.
    """
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise ExportError(f"{path}: the folder {target.parent} does not exist")
    if target.is_dir():
        raise ExportError(f"{path}: is a folder")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise ExportError(f"{path}: the folder {target.parent} is not writable")
    return target


@contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """Open a file that appears at `path` complete when the block ends, and never otherwise.

    As `fracslice.files.replacing`, and on the disk before it gets its name; what was at `path` leaves its
    permissions. Raises ExportError for what the file system refuses.
    """
    target = check_target(path)
    try:
        with files.replacing(target) as file:
            yield file
            _settle(file, target)
        _settle_folder(target.parent)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


def put(path: str, data: bytes) -> None:
    """Writes a file in as few calls as can be: one of many, of which what an error leaves is looked at before
    it is used. It is neither renamed into place nor forced to the disk.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o666)
    try:
        while data:
            data = data[os.write(handle, data) :]
    finally:
        os.close(handle)


def into_place(file: BinaryIO, path: str | Path) -> None:
    """Renames an open file that is whole to `path`, as `replacing` does. Raises OSError."""
    target = check_target(path)
    _settle(file, target)
    os.replace(file.name, target)
    _settle_folder(target.parent)


def _settle(file: BinaryIO, target: Path) -> None:
    """Brings a file to the disk, with the permissions that the target has, or a new file gets."""
    file.flush()
    mask = os.umask(0o077)  # there is no other way to ask for it
    os.umask(mask)
    os.fchmod(file.fileno(), target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~mask)
    os.fsync(file.fileno())


def _settle_folder(folder: Path) -> None:
    """Bring the folder's new entry to the disk, where the system can."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def reason(error: OSError) -> str:
    """Why the file system refuses, in words."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full; nothing was written"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "not allowed to write there"
    return error.strerror or str(error)
