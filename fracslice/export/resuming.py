"""Resumption of interrupted jobs, only from files that the same job of the same user has left."""

from __future__ import annotations

import hashlib
import os
import re
import struct
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain, count, islice
from pathlib import Path
from typing import BinaryIO

from isal.isal_zlib import crc32

from ..common.cache import seal
from ..common.files import (
    BUFFER,
    FULL,
    OWNER_ONLY,
    check_target,
    lock,
    locked_folder,
    open_private,
    remove_leftovers,
    replacing,
    reporting_errors,
)
from ..errors import ExportError, FracsliceWarning

JOB = "job.json"
"""Name of the file that identifies the job of an unfinished folder."""

OURS = b'{"application": "fracslice", '

OF_A_JOB = re.compile(r"\d{5,}\.(png|svg)|job\.json|manifest\.json")
"""Names of files in a folder of layers."""

UNREADABLE = "the finished layers cannot be read back"

KEPT = "the same command goes on from the finished layers"
"""What is left of a job that stops."""

BEGIN = 8
"""Bytes of each layer that are in memory: its area in a print."""

GROUP = 1 << 22
"""Bytes that are read while those before are written."""

_HEAD = struct.Struct("<II")
"""Header of a record: length and CRC-32 of the data."""


@dataclass(eq=False)
class Journal:
    """The finished layers of a job."""

    file: BinaryIO  # binary file, open for reading and writing
    size: int = 0  # size of the file, bytes
    begins: list[bytes] = field(default_factory=list)  # the first `BEGIN` bytes of each layer
    sizes: list[int] = field(default_factory=list)  # size of each layer, bytes

    @property
    def count(self) -> int:
        """Number of finished layers."""
        return len(self.sizes)

    def append(self, layer: bytes) -> None:
        """Append the next layer, which survives the process."""
        self.file.write(_HEAD.pack(len(layer), crc32(layer)) + layer)
        self.file.flush()
        self.add(layer)

    def add(self, layer: bytes) -> None:
        """Count a layer that the file already holds."""
        self.size += _HEAD.size + len(layer)
        self.begins.append(layer[:BEGIN])
        self.sizes.append(len(layer))

    def __iter__(self) -> Iterator[bytes]:
        """Iterate over all layers in order. Raises `ExportError` if a record cannot be read back."""
        return chain.from_iterable(self.groups())

    def groups(self) -> Iterator[list[bytes]]:
        """Iterate over all layers in groups, each of which is read in one go.

        Yields at least `GROUP` bytes of them.
        """
        self.file.seek(0)
        group, size = list[bytes](), 0
        for layer in whole_layers(self.file, self.count):
            group.append(layer)
            size += len(layer)
            if size >= GROUP:
                yield group
                group, size = [], 0
        if group:
            yield group


def whole_layers(file: BinaryIO, count: int) -> Iterator[bytes]:
    """Read layers that `Journal.append` wrote."""
    made = 0
    for layer in islice(_readable(file), count):
        yield layer
        made += 1
    if made < count:
        raise ExportError(UNREADABLE)


def _readable(file: BinaryIO) -> Iterator[bytes]:
    """Layers before the first that is missing, incomplete or damaged."""
    while len(head := file.read(_HEAD.size)) == _HEAD.size:
        size, crc = _HEAD.unpack(head)
        data = file.read(size)
        if len(data) < size or crc32(data) != crc:
            return
        yield data


@contextmanager
def journal(path: str | Path, job: str) -> Iterator[Journal]:
    """Open the journal of a job, truncated after the last complete layer that an interrupted job left.

    The journal is hidden beside the target; a second hidden file identifies its job. Both are removed when
    the block ends and kept when it is interrupted. A journal of another job or another user is discarded
    with a warning.

    `job`: key of everything that determines the bytes.
    """
    target = check_target(path)
    part, manifest = (target.with_name(f".{target.name}.{end}") for end in ("part", "job"))
    with _reporting_resumption(path):
        _remove_foreign(part)
        with open_private(part, "r+b", os.O_CREAT, buffering=BUFFER) as file:
            lock(file.fileno(), path)
            if _read_job_file(manifest).rstrip() != _manifest(job):
                if os.fstat(file.fileno()).st_size:
                    _warn_discarded(path)
                manifest.unlink(missing_ok=True)
                file.truncate()
                os.fsync(file.fileno())  # else, after a power cut, the new job could own the old data
                _write_manifest(manifest, job)
            layers = Journal(file)
            for layer in _readable(file):
                layers.add(layer)
            file.seek(layers.size)
            file.truncate()
            yield layers
        manifest.unlink(missing_ok=True)
        part.unlink(missing_ok=True)


@dataclass(frozen=True)
class FinishedFiles:
    """Finished files of a folder, whose hashes are lines of the file that identifies the job.

    A complete picture of another layer or frame, in the place of a file, is not taken for it.
    """

    journal: BinaryIO  # the file that identifies the job, open for appending, without a buffer
    known: dict[str, str]  # hashes of earlier processes, by the names of files

    @classmethod
    @contextmanager
    def of(cls, journal: Path) -> Iterator[FinishedFiles]:
        """Open the record of a job."""
        with open(journal, "ab", buffering=0) as file:
            yield cls(file, _read_digests(journal))

    def __contains__(self, name: str) -> bool:
        """True if a file is what a process of the job has written."""
        path = Path(self.journal.name).with_name(name)
        return name in self.known and path.is_file() and self.known[name] == _digest(path.read_bytes())

    def add(self, name: str, data: bytes) -> None:
        """Add a file that was written."""
        self.journal.write(f"{_digest(data)} {name}\n".encode())


def sort_finished(journal: Path) -> None:
    """Order the lines of a record by names, so that they do not depend on the order of work."""
    first = journal.read_bytes().partition(b"\n")[0]
    lines = [f"{digest} {name}\n".encode() for name, digest in sorted(_read_digests(journal).items())]
    with replacing(journal) as file:
        file.writelines([first + b"\n", *lines])


def _read_digests(journal: Path) -> dict[str, str]:
    lines = journal.read_text(encoding="utf-8", errors="replace").splitlines()[1:]
    return {name: digest for digest, _, name in (line.partition(" ") for line in lines)}


def _digest(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=16).hexdigest()


@contextmanager
def resumable_folder(
    folder: Path, job: str, name: Callable[[int], str]
) -> Iterator[tuple[int, FinishedFiles]]:
    """Make the folder of a job, or resume the one that an interrupted job left.

    Layers of another interrupted job are removed with a warning.

    `job`: key of everything that determines the bytes. Yields the number of finished layers, and the record
    of finished files.
    """
    with reporting_errors(folder):
        folder.mkdir(exist_ok=True)
    with _reporting_resumption(folder), locked_folder(folder):
        remove_leftovers(folder)
        names = set(os.listdir(folder))
        first = _read_job_file(folder / JOB).partition(b"\n")[0]
        if names and not (first.startswith(OURS) and all(map(OF_A_JOB.fullmatch, names))):
            raise ExportError(f"{folder}: the folder is not empty, and its files are no interrupted job")
        if first != _manifest(job):
            if names:
                _warn_discarded(folder)
            for layer in sorted(names - {JOB}):
                (folder / layer).unlink()
            _write_manifest(folder / JOB, job)
        with FinishedFiles.of(folder / JOB) as finished:
            yield next(index for index in count() if name(index) not in finished), finished
        (folder / JOB).unlink()


@contextmanager
def _reporting_resumption(path: str | Path) -> Iterator[None]:
    """`reporting_errors`, which says of a full disk that finished layers are kept."""
    try:
        with reporting_errors(path):
            yield
    except ExportError as error:
        if isinstance(error.__cause__, OSError) and error.__cause__.errno in FULL:
            raise ExportError(f"{path}: the disk is full; {KEPT}") from error.__cause__
        raise


def _read_job_file(manifest: Path) -> bytes:
    """Contents of a job file; empty if it is missing or others can have written it."""
    try:
        with open_private(manifest, "rb") as file:
            return file.read()
    except OSError:
        return b""


def _write_manifest(manifest: Path, job: str) -> None:
    with replacing(manifest, OWNER_ONLY) as file:
        file.write(_manifest(job) + b"\n")


def _manifest(job: str) -> bytes:
    return OURS + f'"job": "{seal(job)}"}}'.encode()


def _warn_discarded(path: str | Path) -> None:
    text = f"{path}: layers left by another job or another user are discarded; begun afresh"
    warnings.warn(text, FracsliceWarning, stacklevel=2)


def _remove_foreign(part: Path) -> None:
    """Remove an entry in place of the journal, such as a link, that others can write."""
    try:
        with open_private(part, "rb"):
            return
    except FileNotFoundError:
        return
    except OSError:
        part.unlink()
