"""Steps of a mesh job made by several processes: the recipe of the mesh, tasks, pieces as files, and parts of
the file that tasks write.

Vertices are numbered by their first use. A piece shares some with the one before: those have its numbers. The
text is deflated in blocks of rows, which do not depend on the pieces: the file has the bytes of one machine.
"""

from __future__ import annotations

import os
import threading
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain, count, islice
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from ..cluster import PAGE, Contents, Files, Pool, ResultFolder, Shard, pack_arrays, unpack_arrays
from ..common import files as texts
from ..common.arrays import concatenate
from ..common.cache import key, program
from ..common.files import Fragment, TextSum, combine_checksums, deflate, flushing, link_or_copy, replacing
from ..common.messages import format_count
from ..errors import ClusterError, SharedError
from ..formats import mesh_format, stl
from ..formats._3mf import triangle_rows, vertex_rows, write_fragments
from ..mesh.contouring import layers
from ..mesh.model import Mesh
from ..mesh.shells import HEAD, TAIL, Pieces, Strip, groups, levels, strip_at
from ..mesh.tips import by_tip
from ..records import MeshJob
from ..scene.reader import reads
from ..store import Arrays
from ..volume import Plan, SignBricks
from ..volume.amount import sizing
from ..volume.bricks import BRICK
from ..volume.sampler import Evaluate, brick_signs
from ..work import Work, chunks
from .mesh_steps import (
    Checks,
    Contour,
    Executor,
    Finish,
    MeshStep,
    R,
    Sampled,
    Summary,
    apply_edits,
    joined_summary,
    plan_mesh,
)
from .report import Clock

SAMPLES = "samples"
"""File of a job with its samples."""


@dataclass(frozen=True)
class MeshRecipe:
    """Everything that a mesh is made from; a worker plans it once."""

    scene: str  # XML and name of the scene
    name: str
    what: MeshJob  # size, resolution and changes of the mesh
    edited: bool = False  # true if bodies are chosen in the field; see `planning.apply_edits`

    def plan(self) -> Plan:
        """Plan the field."""
        scene, clock = reads(self.scene, self.name, files_outside=True), Clock(Work(threads=1))
        size = sizing(scene, self.what.size, self.what.scale, clock.work)
        sized = plan_mesh(scene, self.what, size, clock)
        return (apply_edits(sized.planned, scene, self.what, size, clock) if self.edited else sized).planned


def samples_key(recipe: MeshRecipe, root_key: str, signs: SignBricks) -> str:
    """Key of a sampled field."""
    return key(program(), recipe, root_key, signs.origin, signs.voxel, signs.ijk, signs.signs)


_READING = threading.Lock()
_planned = lru_cache(maxsize=2)(MeshRecipe.plan)


def plan_of(recipe: MeshRecipe) -> Plan:
    """Plan of a recipe, made once in a process."""
    with _READING:
        return _planned(recipe)


@lru_cache(maxsize=1)
def _sampled(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    """Field and samples of a job, planned and read once in a process."""
    made, files = _planned(recipe), unpack_arrays(pieces.read(job, SAMPLES))
    lattice = made.lattice
    signs = SignBricks(lattice.origin, lattice.voxel, files["ijk"], files["signs"], files["index"])
    if samples_key(recipe, made.root.key, signs) != str(files["key"]):
        raise ClusterError("the field planned here is another than that of the job")
    result = Sampled(made, signs, threads=1)
    result.contours  # noqa: B018  by one thread
    return result


class StoredPieces(Pieces):
    """Pieces of a surface as files of a job, each with its strips."""

    def __init__(self, store: ResultFolder, job: str, halo: float = 0.0, prefix: str = "") -> None:
        super().__init__(halo=halo)
        self.store, self.job, self.prefix = store, job, prefix

    def anew(self) -> StoredPieces:
        """Return an empty collection with other names; see `Pieces.anew`."""
        return StoredPieces(self.store, self.job, self.halo, f"tipped-{self.prefix}")

    def put(self, number: int, mesh: Mesh, start: float, end: float) -> None:
        """Store a piece and its strips; see `Pieces.put`."""
        super().put(number, mesh, start, end)
        for side, seam in ((HEAD, start), (TAIL, end)):
            part = strip_at(mesh, side, seam, self.halo, threads=1)
            of, arrays = part.mesh, {"numbers": part.numbers, "rows": part.rows}
            self.keep(f"{side}{number}", vertices=of.vertices, triangles=of.triangles, **arrays)

    def strip(self, number: int, side: str, threads: int = 0) -> Strip:
        """Load a strip; see `Pieces.strip`."""
        files = self.arrays(f"{side}{number}")
        return Strip(Mesh(files["vertices"], files["triangles"]), files["numbers"], files["rows"])

    def keep(self, name: str, **arrays: NDArray[Any]) -> None:
        """Store arrays in a file; see `Pieces.keep`."""
        self.store.write(self.job, self.prefix + name, pack_arrays(**arrays))

    def arrays(self, name: str) -> Arrays:
        """Load arrays from their file; see `Pieces.arrays`."""
        return unpack_arrays(self.store.read(self.job, self.prefix + name))

    def about(self) -> Files:
        """What another process finds the pieces by; see `read`."""
        about = {"prefix": self.prefix, "halo": self.halo, "count": self.triangles, "ends": self.ends}
        about |= {"starts": self.starts, "fresh": self.fresh, "labels": self.first_labels}
        return {f"pieces-{name}": np.array(value) for name, value in about.items()}

    @classmethod
    def read(cls, store: ResultFolder, job: str, about: Files) -> StoredPieces:
        """Find the pieces by what `about` returned, which is taken out of the arrays."""

        def taken(name: str) -> Any:
            return about.pop(f"pieces-{name}").tolist()

        pieces = cls(store, job, taken("halo"), taken("prefix"))
        pieces.ends, pieces.starts, pieces._count = taken("ends"), taken("starts"), taken("count")
        pieces.fresh, pieces.first_labels = taken("fresh"), taken("labels")
        return pieces


@dataclass(frozen=True)
class MeshTask:
    """A step of a mesh job for a piece; its result is a file of the job."""

    kind: type[MeshStep[Any]]  # the step
    step: str  # its name, and that of the file with what it is made of
    recipe: MeshRecipe  # the mesh
    pieces: ResultFolder  # folder with the files of the job
    job: str  # key of the mesh and its samples
    number: int  # index of the piece

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"{self.step}-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Make the result; see `Task.make`."""
        with _READING:
            step = _read_step(self.kind, self.step, self.recipe, self.pieces, self.job)
        return pack_arrays(**self.kind.pack(step.result(self.number, work)))


@lru_cache(maxsize=2)
def _read_step(
    kind: type[MeshStep[Any]], step: str, recipe: MeshRecipe, folder: ResultFolder, job: str
) -> MeshStep[Any]:
    """A step of a job from its file, read once in a process."""
    about = unpack_arrays(folder.read(job, step))
    pieces = StoredPieces.read(folder, job, about)
    return kind.read(about, pieces, partial(_sampled, recipe, folder, job))


@dataclass(frozen=True)
class JoinTask:
    """Joins the summaries of consecutive ranges of pieces."""

    recipe: MeshRecipe  # as for `MeshTask`
    pieces: ResultFolder
    job: str
    number: int  # index at its level
    children: tuple[str, ...]  # files with the summaries, in order
    level: int  # level in the tree, from 1

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"joined-{self.level}-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Summary of all pieces below; see `Task.make`."""
        ranges = [read_summary(self.pieces, self.job, name) for name in self.children]
        whole = joined_summary(plan_of(self.recipe).voxel, work.threads, ranges)
        return pack_arrays(**Contour.pack(whole))


def read_summary(pieces: ResultFolder, job: str, name: str) -> Summary:
    """Summary of a range of pieces from its file."""
    return Contour.unpack(unpack_arrays(pieces.read(job, name)))


@dataclass(frozen=True)
class Shared(Executor):
    """A pool of processes, by tasks whose results are files."""

    recipe: MeshRecipe  # the mesh
    pool: Pool  # the processes
    job: str  # key of the mesh and its samples
    work: Work  # progress and cancellation

    def tasks(self, step: MeshStep[Any], numbers: Iterable[int]) -> list[MeshTask]:
        """Tasks of a step for some pieces."""
        assert isinstance(step.pieces, StoredPieces)
        folder, about = self.pool.pieces, {**step.about(), **step.pieces.about()}
        folder.write(self.job, step.name, pack_arrays(**about))
        return [MeshTask(type(step), step.name, self.recipe, folder, self.job, n) for n in numbers]

    def results(self, step: MeshStep[R], numbers: Iterable[int], stage: str) -> Iterator[R]:
        """See `Executor.results`."""
        made = self.pool.results(self.tasks(step, numbers), self.work, stage)
        return (step.unpack(unpack_arrays(data)) for data in made)

    def summary(self, step: Contour, stage: str) -> Summary:
        """Joined by tasks, too, up to the children of the tree's root; see `Executor.summary`."""
        folder, job = self.pool.pieces, self.job

        def make(tasks: Sequence[MeshTask | JoinTask], stage: str = "") -> list[str]:
            for _ in self.pool.make(tasks, self.work, stage):
                pass
            return [task.name for task in tasks]

        names = make(self.tasks(step, range(len(step.cuts))), stage)
        for level, _ in enumerate([*levels(len(names))][:-1], 1):
            children = enumerate(groups(names))
            names = make([JoinTask(self.recipe, folder, job, n, tuple(of), level) for n, of in children])
        ranges = [read_summary(folder, job, name) for name in names]
        return joined_summary(step.of.planned.voxel, self.work.threads, ranges)

    def leave_to_the_first(self, tasks: Sequence[MeshTask]) -> None:
        """Make the own tasks of a shard that does not write the output, and end its job."""
        if isinstance(self.pool, Shard) and not self.pool.first:
            made = self.pool.share(tasks, self.work)
            raise SharedError(f"this shard made {format_count(made, 'piece')}; shard 1 writes the file")


MOST, LEAST, COUNT = 1 << 15, 1 << 14, 256
"""Bricks of a task: of a gigabyte at most, of 1.5 to 2 seconds at least; about `COUNT` tasks between."""


def cuts(signs: SignBricks) -> list[tuple[int, int]]:
    """Layers of bricks of each piece, the same for any number of workers."""
    return layers(signs, min(max(len(signs) // COUNT, LEAST), MOST))


def share_samples(
    recipe: MeshRecipe, planned: Plan, signs: SignBricks, pool: Pool, work: Work
) -> tuple[Shared, list[tuple[int, int]]]:
    """Give samples to a pool. Returns the executor of their mesh, and the layers of bricks of its pieces."""
    pieces, own = cuts(signs), samples_key(recipe, planned.root.key, signs)
    job = key(own, pieces)
    arrays = pack_arrays(ijk=signs.ijk, signs=signs.signs, index=signs.index, key=np.array(own))
    pool.pieces.write(job, SAMPLES, arrays)
    return Shared(recipe, pool, job, work), pieces


BRICKS = 1 << 17
"""Bricks of a task, about a second."""


@dataclass(frozen=True)
class SampleTask:
    """Signs of some bricks."""

    recipe: MeshRecipe  # the mesh
    pieces: ResultFolder  # folder with the corners of the bricks
    job: str  # key of the sampling
    field: str  # key of the field
    step: int  # number of the set of bricks
    first: int  # range of the set
    end: int

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"samples-{self.step:03}-{self.first:09}"

    def make(self, work: Work) -> bytes:
        """Sign bits; see `Task.make`."""
        planned = plan_of(self.recipe)
        if planned.root.key != self.field:
            raise ClusterError("the field planned here is another than that of the job")
        size = 3 * np.dtype(np.int32).itemsize
        data = self.pieces.read(self.job, corners_file(self.step), size * self.first, size * self.end)
        corners = np.frombuffer(data, np.int32).reshape(-1, 3)
        kernel, signs = planned.root.kernel("cpu"), np.empty((len(corners), 64), np.uint8)
        batch = kernel.batch // BRICK**3
        values = np.empty((batch, BRICK**3), np.float32)
        for part in chunks(len(corners), batch):
            here = corners[part]
            signs[part] = brick_signs(kernel, here, planned.lattice, values[: len(here)])
        return signs.tobytes()


def corners_file(step: int) -> str:
    """Name of the file with the corners of a set of bricks."""
    return f"corners-{step:03}"


def by_pool(recipe: MeshRecipe, planned: Plan, pool: Pool, work: Work) -> tuple[str, Evaluate]:
    """Evaluation of bricks by a pool."""
    field, steps = planned.root.key, count()
    job = key(program(), "samples", recipe, field, planned.lattice)

    def evaluate(corners: NDArray[np.int32]) -> NDArray[np.uint8]:
        step = next(steps)
        tasks = [
            SampleTask(recipe, pool.pieces, job, field, step, part.start, part.stop)
            for part in chunks(len(corners), BRICKS)
        ]
        pool.pieces.write(job, corners_file(step), corners.tobytes())
        signs = b"".join(pool.results(tasks, work))
        return np.frombuffer(signs, np.uint8).reshape(-1, 64)

    return job, evaluate


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
