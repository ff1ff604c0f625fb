"""Finished pieces of a shared mesh: their checks, and one file of them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ..cluster import Files, packed
from ..mesh.missed import distances, surface_samples
from ..mesh.tally import Tally
from ..mesh.tip_triangles import by_tip
from .checking import stride
from .finished_pieces import finished_mesh
from .finishing import Finish
from .mesh_files import CHOICE, StoredPieces
from .mesh_tasks import FinishTask, MissedTask, far_file, finished_file
from .shared_mesh import SharedSurface, results


@dataclass
class SharedCheck:
    """Sums over finished pieces.

    Attributes
    ----------
    surface : SharedSurface
        The surface.
    points : ndarray of float64, shape (n, 3)
        Points of the field's surface.
    rows : list of int
        Triangles of the file of each piece; those at tips are the last piece.
    tally : Tally
        Sums.
    contact : float
        Area on the plate, mm2.
    near : list of ndarray
        Shells of bodies that nearly touch others, of each piece.
    off : list of ndarray
        Distances of vertices from the surface, scene units.
    back : ndarray of float64, shape (n,)
        Distances of the points from the mesh, scene units.
    """

    surface: SharedSurface
    points: NDArray[np.float64]
    rows: list[int] = field(default_factory=list)
    tally: Tally = field(default_factory=Tally)
    contact: float = 0.0
    near: list[NDArray[np.int64]] = field(default_factory=list)
    off: list[NDArray[np.float64]] = field(default_factory=list)
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


def finished(surface: SharedSurface, finish: Finish) -> tuple[SharedCheck, Iterator[str]]:
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
        Checks and measures, complete after the last file.
    iterator of str
        Files with the triangles, in order.
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
