"""Mesh files of a shared job: STL ranges and 3MF parts that tasks write.

Vertices are numbered by their first use. A piece shares some with the one before: those have its numbers. The
text is deflated in blocks of rows, which do not depend on the pieces: the file has the bytes of one machine.
"""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from ..cluster import PAGE, unpack_arrays
from ..common import packages as texts
from ..common.files import flushing, link_or_copy, replacing
from ..common.packages import Fragment, TextSum, combine_checksums, deflate
from ..common.triangles import concatenate
from ..errors import ClusterError
from ..formats import mesh_format, stl
from ..formats._3mf import triangle_rows, vertex_rows, write_fragments
from ..mesh.model import Mesh
from ..mesh.pieces import Pieces
from ..mesh.tips import by_tip
from ..store import Arrays
from ..work import Work, chunks
from .finishing import Checks, Finish
from .mesh_steps import MeshStep, Sampled
from .shared import Shared, StoredPieces


def write_shared(
    finish: Finish, checks: Checks, executor: Shared, path: Path | None, about: dict[str, str]
) -> Mesh | None:
    """Finish, write and check a shared mesh. Returns the mesh, if in one piece."""
    pieces, work, mesh = finish.pieces, executor.work, None
    assert isinstance(pieces, StoredPieces)
    ending, numbers = "" if path is None else path.suffix.lower(), finished(finish, checks, executor)
    if path and ending == ".3mf":
        count = sum(1 for _ in numbers)
        rows = model_rows(pieces, executor, tips=len(pieces) if count > len(pieces) else 0)
        with replacing(path) as file, flushing(file):
            write_fragments(*rows, file, about)
    elif path and ending == ".stl" and executor.pool.pieces.is_local:
        for _ in numbers:
            pass
        link_or_copy(write_stl_ranges(pieces, executor, checks.rows, about), path)
    else:
        executor.leave_to_the_first(executor.tasks(finish, range(len(pieces))))
        meshes = map(pieces.finished, numbers)
        if ending != ".stl":
            mesh = joined_pieces(meshes)
        if path:
            with replacing(path) as file, flushing(file):
                if mesh is None:
                    stl.write_pieces(meshes, file, about, work)
                else:
                    mesh_format(ending).write(mesh, file, about, work)
    executor.pool.finished(executor.job)
    return mesh


def finished(finish: Finish, checks: Checks, executor: Shared) -> Iterator[int]:
    """Finish the pieces. Yields the number of each, and one more if there are triangles at tips."""
    pieces = finish.pieces
    for number, made in enumerate(executor.results(finish, range(len(pieces)), "finishing")):
        checks.include(made)
        yield number
    if sum(len(late.tips) for late in checks.late):
        last = by_tip(checks.late)
        pieces.finish(len(pieces), last)
        checks.rows.append(len(last.triangles))
        yield len(pieces)


def weld_pieces(mesh: Mesh) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Merge equal vertices.

    Returns float32 (n, 3); int32 (m, 3).
    """
    from .._native import weld

    ordered = mesh.in_order()
    points = ordered.vertices.astype(np.float32)
    first, labels = weld(points)
    return points[first], labels[ordered.triangles]


def joined_pieces(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh of the finished triangles of all pieces.

    Returns `Mesh` in mm.
    """
    points, triangles = weld_pieces(concatenate(list(meshes)))
    return Mesh(points.astype(np.float64), triangles)


def piece_rows(starts: NDArray[np.int64], begin: int, end: int) -> Iterator[tuple[int, slice]]:
    """Rows of each piece within a range of the rows of all pieces.

    `starts`: int64 (p + 1,).
    """
    first, last = np.searchsorted(starts, (begin, end - 1), side="right") - 1
    for number in range(first, min(last + 1, len(starts) - 1)):
        start, stop = (int(at) for at in starts[number : number + 2])
        yield number, slice(max(begin - start, 0), min(end, stop) - start)


BLOCKS = 32
"""Blocks of rows of a task, about two seconds."""


@dataclass(frozen=True, eq=False)
class FilePart(MeshStep[Arrays]):
    """A step that writes a part of the file of a job."""

    pieces: StoredPieces

    @classmethod
    def read(cls, about: Arrays, pieces: Pieces, sampled: Callable[[], Sampled]) -> Self:
        """See `MeshStep.read`."""
        assert isinstance(pieces, StoredPieces)
        return cls(pieces, **about)

    def about(self) -> Arrays:
        """See `MeshStep.about`."""
        return {name: value for name, value in vars(self).items() if name != "pieces"}

    @staticmethod
    def pack(result: Arrays) -> Arrays:
        """See `MeshStep.pack`."""
        return result

    @staticmethod
    def unpack(arrays: Arrays) -> Arrays:
        """See `MeshStep.unpack`."""
        return arrays


@dataclass(frozen=True, eq=False)
class NumberVertices(FilePart):
    """Numbers the vertices of a piece that no piece before has, from 0."""

    tips: NDArray[np.int64]  # index of the triangles at tips; 0 if there are none

    def result(self, number: int, work: Work) -> Arrays:
        """Counts, and numbers of the vertices at tips, -1 for those of other pieces."""
        vertices, triangles = self.welded(number)
        before = self.welded(number - 1)[0] if number else vertices[:0]
        fresh = same(vertices, before) < 0
        self.pieces.keep(f"vertices{number}", vertices=vertices, fresh=fresh)
        self.pieces.keep(f"indices{number}", triangles=triangles)
        tips = self.welded(int(self.tips))[0] if self.tips else vertices[:0]
        counts = np.array([np.count_nonzero(fresh), len(triangles)])
        return {"counts": counts, "tips": same(tips, vertices[fresh])}

    def welded(self, number: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Vertices of a piece, by their first use, and triangles."""
        return weld_pieces(self.pieces.finished(number))


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


@dataclass(frozen=True, eq=False)
class Encode(FilePart):
    """Deflates rows of a kind; the numbers count blocks of rows."""

    vertices: NDArray[np.int64]  # first vertex and triangle of each piece, and of the end
    triangles: NDArray[np.int64]
    tips: NDArray[np.int64]  # numbers of the vertices at tips; -1 for those of no other piece

    def result(self, number: int, work: Work) -> Arrays:
        """Checksum and length of the text, which is a file of its own; see `MeshStep.result`."""
        begin = number * BLOCKS * texts.ROWS
        blocks, whole = list[bytes](), TextSum(0, 0)
        for text in self.rows(begin, begin + BLOCKS * texts.ROWS):
            block, about = deflate(text())
            blocks.append(block)
            whole = combine_checksums(whole, about)
        self.pieces.store.write(self.pieces.job, self.text_file(number), blocks)
        return {"text": np.array(whole)}

    def text_file(self, number: int) -> str:
        """Name of the file with the deflated text."""
        return f"text-{self.name}-{number}"

    @abstractmethod
    def rows(self, begin: int, end: int) -> Iterator[texts.Text]:
        """Text of rows, in blocks."""


class EncodeVertices(Encode):
    """Deflates rows of vertices."""

    def rows(self, begin: int, end: int) -> Iterator[texts.Text]:
        """Text of rows, in blocks; see `Encode.rows`."""

        def rows(number: int, part: slice) -> NDArray[np.float32]:
            files = self.pieces.arrays(f"vertices{number}")
            fresh: NDArray[np.float32] = files["vertices"][files["fresh"]][part]
            return fresh

        return vertex_rows(np.concatenate([rows(*of) for of in piece_rows(self.vertices, begin, end)]))


class EncodeTriangles(Encode):
    """Deflates rows of triangles."""

    def rows(self, begin: int, end: int) -> Iterator[texts.Text]:
        """Text of rows, in blocks; see `Encode.rows`."""

        def rows(number: int, part: slice) -> NDArray[np.int64]:
            own = self.pieces.arrays(f"indices{number}")["triangles"]
            return self.numbers(number)[own[part]]

        return triangle_rows(np.concatenate([rows(*of) for of in piece_rows(self.triangles, begin, end)]))

    def numbers(self, number: int) -> NDArray[np.int64]:
        """Number of each vertex of a piece in the mesh."""
        starts, last = self.vertices, len(self.vertices) - 2
        files = self.pieces.arrays(f"vertices{number}")
        vertices, fresh = files["vertices"], files["fresh"]
        result: NDArray[np.int64] = starts[number] - 1 + np.cumsum(fresh)
        if number == last and len(self.tips):
            result[~fresh] = self.tips[~fresh]
        elif number:
            before = self.pieces.arrays(f"vertices{number - 1}")
            at = same(vertices[~fresh], before["vertices"][before["fresh"]])
            result[~fresh] = starts[number - 1] + at
        return result


Rows = tuple[int, Iterator[Fragment]]
"""Number of rows, and their text."""


def model_rows(pieces: StoredPieces, executor: Shared, tips: int) -> tuple[Rows, Rows]:
    """Vertices and triangles of a finished mesh, deflated by the pool."""
    table = number_vertices(pieces, executor, tips)
    steps = EncodeVertices(pieces, **table), EncodeTriangles(pieces, **table)
    rows = [int(table[kind][-1]) for kind in ("vertices", "triangles")]
    counts = [len(chunks(count, BLOCKS * texts.ROWS)) for count in rows]
    parts = [(step, n) for step, count in zip(steps, counts, strict=True) for n in range(count)]
    ranges = zip(steps, map(range, counts), strict=True)
    tasks = list(chain.from_iterable(executor.tasks(*of) for of in ranges))
    executor.leave_to_the_first(tasks)

    def fragments() -> Iterator[Fragment]:
        made = executor.pool.results(tasks, executor.work, "writing")
        for (step, number), data in zip(parts, made, strict=True):
            text = TextSum(*unpack_arrays(data)["text"].tolist())
            yield partial(_append, pieces, step.text_file(number), text)

    made = fragments()
    return (rows[0], islice(made, counts[0])), (rows[1], made)


def number_vertices(pieces: StoredPieces, executor: Shared, tips: int) -> dict[str, NDArray[np.int64]]:
    """Number the vertices of the pieces, and of the triangles at tips as a last one.

    Returns the arrays of `Encode`.
    """
    count, numbers = len(pieces), np.empty(0, np.int64)
    found = list(executor.results(NumberVertices(pieces, np.array(tips)), range(count), "writing"))
    counts = [files["counts"] for files in found]
    if tips:
        vertices, triangles = weld_pieces(pieces.finished(tips))
        numbers = np.full(len(vertices), -1)
        for files, before in zip(found, np.cumsum([0, *(of[0] for of in counts)]), strict=False):
            here = files["tips"] >= 0
            numbers[here] = files["tips"][here] + before
        fresh = numbers < 0
        pieces.keep(f"vertices{count}", vertices=vertices, fresh=fresh)
        pieces.keep(f"indices{count}", triangles=triangles)
        counts.append(np.array([np.count_nonzero(fresh), len(triangles)]))
    vertices, triangles = np.cumsum([np.zeros(2, np.int64), *counts], axis=0).T
    return {"vertices": vertices, "triangles": triangles, "tips": numbers}


def _append(pieces: StoredPieces, name: str, text: TextSum, file: BinaryIO) -> TextSum:
    """Append the deflated text of a file of a job to a file; a `Fragment` but for its first arguments."""
    pieces.store.append(pieces.job, name, file)
    return text


FILE = "file.stl"
"""File of a job with the whole STL file."""

FIRST = -stl.HEADER // 2 * pow(stl.TRIANGLE // 2, -1, PAGE // 2) % (PAGE // 2)
"""First triangle that begins at a multiple of `PAGE` bytes; from there on, every `PAGE // 2`th one does."""

ROWS = 160 * PAGE // 2
"""Triangles of a task, 260 MB."""


@dataclass(frozen=True, eq=False)
class Place(FilePart):
    """Writes a range of the triangles to its place in the STL file; the numbers count ranges."""

    starts: NDArray[np.int64]  # first triangle of each piece, and of the end
    header: NDArray[np.uint8]  # header of the file

    def result(self, number: int, work: Work) -> Arrays:
        """Write a range; the result is empty. See `MeshStep.result`."""
        begin, end = place(number), place(number + 1)
        start = stl.HEADER + stl.TRIANGLE * begin if begin else 0

        def blocks() -> Iterator[bytes | memoryview]:
            if not begin:
                yield self.header.tobytes()
            for piece, rows in piece_rows(self.starts, begin, end):
                mesh = self.pieces.finished(piece)
                yield from stl.blocks(Mesh(mesh.vertices, mesh.triangles[rows]), work.threads)

        self.pieces.store.put(self.pieces.job, FILE, start, blocks())
        return {}


def place(number: int) -> int:
    """First triangle of a task."""
    return FIRST + number * ROWS if number else 0


def write_stl_ranges(pieces: StoredPieces, executor: Shared, rows: list[int], about: dict[str, str]) -> str:
    """Write an STL file by tasks, in the folder of the results."""
    folder, total = executor.pool.pieces, sum(rows)
    head = np.frombuffer(stl.header(total, about), np.uint8)
    count = max(-(-(total - FIRST) // ROWS), 1)
    tasks = executor.tasks(Place(pieces, np.cumsum([0, *rows]), head), range(count))
    executor.leave_to_the_first(tasks)
    for _ in executor.pool.make(tasks, executor.work, "writing"):
        pass
    path = folder.path(f"{executor.job}/{FILE}")
    assert path is not None
    if not os.path.exists(path) or os.path.getsize(path) != stl.HEADER + stl.TRIANGLE * total:
        raise ClusterError(f"{path}: expected {total} triangles; remove the folder and start again")
    return path
