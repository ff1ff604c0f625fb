"""Results of tasks as files of any file system that fsspec knows."""

from __future__ import annotations

import json
import math
import os
import posixpath
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from secrets import token_hex
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from ..common.files import append_file
from ..common.messages import lacking
from ..errors import ClusterError

Contents = bytes | Sequence[bytes | memoryview]
"""Contents of a file, in one block or several."""

PAGE = 1 << 16
"""Bytes of a page of memory, at most."""


class NamedResult(Protocol):
    """Place of a result: job and name."""

    @property
    def job(self) -> str:
        """Key of everything that determines the results of the job."""

    @property
    def name(self) -> str:
        """Name within the job."""


@dataclass(frozen=True)
class ResultFolder:
    """Results of tasks in a folder, written beside and moved, so that each is whole or absent.

    Attributes
    ----------
    url : str
        Folder that all machines can reach: a path, or any URL of fsspec.

    Raises
    ------
    ClusterError
        If fsspec is not installed, or the folder cannot be used.
    """

    url: str

    @cached_property
    def _place(self) -> tuple[Any, str]:
        """File system and root."""
        if reason := lacking("fsspec", "clusters need"):
            raise ClusterError(reason)
        from fsspec.core import url_to_fs

        try:
            system, root = url_to_fs(self.url)
        except (ImportError, ValueError) as error:
            raise ClusterError(f"{self.url}: {error}") from None
        return system, root

    @property
    def is_local(self) -> bool:
        """True for a folder of this machine's file system."""
        return "://" not in self.url

    def has(self, task: NamedResult) -> bool:
        """True if the result of a task is there.

        Parameters
        ----------
        task : Task
            The task.

        Returns
        -------
        bool
        """
        system, root = self._place
        system.invalidate_cache()
        return bool(system.exists(f"{root}/{task.job}/{task.name}"))

    def path(self, name: str) -> str | None:
        """Path of a file of this folder; None if it is no folder of this machine's file system.

        Parameters
        ----------
        name : str
            Name of the file.

        Returns
        -------
        str or None
        """
        if not self.is_local:
            return None
        os.makedirs(self.url, exist_ok=True)
        return os.path.join(self.url, name)

    def read(self, job: str, name: str, start: int | None = None, end: int | None = None) -> bytes:
        """Read a file of a job, or a range of its bytes.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        start, end : int, optional
            Range.

        Returns
        -------
        bytes

        Raises
        ------
        ClusterError
            If it cannot be read.
        """
        system, root = self._place
        try:
            return bytes(system.cat_file(f"{root}/{job}/{name}", start=start, end=end))
        except OSError as error:
            raise ClusterError(f"{self.url}: {job}/{name}: {error}") from None

    def append(self, job: str, name: str, file: BinaryIO) -> int:
        """Append a file of a job to another file; the kernel copies between files of this machine.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        file : file
            Binary file, open for writing.

        Returns
        -------
        int
            Number of bytes.

        Raises
        ------
        ClusterError
            If it cannot be read.
        """
        if not self.is_local:
            return file.write(self.read(job, name))
        try:
            with open(f"{self._place[1]}/{job}/{name}", "rb") as source:
                return append_file(source, file)
        except FileNotFoundError as error:
            raise ClusterError(f"{self.url}: {job}/{name}: {error}") from None

    def write(self, job: str, name: str, data: Contents) -> None:
        """Write a file of a job atomically: beside and moved, or by a conditional put of an object store.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        data : bytes, or a sequence of blocks
            Contents.

        Raises
        ------
        ClusterError
            If it cannot be written.
        """
        system, root = self._place
        path, part = f"{root}/{job}/{name}", f"{root}/{job}/.{name}.{token_hex(8)}.part"
        try:
            system.makedirs(f"{root}/{job}", exist_ok=True)
            if not self.is_local:
                with suppress(FileExistsError):  # the same bytes
                    system.pipe_file(path, data if isinstance(data, bytes) else b"".join(data), mode="create")
            else:
                with system.open(part, "wb") as file:
                    file.writelines([data] if isinstance(data, bytes) else data)
                system.mv(part, path)
        except OSError as error:
            raise ClusterError(f"{self.url}: {error}") from None

    def put(self, job: str, name: str, start: int, blocks: Iterable[bytes | memoryview]) -> None:
        """Write a range of a file of a job, which several processes write; made if it is not there.

        Ranges that begin at multiples of `PAGE` bytes do not disturb each other in a network's file system.

        Parameters
        ----------
        job : str
            Key of the job.
        name : str
            Name of the file.
        start : int
            Byte at which the range begins.
        blocks : iterable of bytes-like
            Contents of the range.

        Raises
        ------
        ClusterError
            If it cannot be written, or this folder is none of this machine's file system.
        """
        path = self.path(f"{job}/{name}")
        if path is None:
            raise ClusterError(f"{self.url}: expected a folder to write ranges of a file")
        try:
            with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o666), "wb") as file:
                file.seek(start)
                file.writelines(blocks)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise ClusterError(f"{path}: {error.strerror}") from None

    def remove(self, job: str) -> None:
        """Remove the files of a job, if there are any.

        Parameters
        ----------
        job : str
            Key of the job.
        """
        system, root = self._place
        with suppress(OSError):
            if self.is_local:
                _empty(f"{root}/{job}")
            system.rm(posixpath.join(root, job), recursive=True)

    def tidy(self) -> None:
        """Remove the folder if it is empty."""
        system, root = self._place
        with suppress(OSError):
            system.rmdir(root)


def _empty(folder: str) -> None:
    """Remove the files of a folder by threads: a large file takes a fifth of a second per GB."""

    def remove(path: str) -> None:
        with suppress(OSError):
            os.unlink(path)

    with ThreadPoolExecutor() as threads:
        list(threads.map(remove, (entry.path for entry in os.scandir(folder))))


Files = dict[str, NDArray[Any]]
"""Arrays by name."""

ALIGNED = 64
"""Bytes to whose multiples arrays are aligned in a file."""


def pack_arrays(**arrays: NDArray[Any]) -> list[bytes | memoryview]:
    """Blocks of arrays: a header line of JSON, then the arrays, without copies and checksums.

    Parameters
    ----------
    **arrays : ndarray
        Arrays by name.

    Returns
    -------
    list of bytes-like
        For `unpack_arrays`, one after another; they view the arrays.
    """
    about, end = dict[str, tuple[str, tuple[int, ...], int]](), 0
    blocks = list[bytes | memoryview]()
    for name, array in arrays.items():
        plain = np.ascontiguousarray(array)
        about[name] = plain.dtype.str, np.shape(array), end
        blocks += [plain.reshape(-1).view(np.uint8).data, bytes(-plain.nbytes % ALIGNED)]
        end += plain.nbytes + len(blocks[-1])
    head = json.dumps(about).encode()
    return [head + b" " * (-len(head) % ALIGNED + ALIGNED - 1) + b"\n", *blocks]


def unpack_arrays(data: bytes) -> Files:
    """Arrays from bytes of `pack_arrays`.

    Parameters
    ----------
    data : bytes
        The blocks in one, which the arrays view.

    Returns
    -------
    dict
        Arrays by name, read-only.
    """
    start = data.index(b"\n") + 1
    arrays: Files = {}
    for name, (kind, shape, begin) in json.loads(data[:start]).items():
        count = math.prod(shape)
        arrays[name] = np.frombuffer(data, kind, count, start + begin).reshape(shape)
    return arrays
