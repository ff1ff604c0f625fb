"""Resumption of interrupted jobs, only from files that the same job of the same user has left."""

from __future__ import annotations

import fcntl
import os
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from fracslice import files
from fracslice.errors import ExportError, FracsliceWarning
from fracslice.export.files import check_target, reason
from fracslice.seals import seal

JOB = "job.json"
"""Name of the file that identifies the job of an unfinished folder."""

OURS = b'{"application": "fracslice", '

LAYER = re.compile(r"\d{5,}\.(png|svg)")
"""Names of layer files in a folder."""


@contextmanager
def remainder(path: str | Path, job: str) -> Iterator[BinaryIO]:
    """Open the partial file that an interrupted job left; empty if there is none.

    The partial file is hidden beside the target; a second hidden file identifies its job. Both are removed
    when the block ends and kept when it is interrupted. A partial file of another job or another user is
    discarded with a warning.

    Parameters
    ----------
    path : str or path
        The file that the job writes.
    job : str
        Key of everything that determines the bytes.

    Yields
    ------
    file
        Binary file, open for reading and writing.

    Raises
    ------
    ExportError
        For an error of the file system, or if another process is writing the same file.
    """
    target = check_target(path)
    part, manifest = (target.with_name(f".{target.name}.{end}") for end in ("part", "job"))
    try:
        _remove_foreign(part)
        with files.opened(part, "r+b", os.O_CREAT) as file:
            _lock(file, path)
            if _read(manifest) != _manifest(job):
                if os.fstat(file.fileno()).st_size:
                    _tell(path)
                manifest.unlink(missing_ok=True)
                file.truncate()
                os.fsync(file.fileno())  # else, after a power cut, the new job could own the old data
                _write_manifest(manifest, job)
            yield file
        manifest.unlink(missing_ok=True)
        part.unlink(missing_ok=True)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


def resumable_folder(
    folder: Path, job: str, name: Callable[[int], str], is_whole: Callable[[bytes], bool]
) -> int:
    """Make the folder of a job, or count the complete layers that an interrupted job left in it.

    Layers of another interrupted job are removed with a warning.

    Parameters
    ----------
    folder : Path
        The folder.
    job : str
        Key of everything that determines the bytes.
    name : callable
        File name of the layer with a given index.
    is_whole : callable
        True if the bytes are a complete layer file.

    Returns
    -------
    int
        Index of the first layer to write.

    Raises
    ------
    ExportError
        For a folder with other files, or an error of the file system.
    """
    try:
        folder.mkdir(exist_ok=True)
        names = set(os.listdir(folder))
        manifest = _read(folder / JOB)
        if names and not (manifest.startswith(OURS) and all(n == JOB or LAYER.fullmatch(n) for n in names)):
            raise ExportError(f"{folder}: the folder is not empty, and what is in it is no interrupted job")
        if manifest != _manifest(job):
            if names:
                _tell(folder)
            for layer in sorted(names - {JOB}):
                (folder / layer).unlink()
            names = set()
            _write_manifest(folder / JOB, job)
        index = 0
        while name(index) in names and is_whole((folder / name(index)).read_bytes()):
            index += 1
        return index
    except OSError as error:
        raise ExportError(f"{folder}: {reason(error)}") from error


def _read(manifest: Path) -> bytes:
    """Contents of a job file; empty if it is missing or others can have written it."""
    try:
        with files.opened(manifest, "rb") as file:
            return file.read()
    except OSError:
        return b""


def _write_manifest(manifest: Path, job: str) -> None:
    with files.replacing(manifest) as file:
        file.write(_manifest(job))


def _manifest(job: str) -> bytes:
    return OURS + f'"job": "{seal(job)}"}}'.encode()


def _tell(path: str | Path) -> None:
    manifest = f"{path}: what was left there by another job, or somebody else, is dropped; begun afresh"
    warnings.warn(manifest, FracsliceWarning, stacklevel=2)


def _remove_foreign(part: Path) -> None:
    """Remove an entry in place of the partial file, such as a link, that others can write."""
    try:
        with files.opened(part, "rb"):
            return
    except FileNotFoundError:
        return
    except OSError:
        part.unlink()


def _lock(file: BinaryIO, path: str | Path) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ExportError(f"{path}: another process is at it") from None
    except OSError:
        pass  # some file systems have no locks
