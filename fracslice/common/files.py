"""Atomic and flushed file writes, with errors of one line."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import BinaryIO

from ..errors import ExportError
from .private import NO_LINK

FLUSH_S = 0.05
"""Seconds between two flushes of a file that is being written; small ones are complete before the first."""

BUFFER = 1 << 20
"""Bytes of a file that are written at once: an archive has thousands of small members."""

LARGE = 1 << 26
"""Bytes of a replaced file that another thread releases."""


FULL = errno.ENOSPC, errno.EDQUOT
"""Errors of a full disk."""


@contextmanager
def reported(path: str | Path) -> Iterator[None]:
    """Raise errors of the file system as `ExportError`, with the path and the reason in one line.

    Parameters
    ----------
    path
        File or folder that the message names.

    Raises
    ------
    ExportError
        For an error of the file system.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        if error.errno in FULL:
            reason = "the disk is full; the file was not written"
        elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            reason = "not allowed to write there"
        raise ExportError(f"{path}: {reason}") from error


def check_target(path: str | Path) -> Path:
    """Check that a file can be written; nothing is changed.

    Parameters
    ----------
    path
        File to write.

    Returns
    -------
    Path
        The path with links resolved.

    Raises
    ------
    ExportError
        If the folder is missing or not writable, or if `path` is itself a folder, a device or a pipe.
    """
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        wrong = "is a file, not a folder" if target.parent.exists() else "does not exist"
        raise ExportError(f"{path}: the folder {target.parent} {wrong}")
    if target.is_dir():
        raise ExportError(f"{path}: is a folder")
    if target.exists() and not target.is_file():
        raise ExportError(f"{path}: is a device or a pipe; expected a file, which is replaced")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise ExportError(f"{path}: the folder {target.parent} is not writable")
    return target


@contextmanager
def replacing(path: str | Path, mode: int | None = None) -> Iterator[BinaryIO]:
    """Write a file atomically: it appears at `path` complete when the block ends, or not at all.

    The temporary file lies beside the target, with permissions for its owner only, and is flushed to disk
    before it is renamed. Any error, KeyboardInterrupt included, removes it.

    Parameters
    ----------
    path
        File to write.
    mode
        Permissions; by default those of the file that is replaced, or of a new file.

    Yields
    ------
    BinaryIO
        Temporary file, open for writing.

    Raises
    ------
    ExportError
        For an error of the file system.
    """
    target = check_target(path)
    with reported(path):
        handle, part = tempfile.mkstemp(".part", f".{target.name[:100]}.", target.parent)
        try:
            with os.fdopen(handle, "wb", BUFFER) as file:
                yield file
                file.flush()
                os.chmod(part, _permissions(target) if mode is None else mode)
                os.fsync(handle)
            _replace(part, target)
        except BaseException:
            with suppress(FileNotFoundError):
                os.unlink(part)
            raise


def linked(source: str, path: str | Path) -> None:
    """Give a complete file another name atomically; copy it where the file system cannot link it.

    Raises
    ------
    ExportError
        For an error of the file system.
    """
    target = check_target(path)
    part = str(target.with_name(f".{target.name[:100]}.{token_hex(8)}.part"))
    try:
        with open(source, "rb") as file:
            os.link(source, part)
            os.chmod(part, _permissions(target))
            os.fsync(file.fileno())
        _replace(part, target)
        with suppress(FileNotFoundError):
            os.unlink(part)  # still there if it was the target's already: POSIX does not rename then
    except OSError:
        with suppress(FileNotFoundError):
            os.unlink(part)
        with replacing(path) as file, open(source, "rb") as whole:
            appended(whole, file)


def appended(source: BinaryIO, target: BinaryIO) -> int:
    """Append a file to another one, by the kernel where it can.

    Parameters
    ----------
    source, target : file
        Binary files, open for reading and for writing.

    Returns
    -------
    int
        Number of bytes.
    """
    count, copy = os.fstat(source.fileno()).st_size, getattr(os, "copy_file_range", None)
    with suppress(OSError):  # of memory, on other file systems, or in an old kernel
        target.flush()
        while copy and (done := copy(source.fileno(), target.fileno(), count, source.tell(), target.tell())):
            source.seek(done, os.SEEK_CUR)
            target.seek(done, os.SEEK_CUR)
    shutil.copyfileobj(source, target, 1 << 22)
    return count


@contextmanager
def flushing(file: BinaryIO) -> Iterator[None]:
    """Flush a file to disk again and again while a block writes it, so that little is left for the end.

    Parameters
    ----------
    file
        File, open for writing.

    Yields
    ------
    None
        While the file is flushed.

    Raises
    ------
    OSError
        For an error of the file system.
    """
    ended = threading.Event()

    def flush() -> None:
        while not ended.wait(FLUSH_S):
            os.fsync(file.fileno())

    with ThreadPoolExecutor(1) as pool:
        flushed = pool.submit(flush)
        try:
            yield
        finally:
            ended.set()
    flushed.result()


def put(path: str, data: bytes) -> None:
    """Write one of many files with as few system calls as possible, neither atomically nor flushed to disk.

    The caller must check the files that an interrupted job left before using them.

    Parameters
    ----------
    path
        File to write; links are not followed.
    data
        Contents.

    Raises
    ------
    OSError
        For an error of the file system.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | NO_LINK | getattr(os, "O_BINARY", 0)
    handle = os.open(path, flags, 0o666)
    try:
        while data:
            data = data[os.write(handle, data) :]
    finally:
        os.close(handle)


def _permissions(target: Path) -> int:
    """Permissions of a file, or of a new one if it does not exist."""
    mask = os.umask(0o077)  # the umask cannot be read without setting it
    os.umask(mask)
    return target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~mask


def _replace(part: str, target: Path) -> None:
    """Move a file to its name; another thread releases a large one that had it."""
    old = _held(target)
    try:
        os.replace(part, target)
        _flush_folder(target.parent)
    finally:
        if old is not None:
            threading.Thread(target=os.close, args=(old,)).start()


def _held(target: Path) -> int | None:
    """Open a large file before it is replaced. It is released when closed, a third of a second per GB."""
    with suppress(OSError):
        if os.name == "posix" and target.stat().st_size >= LARGE:
            return os.open(target, os.O_RDONLY)
    return None


def _flush_folder(folder: Path) -> None:
    """Flush the folder's new entry to disk, where the system supports it."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
