"""Locks against other processes that write the same file or folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import ExportError


def lock(handle: int, path: str | Path) -> None:
    """Lock an open file or folder until it is closed, where the file system supports it.

    Parameters
    ----------
    handle : int
        Its descriptor.
    path : str or Path
        What is written, for the message.

    Raises
    ------
    ExportError
        If another process has locked it.
    """
    try:
        try:
            import fcntl
        except ImportError:
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        raise ExportError(f"{path}: another process is writing it") from None
    except OSError:
        pass  # some file systems have no locks


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Lock a folder during a block, where the system can open folders.

    Yields
    ------
    None
        While it is locked.

    Raises
    ------
    ExportError
        If another process has locked it.
    """
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        yield
        return
    try:
        lock(handle, folder)
        yield
    finally:
        os.close(handle)
