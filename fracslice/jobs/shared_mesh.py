"""Surface made by several processes: its recipe, and sampling and contouring as tasks."""

from __future__ import annotations

import json
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from itertools import count
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..cluster import Contents, Files, Pool, ResultFolder, Shard, pack_arrays, unpack_arrays
from ..common.cache import key, program
from ..common.messages import format_count
from ..errors import ClusterError, SharedError
from ..mesh.checks import NEARBY, Tally, nearest
from ..mesh.cleaning import WAITS, SelectedPiece, finished_piece
from ..mesh.contouring import SurfaceContours, layers
from ..mesh.model import Mesh
from ..mesh.ridges import with_ridges
from ..mesh.shells import Nesting, components, groups, levels, survey
from ..mesh.tips import Pointed, at_tips, pointed_in, with_tips
from ..mesh.topology import Shells
from ..mesh.touching import NearBodies
from ..records import MeshJob
from ..scene.reader import reads
from ..volume import Plan, SignBricks
from ..volume.exploration import Evaluate, brick_signs
from ..volume.lattice import BRICK
from ..volume.sizing import sizing
from ..work import Work, chunks
from .finishing import off_surface, on_the_plate, placing
from .planning import apply_edits, plan_mesh
from .report import Clock
from .shared_pieces import (
    SHELLS,
    Selection,
    StoredPieces,
    Summary,
    finished_mesh,
    joined_summary,
    read_choice,
    read_shells,
)
from .surfaces import Surface

SAMPLES = "samples"
"""File of a job with its samples."""


@dataclass(frozen=True)
class MeshRecipe:
    """Everything that a mesh is made from; a worker plans it once."""

    scene: str  # XML and name of the scene
    name: str
    what: MeshJob  # size, resolution and changes of the mesh
    edited: bool = False  # true if the bodies of the scene are chosen in the field; see `planning.edited`

    def plan(self) -> Plan:
        """Plan the field."""
        scene, clock = reads(self.scene, self.name), Clock(Work(threads=1))
        size = sizing(scene, self.what.size, self.what.scale, clock.work)
        sized = plan_mesh(scene, self.what, size, clock)
        return (apply_edits(sized.planned, scene, self.what, size, clock) if self.edited else sized).planned


@dataclass(frozen=True, eq=False)
class Sampled:
    """A planned field and its samples."""

    planned: Plan  # the field
    signs: SignBricks  # its samples
    contours: SurfaceContours  # pieces of its surface


def samples_key(recipe: MeshRecipe, root_key: str, signs: SignBricks) -> str:
    """Key of a sampled field."""
    return key(program(), recipe, root_key, signs.origin, signs.voxel, signs.ijk, signs.signs)


_READING = threading.Lock()
_planned = lru_cache(maxsize=2)(MeshRecipe.plan)


def plan_of(recipe: MeshRecipe) -> Plan:
    """Plan of a recipe, made once in a process."""
    with _READING:
        return _planned(recipe)


def sample_recipe(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    """Field and samples of a job, planned and read once in a process."""
    with _READING:
        return _sampled(recipe, pieces, job)


@lru_cache(maxsize=1)
def _sampled(recipe: MeshRecipe, pieces: ResultFolder, job: str) -> Sampled:
    made, files = _planned(recipe), unpack_arrays(pieces.read(job, SAMPLES))
    lattice = made.lattice
    signs = SignBricks(lattice.origin, lattice.voxel, files["ijk"], files["signs"], files["index"])
    if samples_key(recipe, made.root.key, signs) != str(files["key"]):
        raise ClusterError("the field planned here is another than that of the job")
    return Sampled(made, signs, SurfaceContours(made.root, signs, threads=1))


MOST, LEAST, COUNT = 1 << 15, 1 << 14, 256
"""Bricks of a task: of a gigabyte at most, of 1.5 to 2 seconds at least; about `COUNT` tasks between."""

HALO = WAITS + 0.5
"""Width of the strips at the seams, voxels: wider than the halo that a neighbour takes of them."""


@dataclass(frozen=True)
class MeshTask(ABC):
    """Task of a mesh job."""

    stage: ClassVar[str]  # first part of its name
    recipe: MeshRecipe  # the mesh
    pieces: ResultFolder  # folder with the files of the job
    job: str  # key of the mesh and its samples
    number: int  # index of the piece

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"{self.stage}-{self.number:05}"

    @abstractmethod
    def make(self, work: Work) -> Contents:
        """Make the result; see `Task.make`."""


@dataclass(frozen=True)
class ContourTask(MeshTask):
    """Contours a piece of the surface; its result is the summary by which the pieces are joined."""

    stage = "surface"
    first: int  # layers of bricks, last excluded
    last: int

    def make(self, work: Work) -> Contents:
        """Summary of the piece; see `Task.make`."""
        of = sample_recipe(self.recipe, self.pieces, self.job)
        piece = of.contours.piece(self.first, self.last, of.contours.refiner(work), work)
        start = of.signs.origin[0] + of.signs.voxel * BRICK * self.first if self.number else -np.inf
        voxel = of.planned.voxel
        labels, sums = components(piece.mesh, start, piece.end, voxel, work.threads)
        sharp = pointed_in(piece.mesh, start, piece.end, voxel, work.threads)
        stored = StoredPieces(self.pieces, self.job, HALO * voxel)
        stored.put(self.number, piece.mesh, start, piece.end)
        stored.label(self.number, labels)
        counted = np.array([len(piece.mesh.triangles)])
        return Summary(np.array([piece.end]), counted, sums, sharp, piece.blunt).packed()


@dataclass(frozen=True)
class JoinTask(MeshTask):
    """Joins consecutive ranges of pieces."""

    children: tuple[str, ...]  # files with their summaries, in order
    level: int  # level in the tree, from 1

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"joined-{self.level}-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Summary of all pieces below; see `Task.make`."""
        ranges = [Summary.read(unpack_arrays(self.pieces.read(self.job, name))) for name in self.children]
        return joined_summary(ranges, plan_of(self.recipe).voxel, work.threads).packed()


class NestTask(MeshTask):
    """Searches the surroundings of the shells whose rays are in a piece."""

    stage = "nesting"

    def make(self, work: Work) -> Contents:
        """Winding numbers and parents; see `Task.make`."""
        of = read_shells(self.pieces, self.job)
        stored = StoredPieces(self.pieces, self.job, prefix=of.prefix)
        mesh, labels = stored.mesh(self.number), stored.labels(self.number) + of.first_labels[self.number]
        return pack_arrays(**of.shells.rays(self.number, mesh, labels, of.searched, work.threads)._asdict())


class FinishTask(MeshTask):
    """Cleans and checks a piece."""

    stage = "finished"

    def make(self, work: Work) -> Contents:
        """Measures; the triangles are a file of their own, see `finished_mesh`. See `Task.make`."""
        of = sample_recipe(self.recipe, self.pieces, self.job)
        choice = read_choice(self.pieces, self.job)
        number, voxel, threads = self.number, of.planned.voxel, work.threads
        planes, frame = placing(of.planned, of.signs, choice.place)
        own = self.kept(choice)
        before, after = self.beside(choice, number - 1, "tail"), self.beside(choice, number + 1, "head")
        ends = choice.ends[number - 1] if number else -np.inf, choice.ends[number]
        made = finished_piece(own, before, after, ends, voxel, planes, frame, threads)
        tally = Tally(threads)
        tally.add(made)
        passed, late = made.passed, at_tips(made.passed, choice.tips)
        at = np.flatnonzero(late >= 0)
        plain = passed.selected(late < 0, threads)
        self.pieces.write(self.job, finished_file(number), finished_mesh(plain))
        return pack_arrays(
            rows=np.array(len(plain.triangles)),
            late=late[at],
            near=self.near(choice, own.mesh, voxel, threads),
            corners=passed.vertices[passed.triangles[at]],
            contact=np.array(on_the_plate(passed, threads)),
            tally=np.array(json.dumps(asdict(tally))),
            errors=off_surface(of.planned, choice.place, made.points[:: choice.stride], work),
            distances=nearest([own.mesh], choice.points, NEARBY * voxel, work),
        )

    def near(self, choice: Selection, mesh: Mesh, voxel: float, threads: int) -> NDArray[np.int64]:
        """Shells of the bodies that nearly touch others, in the piece and at its seam with the next one."""
        shells, number = read_shells(self.pieces, self.job).shells, self.number
        stays, stored = np.zeros(len(shells.volumes), bool), choice.stored(self.pieces, self.job)
        stays[shells.of_label] = choice.stays
        bodies = NearBodies(shells, stays, voxel, threads)
        bodies.add(mesh.vertices, self.labels(choice, number), choice.ends[number])
        if number + 1 < len(choice.ends):
            part, _ = stored.beside(number + 1, "head", 0)
            bodies.add(part.mesh.vertices, self.labels(choice, number + 1)[part.numbers], np.inf)
        return bodies.bodies

    def kept(self, choice: Selection) -> SelectedPiece:
        """The piece with the choice of its bodies."""
        mesh, count = choice.stored(self.pieces, self.job).mesh(self.number), choice.fresh[self.number]
        fresh = np.arange(len(mesh.triangles) - count, len(mesh.triangles))
        return SelectedPiece(mesh, self.stays(choice, self.number), fresh)

    def beside(self, choice: Selection, number: int, side: str) -> SelectedPiece | None:
        """Strip of a neighbour with the choice of its bodies; None beyond the ends of the surface."""
        if not 0 <= number < len(choice.ends):
            return None
        stored = choice.stored(self.pieces, self.job)
        part, fresh = stored.beside(number, side, int(choice.fresh[number]))
        return SelectedPiece(part.mesh, self.stays(choice, number)[part.numbers], fresh)

    def stays(self, choice: Selection, number: int) -> NDArray[np.bool_]:
        """True for each vertex of a piece whose body stays."""
        stays: NDArray[np.bool_] = choice.stays[self.labels(choice, number)]
        return stays

    def labels(self, choice: Selection, number: int) -> NDArray[np.int32]:
        """Labels of the vertices of a piece, counted from the first piece on."""
        own = choice.stored(self.pieces, self.job).labels(number)
        labels: NDArray[np.int32] = own + choice.first_labels[number]
        return labels


@dataclass(frozen=True)
class MissedTask(MeshTask):
    """Measures the distances of points without a triangle nearby."""

    turn: int  # how many times the reach has grown

    @property
    def name(self) -> str:
        """Name of the task."""
        return f"missed-{self.turn}-{self.number:05}"

    def make(self, work: Work) -> Contents:
        """Distances to the triangles of the piece; see `Task.make`."""
        far = unpack_arrays(self.pieces.read(self.job, far_file(self.turn)))
        mesh = read_choice(self.pieces, self.job).stored(self.pieces, self.job).mesh(self.number)
        return pack_arrays(distances=nearest([mesh], far["points"], float(far["reach"]), work))


def finished_file(number: int) -> str:
    """Name of the file with the finished triangles of a piece."""
    return f"finished{number}"


def far_file(turn: int) -> str:
    """Name of the file with points without a triangle nearby."""
    return f"far{turn}"


def cuts(signs: SignBricks) -> list[tuple[int, int]]:
    """Layers of bricks of each piece, the same for any number of workers."""
    return layers(signs, min(max(len(signs) // COUNT, LEAST), MOST))


T = TypeVar("T", bound=MeshTask)


@dataclass(frozen=True, eq=False)
class SharedSurface(Surface):
    """Surface whose pieces other processes make."""

    recipe: MeshRecipe  # the mesh
    pool: Pool  # the processes
    job: str  # key of the mesh and its samples
    clock: Clock  # progress, cancellation and timing

    def tasks(self, kind: type[T], numbers: Iterable[int]) -> list[T]:
        """Tasks of a kind for some pieces."""
        return [kind(self.recipe, self.pool.pieces, self.job, number) for number in numbers]

    def results(self, kind: type[MeshTask], numbers: Iterable[int], stage: str) -> Iterator[Files]:
        """Results of tasks, in order."""
        abouts = ((number,) for number in numbers)
        yield from results(kind, (self.recipe, self.pool, self.job), abouts, stage, self.clock)

    def nested(self, bodies: bool, threads: int) -> tuple[Shells, int]:
        """Nesting of the shells, searched by the pool; see `Surface.nested`."""
        shells, stored = self.shells, self.pieces
        assert isinstance(stored, StoredPieces)
        searched = shells.searched(bodies)
        numbers = np.unique(shells.piece[searched]).tolist()
        first = np.array(stored.first_labels or [0] * len(stored), np.int32)
        about = pack_arrays(searched=searched, labels=first, prefix=np.array(stored.prefix), **vars(shells))
        self.pool.pieces.write(self.job, SHELLS, about)
        results = self.results(NestTask, numbers, "nesting")
        rays = {n: Nesting(**files) for n, files in zip(numbers, results, strict=True)}
        return shells.nested_by(searched, rays)


def results(
    kind: type[MeshTask],
    of: tuple[MeshRecipe, Pool, str],
    abouts: Iterable[tuple[int, ...]],
    stage: str,
    clock: Clock,
) -> Iterator[Files]:
    """Results of tasks, in order; see `SharedSurface.results`."""
    recipe, pool, job = of
    tasks = [kind(recipe, pool.pieces, job, *about) for about in abouts]
    yield from map(unpack_arrays, pool.results(tasks, clock.work, stage))


def leave_to_the_first(surface: SharedSurface, tasks: Sequence[MeshTask]) -> None:
    """Make the own tasks of a shard that does not write the output, and end its job."""
    pool = surface.pool
    if isinstance(pool, Shard) and not pool.first:
        count = pool.share(tasks, surface.clock.work)
        raise SharedError(f"this shard made {format_count(count, 'piece')}; shard 1 writes the file")


def shared_surface(
    recipe: MeshRecipe, planned: Plan, signs: SignBricks, pool: Pool, clock: Clock
) -> SharedSurface:
    """Mesh the surface of samples in pieces; join their components."""
    pieces, work = cuts(signs), clock.work
    own = samples_key(recipe, planned.root.key, signs)
    job = key(own, pieces)
    arrays = pack_arrays(ijk=signs.ijk, signs=signs.signs, index=signs.index, key=np.array(own))
    pool.pieces.write(job, SAMPLES, arrays)
    with clock("meshing"):
        summary = _summary((recipe, pool, job), pieces, planned.voxel, clock)
        first = np.cumsum([0, *summary.components.counts[:-1]])
        stored = StoredPieces(pool.pieces, job, HALO * planned.voxel)
        stored.first_labels = first.tolist()
        for end, triangles in zip(summary.ends.tolist(), summary.triangles.tolist(), strict=True):
            stored.count(end, triangles)
        sharp = Pointed(planned.voxel, work.threads)
        sharp.join(summary.pointed, np.inf)
        tipped, tips = with_tips(planned, stored, sharp.points, work)
        tipped, tips = with_ridges(planned, tipped, summary.blunt, tips, work)
        shells = (
            summary.components.shells() if tipped is stored else survey(tipped, planned.voxel, work.threads)
        )
    return SharedSurface(planned, signs, tipped, shells, tips, recipe, pool, job, clock)


def _summary(
    of: tuple[MeshRecipe, Pool, str], pieces: Sequence[tuple[int, int]], voxel: float, clock: Clock
) -> Summary:
    """Summary of all pieces. Tasks contour them, and join them up to the children of the tree's root."""
    (recipe, pool, job), work = of, clock.work

    def make(tasks: Sequence[MeshTask], stage: str = "") -> list[str]:
        for _ in pool.make(tasks, work, stage):
            pass
        return [task.name for task in tasks]

    contours = [ContourTask(recipe, pool.pieces, job, number, *cut) for number, cut in enumerate(pieces)]
    names = make(contours, "meshing")
    for level, _ in enumerate([*levels(len(names))][:-1], 1):
        children = enumerate(groups(names))
        names = make([JoinTask(recipe, pool.pieces, job, n, tuple(of), level) for n, of in children])
    ranges = [Summary.read(unpack_arrays(pool.pieces.read(job, name))) for name in names]
    return joined_summary(ranges, voxel, work.threads)


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
