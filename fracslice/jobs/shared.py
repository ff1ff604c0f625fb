"""Steps of a mesh job made by several processes: the recipe of the mesh, tasks, and pieces as files."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, Files, Pool, ResultFolder, Shard, pack_arrays, unpack_arrays
from ..common.cache import key, program
from ..common.messages import format_count
from ..errors import ClusterError, SharedError
from ..mesh.contouring import layers
from ..mesh.model import Mesh
from ..mesh.pieces import HEAD, TAIL, Pieces, Strip, strip_at
from ..mesh.shells import groups, levels
from ..records import MeshJob
from ..scene.reader import reads
from ..store import Arrays
from ..volume import Plan, SignBricks
from ..volume.lattice import BRICK
from ..volume.sampler import Evaluate, brick_signs
from ..volume.sizing import sizing
from ..work import Work, chunks
from .mesh_steps import Contour, Executor, MeshStep, R, Sampled, Summary, joined_summary
from .report import Clock
from .surfaces import apply_edits, plan_mesh

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
