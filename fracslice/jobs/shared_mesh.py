"""Surface made by several processes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..cluster import Files, Pool, Shard, packed, unpacked
from ..common.digits import counted
from ..common.keys import key
from ..errors import SharedError
from ..mesh.components import Shells
from ..mesh.nesting import Nesting
from ..mesh.pointed_vertices import Pointed
from ..mesh.ridges import with_ridges
from ..mesh.survey import groups, levels, survey
from ..mesh.tips import with_tips
from ..volume import Plan, SignBricks
from .clock import Clock
from .mesh_files import SHELLS, StoredPieces
from .mesh_recipe import SAMPLES, MeshRecipe, samples_key
from .mesh_summary import Summary, joined_summary
from .mesh_tasks import HALO, ContourTask, JoinTask, MeshTask, NestTask, cuts
from .surfaces import Surface

T = TypeVar("T", bound=MeshTask)


@dataclass(frozen=True, eq=False)
class SharedSurface(Surface):
    """Surface whose pieces other processes make.

    Attributes
    ----------
    recipe : MeshRecipe
        The mesh.
    pool : Pool
        The processes.
    job : str
        Key of the mesh and its samples.
    clock : Clock
        Progress, cancellation and timing.
    """

    recipe: MeshRecipe
    pool: Pool
    job: str
    clock: Clock

    def tasks(self, kind: type[T], numbers: Iterable[int]) -> list[T]:
        """Tasks of a kind for some pieces."""
        return [kind(self.recipe, self.pool.pieces, self.job, number) for number in numbers]

    def results(self, kind: type[MeshTask], numbers: Iterable[int], stage: str) -> Iterator[Files]:
        """Results of tasks, in order.

        Parameters
        ----------
        kind : type
            Kind of the tasks.
        numbers : iterable of int
            Indices of their pieces.
        stage : str
            Label of the progress.

        Yields
        ------
        dict
            Arrays by name.
        """
        abouts = ((number,) for number in numbers)
        yield from results(kind, (self.recipe, self.pool, self.job), abouts, stage, self.clock)

    def nested(self, bodies: bool, threads: int) -> tuple[Shells, int]:
        """Nesting of the shells, searched by the pool; see `Surface.nested`."""
        shells, stored = self.shells, self.pieces
        assert isinstance(stored, StoredPieces)
        searched = shells.searched(bodies)
        numbers = np.unique(shells.piece[searched]).tolist()
        first = np.array(stored.first_labels or [0] * len(stored), np.int32)
        about = packed(searched=searched, labels=first, prefix=np.array(stored.prefix), **vars(shells))
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
    yield from map(unpacked, pool.results(tasks, clock.work, stage))


def leave_to_the_first(surface: SharedSurface, tasks: Sequence[MeshTask]) -> None:
    """Make the own tasks of a shard that does not write the output, and end its job.

    Parameters
    ----------
    surface : SharedSurface
        The surface.
    tasks : sequence of MeshTask
        Last tasks of the job.

    Raises
    ------
    SharedError
        For a shard that is not the first one.
    """
    pool = surface.pool
    if isinstance(pool, Shard) and not pool.first:
        count = pool.share(tasks, surface.clock.work)
        raise SharedError(f"this shard made {counted(count, 'piece')}; shard 1 writes the file")


def shared_surface(
    recipe: MeshRecipe, planned: Plan, signs: SignBricks, pool: Pool, clock: Clock
) -> SharedSurface:
    """Mesh the surface of samples in pieces; join their components.

    Parameters
    ----------
    recipe : MeshRecipe
        The mesh.
    planned : Plan
        Sampled field.
    signs : SignBricks
        Its samples.
    pool : Pool
        Processes that make the pieces.
    clock : Clock
        Progress, cancellation and timing.

    Returns
    -------
    SharedSurface
        The surface with tips and sharp edges.
    """
    pieces, work = cuts(signs), clock.work
    own = samples_key(recipe, planned.root.key, signs)
    job = key(own, pieces)
    arrays = packed(ijk=signs.ijk, signs=signs.signs, index=signs.index, key=np.array(own))
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
    ranges = [Summary.read(unpacked(pool.pieces.read(job, name))) for name in names]
    return joined_summary(ranges, voxel, work.threads)
