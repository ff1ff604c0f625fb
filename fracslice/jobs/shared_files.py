"""Mesh files of a shared job: STL ranges and 3MF parts that tasks write, and their checks.

Vertices are numbered by their first use. A piece shares some with the one before: those have its numbers. The
text is deflated in blocks of rows, which do not depend on the pieces: the file has the bytes of one machine.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import count, islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..cluster import PAGE, Contents, Files, ResultFolder, pack_arrays, unpack_arrays
from ..common.files import flushing, link_or_copy, replacing
from ..errors import ClusterError
from ..export import FORMATS, stl
from ..export import packages as texts
from ..export.packages import Fragment, TextSum, combine_checksums, deflate
from ..export.threemf import triangle_rows, vertex_rows, write_fragments
from ..mesh.checks import Tally, distances, surface_samples
from ..mesh.model import Mesh
from ..mesh.tips import by_tip
from ..work import Work, chunks
from .finishing import Finish, stride
from .shared_mesh import (
    FinishTask,
    MeshTask,
    MissedTask,
    SharedSurface,
    far_file,
    finished_file,
    leave_to_the_first,
    results,
)
from .shared_pieces import (
    CHOICE,
    StoredPieces,
    finished_mesh,
    joined_pieces,
    piece_rows,
    read_finished,
    weld_pieces,
)


@dataclass
class SharedCheck:
    """Sums over finished pieces."""

    surface: SharedSurface  # the surface
    points: NDArray[np.float64]  # points of the field's surface
    # triangles of the file of each piece; those at tips are the last piece
    rows: list[int] = field(default_factory=list)
    tally: Tally = field(default_factory=Tally)  # sums
    contact: float = 0.0  # area on the plate, mm2
    # shells of bodies that nearly touch others, of each piece
    near: list[NDArray[np.int64]] = field(default_factory=list)
    # distances of vertices from the surface, scene units
    off: list[NDArray[np.float64]] = field(default_factory=list)
    # distances of the points from the mesh, scene units
    back: NDArray[np.float64] = field(default_factory=lambda: np.array(np.inf))

    def add(self, files: Files) -> None:
        """Add the result of a `FinishTask`."""
        self.rows.append(int(files["rows"]))
        self.tally.include(Tally(**json.loads(str(files["tally"]))))
        self.contact += float(files["contact"])
        self.near.append(files["near"])
        self.off.append(np.asarray(files["errors"]))
        self.back = np.minimum(self.back, files["distances"])

    def end(self) -> None:
        """Measure the distances of points without triangles nearby; remove the files of the job."""
        surface, turns = self.surface, count()
        ends, margin = np.array(surface.pieces.ends), surface.planned.voxel

        def search(points: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
            turn, x = next(turns), points[:, :1]
            surface.pool.pieces.write(
                surface.job, far_file(turn), pack_arrays(points=points, reach=np.array(reach))
            )
            begins = np.concatenate([[-np.inf], ends[:-1]])
            near = (x > begins - reach - margin) & (x < ends + reach + margin)
            abouts = [(int(number), turn) for number in np.flatnonzero(near.any(axis=0))]
            of = surface.recipe, surface.pool, surface.job
            made = results(MissedTask, of, abouts, "checking", surface.clock)
            result = np.full(len(points), np.inf)
            for files in made:
                np.minimum(result, files["distances"], out=result)
            return result

        self.back = distances(search, self.points, margin, self.back)
        surface.pool.finished(surface.job)


def finish_pieces(surface: SharedSurface, finish: Finish) -> tuple[SharedCheck, Iterator[str]]:
    """Finish the pieces."""
    stored, pool, place = surface.pieces, surface.pool, finish.place
    assert isinstance(stored, StoredPieces)
    points = surface_samples(surface.planned, surface.clock.work)
    first = stored.first_labels or [0] * len(stored)
    choice = pack_arrays(
        prefix=np.array(stored.prefix),
        ends=np.array(stored.ends),
        fresh=np.array(stored.fresh, np.int64),
        first_labels=np.array(first, np.int32),
        stays=finish.stays[surface.shells.of_label],
        placed=np.array([place.scale, *place.offset]),
        points=points,
        tips=finish.tips,
        stride=np.array(stride(len(surface.signs))),
    )
    pool.pieces.write(surface.job, CHOICE, choice)
    check = SharedCheck(surface, points)
    return check, _files(surface, check)


def _files(surface: SharedSurface, check: SharedCheck) -> Iterator[str]:
    late: list[tuple[int, NDArray[np.float64]]] = []
    for number, files in enumerate(surface.results(FinishTask, range(len(surface.pieces)), "finishing")):
        check.add(files)
        late += zip(files["late"].tolist(), np.asarray(files["corners"]), strict=True)
        yield finished_file(number)
    if late:
        last, name = by_tip(late), finished_file(len(surface.pieces))
        surface.pool.pieces.write(surface.job, name, finished_mesh(last))
        check.rows.append(len(last.triangles))
        yield name


BLOCKS = 32
"""Blocks of rows of a task, about two seconds."""

NUMBERS = "numbers"
"""File with the first vertex and triangle of each piece."""


@dataclass(frozen=True)
class NumberTask(MeshTask):
    """Numbers the vertices of a piece that no piece before has, from 0."""

    stage = "numbered"
    tips: int  # index of the triangles at tips; 0 if there are none

    def make(self, work: Work) -> Contents:
        """Counts, and the numbers of vertices at tips, -1 for those of other pieces; see `Task.make`."""
        vertices, triangles = self.welded(self.number)
        before = self.welded(self.number - 1)[0] if self.number else vertices[:0]
        fresh = same(vertices, before) < 0
        self.pieces.write(self.job, vertices_file(self.number), pack_arrays(vertices=vertices, fresh=fresh))
        self.pieces.write(self.job, indices_file(self.number), triangles.tobytes())
        tips = self.welded(self.tips)[0] if self.tips else vertices[:0]
        return pack_arrays(
            counts=np.array([np.count_nonzero(fresh), len(triangles)]),
            tips=same(tips, vertices[fresh]),
        )

    def welded(self, number: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Vertices of a piece, by their first use, and triangles."""
        return weld_pieces(read_finished(self.pieces, self.job, finished_file(number)))


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
        table = unpack_arrays(self.pieces.read(self.job, NUMBERS))
        begin = self.number * BLOCKS * texts.ROWS
        blocks, whole = list[bytes](), TextSum(0, 0)
        for text in self.rows(table, begin, begin + BLOCKS * texts.ROWS):
            block, about = deflate(text())
            blocks.append(block)
            whole = combine_checksums(whole, about)
        self.pieces.write(self.job, self.text_file, blocks)
        return pack_arrays(text=np.array(whole))

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
            files = unpack_arrays(self.pieces.read(self.job, vertices_file(number)))
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
        files = unpack_arrays(self.pieces.read(self.job, vertices_file(number)))
        vertices, fresh = files["vertices"], files["fresh"]
        result: NDArray[np.int64] = starts[number] - 1 + np.cumsum(fresh)
        if number == last and len(table["tips"]):
            others = table["tips"]
            result[~fresh] = others[~fresh]
        elif number:
            before = unpack_arrays(self.pieces.read(self.job, vertices_file(number - 1)))
            at = same(vertices[~fresh], before["vertices"][before["fresh"]])
            result[~fresh] = starts[number - 1] + at
        return result


Rows = tuple[int, Iterator[Fragment]]
"""Number of rows, and their text."""


def model_rows(surface: SharedSurface, tips: int) -> tuple[Rows, Rows]:
    """Vertices and triangles of a finished mesh, deflated by the pool."""
    recipe, pool, job, clock = surface.recipe, surface.pool, surface.job, surface.clock
    starts = _number_vertices(surface, tips)
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
            yield partial(_append, pool.pieces, task, TextSum(*unpack_arrays(data)["text"].tolist()))

    made = fragments()
    return (rows[0], islice(made, counts[0])), (rows[1], made)


def _number_vertices(surface: SharedSurface, tips: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the vertices of the pieces, and of the triangles at tips as a last one.

    Returns the indices of the first vertex and of the first triangle of each piece, and of the end.
    """
    pool, job, pieces = surface.pool, surface.job, len(surface.pieces)
    of = surface.recipe, pool, job
    found = list(results(NumberTask, of, ((n, tips) for n in range(pieces)), "writing", surface.clock))
    counts = [files["counts"] for files in found]
    numbers = np.empty(0, np.int64)
    if tips:
        vertices, triangles = weld_pieces(read_finished(pool.pieces, job, finished_file(tips)))
        numbers = np.full(len(vertices), -1)
        for files, before in zip(found, np.cumsum([0, *(of[0] for of in counts)]), strict=False):
            here = files["tips"] >= 0
            numbers[here] = files["tips"][here] + before
        fresh = numbers < 0
        pool.pieces.write(job, vertices_file(pieces), pack_arrays(vertices=vertices, fresh=fresh))
        pool.pieces.write(job, indices_file(pieces), triangles.tobytes())
        counts.append(np.array([np.count_nonzero(fresh), len(triangles)]))
    vertices, triangles = np.cumsum([np.zeros(2, np.int64), *counts], axis=0).T
    pool.pieces.write(job, NUMBERS, pack_arrays(vertices=vertices, triangles=triangles, tips=numbers))
    return vertices, triangles


def _append(pieces: ResultFolder, task: EncodeTask, text: TextSum, file: BinaryIO) -> TextSum:
    """Append the deflated text of a task to a file; a `Fragment` but for its first arguments."""
    pieces.append(task.job, task.text_file, file)
    return text


FILE, PLACES = "file.stl", "places"
"""Files of a job: the STL file, and the first triangle of each piece in it."""

FIRST = -stl.HEADER // 2 * pow(stl.TRIANGLE // 2, -1, PAGE // 2) % (PAGE // 2)
"""First triangle that begins at a multiple of `PAGE` bytes; from there on, every `PAGE // 2`th one does."""

ROWS = 160 * PAGE // 2
"""Triangles of a task, 260 MB."""


class PlaceTask(MeshTask):
    """Writes a range of the triangles to its place in the STL file."""

    stage = "placed"

    def make(self, work: Work) -> Contents:
        """Write the range; the result is empty. See `Task.make`."""
        about = unpack_arrays(self.pieces.read(self.job, PLACES))
        begin, end = place(self.number), place(self.number + 1)
        start = stl.HEADER + stl.TRIANGLE * begin if begin else 0

        def blocks() -> Iterator[bytes | memoryview]:
            if not begin:
                yield about["header"].tobytes()
            for number, rows in piece_rows(about["starts"], begin, end):
                mesh = read_finished(self.pieces, self.job, finished_file(number))
                yield from stl.blocks(Mesh(mesh.vertices, mesh.triangles[rows]), work.threads)

        self.pieces.put(self.job, FILE, start, blocks())
        return b""


def place(number: int) -> int:
    """First triangle of a task."""
    return FIRST + number * ROWS if number else 0


def write_stl_ranges(surface: SharedSurface, rows: list[int], about: dict[str, str]) -> str:
    """Write an STL file by tasks, in the folder of the results."""
    pool, job, total = surface.pool, surface.job, sum(rows)
    head = np.frombuffer(stl.header(total, about), np.uint8)
    pool.pieces.write(job, PLACES, pack_arrays(starts=np.cumsum([0, *rows]), header=head))
    count = max(-(-(total - FIRST) // ROWS), 1)
    tasks = surface.tasks(PlaceTask, range(count))
    leave_to_the_first(surface, tasks)
    for _ in pool.make(tasks, surface.clock.work, "writing"):
        pass
    path = pool.pieces.path(f"{job}/{FILE}")
    assert path is not None
    if not os.path.exists(path) or os.path.getsize(path) != stl.HEADER + stl.TRIANGLE * total:
        raise ClusterError(f"{path}: expected {total} triangles; remove the folder and start again")
    return path


def write_shared(
    surface: SharedSurface, finish: Finish, path: Path | None, about: dict[str, str]
) -> tuple[SharedCheck, Mesh | None]:
    """Finish, write and check a shared mesh."""
    pool, job, ending = surface.pool, surface.job, "" if path is None else path.suffix.lower()
    check, names = finish_pieces(surface, finish)
    meshes, mesh = (read_finished(pool.pieces, job, name) for name in names), None
    if path and ending == ".3mf":
        count = sum(1 for _ in names)
        rows = model_rows(surface, tips=len(surface.pieces) if count > len(surface.pieces) else 0)
        with replacing(path) as file, flushing(file):
            write_fragments(*rows, file, about)
    elif path and ending == ".stl" and pool.pieces.is_local:
        for _ in names:
            pass
        link_or_copy(write_stl_ranges(surface, check.rows, about), path)
    else:
        leave_to_the_first(surface, surface.tasks(FinishTask, range(len(surface.pieces))))
        if ending != ".stl":
            mesh = joined_pieces(meshes)
        if path:
            with replacing(path) as file, flushing(file):
                if mesh is None:
                    stl.write_pieces(meshes, file, about, surface.clock.work)
                else:
                    FORMATS[ending](mesh, file, about, surface.clock.work)
    check.end()
    return check, mesh
