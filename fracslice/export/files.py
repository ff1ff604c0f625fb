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

ANYONE = 0o666
"""What the umask allows."""


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
        before = target.stat().st_mode & 0o7777 if target.exists() else None
        with files.replacing(target, ANYONE if before is None else files.OWNER_ONLY) as file:
            yield file
            file.flush()
            if before is not None:
                os.fchmod(file.fileno(), before)
            os.fsync(file.fileno())
        _settle(target.parent)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


def put(path: str, data: bytes) -> None:
    """Writes a file in as few calls as can be: one of many, of which what an error leaves is looked at before
    it is used. It is neither renamed into place nor forced to the disk.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, ANYONE)
    try:
        while data:
            data = data[os.write(handle, data) :]
    finally:
        os.close(handle)


def _settle(folder: Path) -> None:
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
