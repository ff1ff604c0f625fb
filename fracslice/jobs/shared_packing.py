"""A 3MF file from the finished triangles of a shared mesh: tasks number the vertices and deflate the text.

Vertices are numbered by their first use. A piece shares some with the one before: those have its numbers. The
text is deflated in blocks of rows, which do not depend on the pieces: the file has the bytes of one machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, Files, ResultFolder, packed, unpacked
from ..export import text as texts
from ..export.packages import Fragment, TextSum, deflated, followed
from ..export.threemf import triangle_rows, vertex_rows
from ..work import Work, chunks
from .finished_pieces import piece_rows, read_finished, welded
from .mesh_tasks import MeshTask, finished_file
from .shared_mesh import SharedSurface, leave_to_the_first, results

BLOCKS = 32
"""Blocks of rows of a task, about two seconds."""

NUMBERS = "numbers"
"""File with the first vertex and triangle of each piece."""


@dataclass(frozen=True)
class NumberTask(MeshTask):
    """Numbers the vertices of a piece that no piece before has, from 0.

    Attributes
    ----------
    tips : int
        Index of the triangles at tips; 0 if there are none.
    """

    stage = "numbered"
    tips: int

    def make(self, work: Work) -> Contents:
        """Counts, and the numbers of vertices at tips, -1 for those of other pieces; see `Task.make`."""
        vertices, triangles = self.welded(self.number)
        before = self.welded(self.number - 1)[0] if self.number else vertices[:0]
        fresh = same(vertices, before) < 0
        self.pieces.write(self.job, vertices_file(self.number), packed(vertices=vertices, fresh=fresh))
        self.pieces.write(self.job, indices_file(self.number), triangles.tobytes())
        tips = self.welded(self.tips)[0] if self.tips else vertices[:0]
        return packed(
            counts=np.array([np.count_nonzero(fresh), len(triangles)]),
            tips=same(tips, vertices[fresh]),
        )

    def welded(self, number: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Vertices of a piece, by their first use, and triangles."""
        return welded(read_finished(self.pieces, self.job, finished_file(number)))


def same(points: NDArray[np.float32], others: NDArray[np.float32]) -> NDArray[np.int64]:
    """Index of the bitwise equal one of other points, for each point; -1 if there is none."""
    result = np.full(len(points), -1)
    if not len(points) or not len(others):
        return result
    low, high = points[:, 0].min(), others[:, 0].max()
    ours, theirs = np.flatnonzero(points[:, 0] <= high), np.flatnonzero(others[:, 0] >= low)
    keys, values = (np.ascontiguousarray(of).view("V12").ravel() for of in (points[ours], others[theirs]))
    _, mine, other = np.intersect1d(keys, values, return_indices=True)
    result[ours[mine]] = theirs[other]
    return result


def vertices_file(number: int) -> str:
    """Name of the file with the vertices of a piece."""
    return f"vertices{number}"


def indices_file(number: int) -> str:
    """Name of the file with the triangles of a piece, by its own vertices."""
    return f"indices{number}"


@dataclass(frozen=True)
class EncodeTask(MeshTask):
    """Deflates rows of a kind; `number` counts the tasks of the kind."""

    def make(self, work: Work) -> Contents:
        """Checksum and length of the text, which is a file of its own; see `Task.make`."""
        table = unpacked(self.pieces.read(self.job, NUMBERS))
        begin = self.number * BLOCKS * texts.ROWS
        blocks, whole = list[bytes](), TextSum(0, 0)
        for text in self.rows(table, begin, begin + BLOCKS * texts.ROWS):
            block, about = deflated(text())
            blocks.append(block)
            whole = followed(whole, about)
        self.pieces.write(self.job, self.text_file, blocks)
        return packed(text=np.array(whole))

    @property
    def text_file(self) -> str:
        """Name of the file with the deflated text."""
        return f"text-{self.name}"

    def rows(self, table: Files, begin: int, end: int) -> Iterator[texts.Text]:
        """Text of rows, in blocks."""
        raise NotImplementedError


class EncodeVertices(EncodeTask):
    """Deflates rows of vertices."""

    stage = "encoded-vertices"

    def rows(self, table: Files, begin: int, end: int) -> Iterator[texts.Text]:
        """Text of rows, in blocks; see `EncodeTask.rows`."""

        def rows(number: int, part: slice) -> NDArray[np.float32]:
            files = unpacked(self.pieces.read(self.job, vertices_file(number)))
            fresh: NDArray[np.float32] = files["vertices"][files["fresh"]][part]
            return fresh

        return vertex_rows(np.concatenate([rows(*of) for of in piece_rows(table["vertices"], begin, end)]))


class EncodeTriangles(EncodeTask):
    """Deflates rows of triangles."""

    stage = "encoded-triangles"

    def rows(self, table: Files, begin: int, end: int) -> Iterator[texts.Text]:
        """Text of rows, in blocks; see `EncodeTask.rows`."""

        def rows(number: int, part: slice) -> NDArray[np.int64]:
            own = np.frombuffer(self.pieces.read(self.job, indices_file(number)), np.int32)
            return self.numbers(table, number)[own.reshape(-1, 3)[part]]

        return triangle_rows(np.concatenate([rows(*of) for of in piece_rows(table["triangles"], begin, end)]))

    def numbers(self, table: Files, number: int) -> NDArray[np.int64]:
        """Number of each vertex of a piece in the mesh."""
        starts, last = table["vertices"], len(table["vertices"]) - 2
        files = unpacked(self.pieces.read(self.job, vertices_file(number)))
        vertices, fresh = files["vertices"], files["fresh"]
        result: NDArray[np.int64] = starts[number] - 1 + np.cumsum(fresh)
        if number == last and len(table["tips"]):
            others = table["tips"]
            result[~fresh] = others[~fresh]
        elif number:
            before = unpacked(self.pieces.read(self.job, vertices_file(number - 1)))
            at = same(vertices[~fresh], before["vertices"][before["fresh"]])
            result[~fresh] = starts[number - 1] + at
        return result


Rows = tuple[int, Iterator[Fragment]]
"""Number of rows, and their text."""


def model_rows(surface: SharedSurface, tips: int) -> tuple[Rows, Rows]:
    """Vertices and triangles of a finished mesh, deflated by the pool.

    Parameters
    ----------
    surface : SharedSurface
        Surface whose finished triangles are files of the job.
    tips : int
        Index of the triangles at tips; 0 if there are none.

    Returns
    -------
    tuple, tuple
        Vertices and triangles, for `threemf.write_fragments`.

    Raises
    ------
    SharedError
        For a shard that does not write the output, when its pieces are made.
    """
    recipe, pool, job, clock = surface.recipe, surface.pool, surface.job, surface.clock
    starts = _numbered(surface, tips)
    rows = [int(of[-1]) for of in starts]
    counts = [len(chunks(count, BLOCKS * texts.ROWS)) for count in rows]
    tasks: list[EncodeTask] = [
        kind(recipe, pool.pieces, job, number)
        for kind, count in zip((EncodeVertices, EncodeTriangles), counts, strict=True)
        for number in range(count)
    ]
    leave_to_the_first(surface, tasks)

    def fragments() -> Iterator[Fragment]:
        for task, data in zip(tasks, pool.results(tasks, clock.work, "writing"), strict=True):
            yield partial(_append, pool.pieces, task, TextSum(*unpacked(data)["text"].tolist()))

    made = fragments()
    return (rows[0], islice(made, counts[0])), (rows[1], made)


def _numbered(surface: SharedSurface, tips: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the vertices of the pieces, and of the triangles at tips as a last one.

    Returns the indices of the first vertex and of the first triangle of each piece, and of the end.
    """
    pool, job, pieces = surface.pool, surface.job, len(surface.pieces)
    of = surface.recipe, pool, job
    found = list(results(NumberTask, of, ((n, tips) for n in range(pieces)), "writing", surface.clock))
    counts = [files["counts"] for files in found]
    numbers = np.empty(0, np.int64)
    if tips:
        vertices, triangles = welded(read_finished(pool.pieces, job, finished_file(tips)))
        numbers = np.full(len(vertices), -1)
        for files, before in zip(found, np.cumsum([0, *(of[0] for of in counts)]), strict=False):
            here = files["tips"] >= 0
            numbers[here] = files["tips"][here] + before
        fresh = numbers < 0
        pool.pieces.write(job, vertices_file(pieces), packed(vertices=vertices, fresh=fresh))
        pool.pieces.write(job, indices_file(pieces), triangles.tobytes())
        counts.append(np.array([np.count_nonzero(fresh), len(triangles)]))
    vertices, triangles = np.cumsum([np.zeros(2, np.int64), *counts], axis=0).T
    pool.pieces.write(job, NUMBERS, packed(vertices=vertices, triangles=triangles, tips=numbers))
    return vertices, triangles


def _append(pieces: ResultFolder, task: EncodeTask, text: TextSum, file: BinaryIO) -> TextSum:
    """Append the deflated text of a task to a file; a `Fragment` but for its first arguments."""
    pieces.append(task.job, task.text_file, file)
    return text
