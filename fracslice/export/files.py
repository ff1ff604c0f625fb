"""Atomic and durable file writing, and messages for file system errors."""

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
    """Check that a file can be written; nothing is changed.

    Parameters
    ----------
    path : str or path
        The file to write.

    Returns
    -------
    Path
        The path with links resolved.

    Raises
    ------
    ExportError
        If the folder is missing or not writable, or if `path` is itself a folder.
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
    """Write a file atomically: it appears at `path`, complete, when the block ends without an error.

    As `fracslice.files.replacing`, but the file is flushed to disk before it is renamed. It takes the
    permissions of the file that it replaces.

    Parameters
    ----------
    path : str or path
        The file to write.

    Yields
    ------
    file
        Binary file, open for writing.

    Raises
    ------
    ExportError
        For an error of the file system.
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
    """Write one of many files with as few system calls as possible, neither atomically nor flushed to disk.

    The caller must check what an interrupted job has left before using it.

    Parameters
    ----------
    path : str
        The file to write; links are not followed.
    data : bytes
        Contents.

    Raises
    ------
    OSError
        For an error of the file system.
    """
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o666)
    try:
        while data:
            data = data[os.write(handle, data) :]
    finally:
        os.close(handle)


def into_place(file: BinaryIO, path: str | Path) -> None:
    """Flush a complete, open file to disk and rename it to `path`, as `replacing` does.

    Parameters
    ----------
    file : file
        The open file.
    path : str or path
        The new name.

    Raises
    ------
    OSError
        For an error of the file system.
    ExportError
        As `check_target`.
    """
    target = check_target(path)
    _settle(file, target)
    os.replace(file.name, target)
    _settle_folder(target.parent)


def _settle(file: BinaryIO, target: Path) -> None:
    """Flush a file to disk, with the permissions of the target, or of a new file if there is none."""
    file.flush()
    mask = os.umask(0o077)  # the umask cannot be read without setting it
    os.umask(mask)
    os.fchmod(file.fileno(), target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~mask)
    os.fsync(file.fileno())


def _settle_folder(folder: Path) -> None:
    """Flush the folder's new entry to disk, where the system supports it."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def reason(error: OSError) -> str:
    """Message for an error of the file system."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full; nothing was written"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "not allowed to write there"
    return error.strerror or str(error)
