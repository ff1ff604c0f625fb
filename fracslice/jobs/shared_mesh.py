"""Mesh made by several processes: from the pieces that they make to one file."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..cluster import Files, Pool, Shard, packed, unpacked
from ..common.keys import key
from ..errors import SharedError
from ..mesh.components import Shells
from ..mesh.missed import distances, surface_samples
from ..mesh.model import Mesh
from ..mesh.nesting import Nesting
from ..mesh.pointed_vertices import Pointed, PointedPiece
from ..mesh.survey import Survey, survey
from ..mesh.tally import Tally
from ..mesh.tip_triangles import by_tip
from ..mesh.tips import with_tips
from ..volume import Plan, SignBricks
from .checking import stride
from .clock import Clock
from .finishing import Finish
from .mesh_files import CHOICE, StoredPieces, read_components, read_seam
from .mesh_recipe import SAMPLES, MeshRecipe, samples_key
from .mesh_tasks import (
    HALO,
    SHELLS,
    ContourTask,
    FinishTask,
    MeshTask,
    MissedTask,
    NestTask,
    cuts,
    far_file,
    triangles_file,
)
from .surfaces import Surface


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
        The surface with tips.
    """
    pieces, work = cuts(signs), clock.work
    own = samples_key(recipe, planned.root.key, signs)
    job = key(own, pieces)
    arrays = packed(ijk=signs.ijk, signs=signs.signs, index=signs.index, key=np.array(own))
    pool.pieces.write(job, SAMPLES, arrays)
    stored = StoredPieces(pool.pieces, job, HALO * planned.voxel)
    joined, pointed = Survey(), Pointed(planned.voxel, work.threads)
    abouts = ((number, *layers) for number, layers in enumerate(pieces))
    with clock("meshing"):
        for files in results(ContourTask, (recipe, pool, job), abouts, "meshing", clock):
            end, triangles = files["counts"].tolist()
            stored.count(end, int(triangles))
            stored.first_labels.append(joined.add(read_components(files)))
            sharp = PointedPiece(files["pointed"], read_seam(files, "head"), read_seam(files, "tail"))
            pointed.join(sharp, end)
        tipped, tips = with_tips(planned, stored, pointed.points, work)
        shells = joined.shells() if tipped is stored else survey(tipped, planned.voxel, work.threads)
    return SharedSurface(planned, signs, tipped, shells, tips, recipe, pool, job, clock)


@dataclass
class SharedCheck:
    """Sums over finished pieces.

    Attributes
    ----------
    surface : SharedSurface
        The surface.
    points : ndarray of float64, shape (n, 3)
        Points of the field's surface.
    tally : Tally
        Sums.
    contact : float
        Area on the plate, mm2.
    off : list of ndarray
        Distances of vertices from the surface, scene units.
    back : ndarray of float64, shape (n,)
        Distances of the points from the mesh, scene units.
    """

    surface: SharedSurface
    points: NDArray[np.float64]
    tally: Tally = field(default_factory=Tally)
    contact: float = 0.0
    off: list[NDArray[np.float64]] = field(default_factory=list)
    back: NDArray[np.float64] = field(default_factory=lambda: np.array(np.inf))

    def add(self, files: Files) -> None:
        """Add the result of a `FinishTask`."""
        self.tally.include(Tally(**json.loads(str(files["tally"]))))
        self.contact += float(files["contact"])
        self.off.append(np.asarray(files["errors"]))
        self.back = np.minimum(self.back, files["distances"])

    def end(self) -> None:
        """Measure the distances of points without triangles nearby; remove the files of the job."""
        surface, turns = self.surface, count()
        ends, margin = np.array(surface.pieces.ends), surface.planned.voxel

        def search(points: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
            turn, x = next(turns), points[:, :1]
            surface.pool.pieces.write(
                surface.job, far_file(turn), packed(points=points, reach=np.array(reach))
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


Append = Callable[[BinaryIO], int]
"""Appends encoded triangles to a file; returns the number of bytes."""


def finished(surface: SharedSurface, finish: Finish) -> tuple[SharedCheck, Iterator[Append]]:
    """Finish the pieces.

    Parameters
    ----------
    surface : SharedSurface
        The surface.
    finish : Finish
        Selection and placement.

    Returns
    -------
    SharedCheck
        Checks and measures, complete after the last block.
    iterator of callable
        Append blocks of triangles, in order, as an STL file holds them.

    Raises
    ------
    SharedError
        For a shard that does not write the output, when its pieces are made.
    """
    stored, pool, place = surface.pieces, surface.pool, finish.place
    assert isinstance(stored, StoredPieces)
    points = surface_samples(surface.planned, surface.clock.work)
    first = stored.first_labels or [0] * len(stored)
    choice = packed(
        prefix=np.array(stored.prefix),
        ends=np.array(stored.ends),
        fresh=np.array(stored.fresh, np.int64),
        first_labels=np.array(first, np.int32),
        stays=finish.stays[surface.shells.of_label],
        placed=np.array([place.scale, *place.offset]),
        points=points,
        tips=place.mm(surface.tips),
        stride=np.array(stride(len(surface.signs))),
    )
    pool.pieces.write(surface.job, CHOICE, choice)
    if isinstance(pool, Shard) and not pool.first:
        tasks = [FinishTask(surface.recipe, pool.pieces, surface.job, n) for n in range(len(stored))]
        raise SharedError(f"{pool.share(tasks, surface.clock.work)} pieces are made; shard 1 writes the file")
    check = SharedCheck(surface, points)
    return check, _blocks(surface, check)


def _blocks(surface: SharedSurface, check: SharedCheck) -> Iterator[Append]:
    from .._native import stl

    late: list[tuple[int, NDArray[np.float64]]] = []
    for number, files in enumerate(surface.results(FinishTask, range(len(surface.pieces)), "finishing")):
        check.add(files)
        late += zip(files["late"].tolist(), np.asarray(files["corners"]), strict=True)
        yield partial(surface.pool.pieces.append, surface.job, triangles_file(number))
    if late:
        last = by_tip(late)
        surface.pool.pieces.write(surface.job, "tips", [stl(last.vertices, last.triangles).data])
        yield partial(surface.pool.pieces.append, surface.job, "tips")


def whole(blocks: Iterable[Append]) -> Mesh:
    """Mesh of the triangles of an STL file; its vertices are in the order of their first use.

    Parameters
    ----------
    blocks : iterable of callable
        Append blocks of triangles.

    Returns
    -------
    Mesh
        The mesh, mm.
    """
    from .._native import weld

    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    file = io.BytesIO()
    for block in blocks:
        block(file)
    corners = np.frombuffer(file.getbuffer(), kind)["corners"].reshape(-1, 3)
    first, labels = weld(np.ascontiguousarray(corners))
    return Mesh(corners[first].astype(np.float64), labels.reshape(-1, 3)).in_order()
