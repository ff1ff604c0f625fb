"""Checks of finished triangles as they pass."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..background import in_background
from ..work import Work
from .finishing import Finish
from .placement import Placement

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..mesh.halo import Finished
    from ..mesh.mesh_report import MeshReport
    from ..volume import Plan

MOST_ERRORS = 1 << 20
"""Approximate maximum of vertices whose distance from the surface is measured, evenly distributed over it."""

VERTICES_A_BRICK = 170


def stride(bricks: int) -> int:
    """Return the stride of the vertices whose distance from the surface is measured.

    Parameters
    ----------
    bricks : int
        Bricks of samples.

    Returns
    -------
    int
        Each vertex of this stride is measured, in each piece.
    """
    return -(-VERTICES_A_BRICK * bricks // MOST_ERRORS)


def off_surface(
    planned: Plan, place: Placement, vertices: NDArray[np.float64], work: Work
) -> NDArray[np.float64]:
    """Measure the distances of vertices from the surface.

    Parameters
    ----------
    planned : Plan
        Sampled field.
    place : Placement
        Placement of the mesh.
    vertices : ndarray of float64, shape (n, 3)
        Vertices, mm.
    work : Work
        Threads and cancellation.

    Returns
    -------
    ndarray of float64, shape (n,)
        Distances, scene units.
    """
    from ..volume.accuracy import surface_error

    return surface_error(planned.root, vertices, planned.voxel, work, place.scale, place.offset)


class Check:
    """Checks finished triangles as they pass.

    Parameters
    ----------
    finish : Finish
        Selection and placement.
    bricks : int
        Bricks of samples.
    """

    def __init__(self, finish: Finish, bricks: int) -> None:
        from ..mesh.tally import Tally

        self._finish, self._tally = finish, Tally(finish.clock.work.threads)
        self._stride = stride(bricks)
        self._errors: list[NDArray[np.float64]] = []
        self.contact = 0.0
        """Area on the plate, mm2."""

    def passing(self, pieces: Iterable[Finished]) -> Iterator[Mesh]:
        """Pass pieces on and check them.

        Yields
        ------
        Mesh
            Finished triangles of each piece, mm.
        """
        for piece in pieces:
            yield piece.passed  # the consumer may write it meanwhile
            with self._finish.clock("checking"):
                finish, work = self._finish, self._finish.clock.work
                with in_background(
                    partial(on_the_plate, piece.passed, work.threads), work.threads
                ) as contact:
                    self._tally.add(piece)
                    vertices = piece.points[:: self._stride]
                    self._errors.append(off_surface(finish.planned, finish.place, vertices, work))
                    self.contact += contact()

    @property
    def mesh(self) -> MeshReport:
        """Report on the whole mesh, after all pieces have passed."""
        return self._finish.report(self._tally)

    @property
    def errors(self) -> NDArray[np.float64]:
        """Distances of vertices from the surface, scene units."""
        return np.concatenate(self._errors)


def on_the_plate(mesh: Mesh, threads: int = 0) -> float:
    """Return the area of the triangles at z = 0.

    Parameters
    ----------
    mesh : Mesh
        Finished triangles, mm.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    float
        Area, mm2.
    """
    from .._native import touching

    low = mesh.vertices[:, 2] == 0
    near = mesh.triangles[touching(mesh.triangles, low, threads)]
    x, y = np.moveaxis(mesh.vertices[near[low[near].all(1)], :2], 2, 0)
    double = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    return float(np.abs(double).sum()) / 2
