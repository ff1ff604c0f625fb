"""Placement, selection of bodies, cleaning and checking: from a surface in scene units to finished triangles
in mm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .scene import Print
from .work import Clock

if TYPE_CHECKING:
    from .mesh import Mesh
    from .mesh.check import MeshReport
    from .mesh.components import Removed
    from .mesh.window import Finished
    from .surfaces import Surface
    from .volume.sizing import Sizing

MOST_ERRORS = 1 << 20
"""Approximate maximum of vertices whose distance from the surface is measured, evenly distributed over it."""

VERTICES_A_BRICK = 170

FLAT = 0.1
"""Fraction of the minimum distance between vertices. Vertices within this height of the bed are moved to the
bed, which keeps a flat base flat; a larger one would fold the small triangles around a lowest vertex.
"""


@dataclass(frozen=True)
class Placement:
    """Map from the scene to print space: ``mm = scale * scene units + offset``.

    Attributes
    ----------
    scale : float
        mm per scene unit.
    offset : tuple of float
        Translation, mm.
    """

    scale: float
    offset: tuple[float, float, float]

    def mm(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from the scene to print space.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Points, scene units.

        Returns
        -------
        ndarray of float64, shape (n, 3)
            Points, mm.
        """
        placed: NDArray[np.float64] = points * self.scale + np.array(self.offset)
        return placed

    def units(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from print space to the scene.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Points, mm.

        Returns
        -------
        ndarray of float64, shape (n, 3)
            Points, scene units.
        """
        axes = np.ascontiguousarray(points.T)  # three long rows: NumPy is slow on many short ones
        scene: NDArray[np.float64] = ((axes - np.array(self.offset)[:, None]) / self.scale).T
        return scene


class Finish:
    """Selection of bodies and placement of a surface, decided once for all pieces.

    Parameters
    ----------
    surface : Surface
        Labelled surface.
    how : Print
        Choice of bodies and cavities.
    dust : callable
        Maps the volume of the object to the volume below which a body is removed, mm3.
    size : Sizing
        Size of the remaining bodies.
    scale : float or None
        mm per scene unit; None to derive it from the size.
    clock : Clock
        Threads, progress, cancellation and timing.

    Raises
    ------
    MeshError
        If no body would remain.
    """

    def __init__(
        self,
        surface: Surface,
        how: Print,
        dust: Callable[[float], float],
        size: Sizing,
        scale: float | None,
        clock: Clock,
    ) -> None:
        from .mesh.components import choose
        from .mesh.extract import minimum_edge_parameter
        from .mesh.quantisation import grid_planes
        from .volume.rest import box_of_the_rest

        planned, pieces, shells = surface.planned, surface.pieces, surface.shells
        self.planned, self.pieces, self.shells, self.clock = planned, pieces, shells, clock
        unit = (scale or size.scale(planned.box)) ** 3
        nested, self.misplaced = shells.nested(pieces, how.cavities == "fill", clock.work.threads)
        sized = replace(nested, volumes=nested.volumes * unit)
        limit = dust(float(sized.volumes.sum()))
        self.stays, removed = choose(sized, keep=how.keep, dust_mm3=limit, cavities=how.cavities)
        rest = shells.bounds(self.stays)
        tips = shells.tips(self.stays)
        box = box_of_the_rest(planned, shells.bounds(), rest, tips, clock.work)
        exact = scale or size.scale(box)
        x, y, _ = box.centre
        self.place = Placement(exact, (-exact * x, -exact * y, -exact * float(rest[0, 2])))
        self.removed: Removed = removed
        self.volume = float(nested.volumes[self.stays].sum()) * exact**3
        """Volume of all bodies, removed ones included, mm3."""
        self.volume += removed.bodies_mm3 - removed.filled_mm3
        volumes = nested.volumes[self.stays]
        self.cavities = -float(volumes[volumes < 0].sum()) * exact**3
        """Volume of the cavities that stay, mm3."""
        self._planes = self.place.mm(grid_planes(surface.signs))
        self._bed = FLAT * minimum_edge_parameter(surface.signs) * planned.voxel * exact

    def finished(self) -> Iterator[Finished]:
        """Place and clean the pieces, mm. Pieces held in memory are released.

        Yields
        ------
        Finished
            Triangles that are finished with each piece.
        """
        from .mesh.window import Window

        frame = self.place.scale, self.place.offset, self._bed
        window = Window(self.planned.voxel, self._planes, frame, self.clock.work.threads)
        count = len(self.pieces)
        for number in range(count):
            with self.clock("finishing"):
                self.clock.work.progress("finishing", number / count)
                mesh, end = self.pieces.mesh(number), self.pieces.ends[number]
                keep = self.stays[self.shells.of_label][self.pieces.labels(number)]
                fresh = np.arange(len(mesh.triangles) - self.pieces.fresh[number], len(mesh.triangles))
                self.pieces.drop(number)
                made = window.add(mesh, end, keep, fresh)
                del mesh  # free it before the checks of the caller
            self.clock.work.progress("finishing", (number + 1) / count)
            yield made


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
        from .mesh.window import Tally

        self._finish, self._tally = finish, Tally(finish.clock.work.threads)
        self._stride = -(-VERTICES_A_BRICK * bricks // MOST_ERRORS)
        self._errors: list[NDArray[np.float64]] = []
        self.contact = 0.0
        """Area on the plate, mm2."""

    def passing(self, pieces: Iterable[Finished]) -> Iterator[Mesh]:
        """Pass pieces on and check them.

        Parameters
        ----------
        pieces : iterable of Finished
            Finished pieces.

        Yields
        ------
        Mesh
            Finished triangles of each piece, mm.
        """
        for piece in pieces:
            yield piece.passed  # the consumer may write it meanwhile
            with self._finish.clock("checking"):
                self._tally.add(piece)
                self.contact += _on_the_plate(piece.passed)
                self._errors.append(self._off(piece.points[:: self._stride]))

    def _off(self, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances of vertices in mm from the surface, scene units."""
        from .volume.accuracy import surface_error

        planned, points = self._finish.planned, self._finish.place.units(vertices)
        return surface_error(planned.root, points, planned.voxel, self._finish.clock.work)

    @property
    def mesh(self) -> MeshReport:
        """Report on the whole mesh, after all pieces have passed."""
        hollow, stays = self._finish.shells.volumes < 0, self._finish.stays
        bodies, cavities = int((stays & ~hollow).sum()), int((stays & hollow).sum())
        return self._tally.report(bodies, cavities, self._finish.misplaced)

    @property
    def errors(self) -> NDArray[np.float64]:
        """Distances of vertices from the surface, mm."""
        return self._finish.place.scale * np.concatenate(self._errors)


def _on_the_plate(mesh: Mesh) -> float:
    """Area of the triangles at z = 0."""
    lying = (mesh.vertices[:, 2] == 0)[mesh.triangles].all(1)
    x, y = np.moveaxis(mesh.vertices[mesh.triangles[lying], :2], 2, 0)
    double = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    return float(np.abs(double).sum()) / 2
