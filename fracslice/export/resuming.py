"""Where an interrupted job goes on: only what this user's same job left is taken."""

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
"""What an unfinished folder says of itself."""

OURS = b'{"application": "fracslice", '

LAYER = re.compile(r"\d{5,}\.(png|svg)")
"""The names of layers in a folder."""


@contextmanager
def remainder(path: str | Path, job: str) -> Iterator[BinaryIO]:
    """What an interrupted job had written of the file `path`, open to be read and written; empty if nothing.

    It is a hidden file beside the target, and another one says of which job it is: both gone when the block
    ends, kept when it is interrupted. job: the key of all that the bytes follow from. What another job left,
    or another user, is dropped, and a warning says so. Raises ExportError for what the file system refuses,
    and if another process is at it.
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
                os.fsync(file.fileno())  # or after a power cut what is said could be of what was there before
                _write_manifest(manifest, job)
            yield file
        manifest.unlink(missing_ok=True)
        part.unlink(missing_ok=True)
    except OSError as error:
        raise ExportError(f"{path}: {reason(error)}") from error


def resumable_folder(
    folder: Path, job: str, name: Callable[[int], str], is_whole: Callable[[bytes], bool]
) -> int:
    """Makes the folder of a job, or finds how many layers of it an interrupted one left; they must be whole.

    job: its key. name: of each layer's file. The layers of another interrupted job are removed, and a warning
    says so. Raises ExportError for a folder with anything else in it.
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
    """What a file says of a job, if only this user can have written it; nothing otherwise."""
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
    """Removes what stands in a remainder's place and others can write, a link say: it is not written to."""
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
        pass  # not every file system has locks
