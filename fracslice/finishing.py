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
    from .formulas import Box
    from .mesh import Mesh
    from .mesh.certificate import Certificate
    from .mesh.check import MeshReport
    from .mesh.components import Removed
    from .mesh.window import Finished
    from .surfaces import Surface

MOST_ERRORS = 1 << 22
"""Approximate maximum of vertices whose distance from the surface is measured, evenly distributed over it."""

VERTICES_A_BRICK = 40

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
        found: NDArray[np.float64] = points * self.scale + np.array(self.offset)
        return found

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
        found: NDArray[np.float64] = (points - np.array(self.offset)) / self.scale
        return found


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
    size : float
        Longest side of the remaining bodies, mm.
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
        size: float,
        scale: float | None,
        clock: Clock,
    ) -> None:
        from .mesh.certificate import Certificate
        from .mesh.components import choose
        from .mesh.extract import minimum_edge_parameter

        planned, pieces, shells = surface.planned, surface.pieces, surface.shells
        self.planned, self.pieces, self.shells, self.clock = planned, pieces, shells, clock
        unit = (scale or size / max(planned.box.size)) ** 3
        nested, self.misplaced = shells.nested(pieces, clock.work.threads)
        sized = replace(nested, volumes=nested.volumes * unit)
        limit = dust(float(sized.volumes.sum()))
        self.stays, removed = choose(sized, keep=how.keep, dust_mm3=limit, cavities=how.cavities)
        rest, box = shells.bounds(self.stays), self._box()
        exact = scale or size / max(box.size)
        x, y, _ = box.centre
        self.place = Placement(exact, (-exact * x, -exact * y, -exact * float(rest[0, 2])))
        self.removed: Removed = removed
        self.volume = float(nested.volumes[self.stays].sum()) * exact**3
        """Volume of all bodies, removed ones included, mm3."""
        self.volume += removed.bodies_mm3 - removed.filled_mm3
        grid = Certificate.of(surface.signs, 0)
        self._grid = replace(grid, planes=self.place.mm(grid.planes))
        self._flat = FLAT * minimum_edge_parameter(surface.signs) * planned.voxel * exact

    def _box(self) -> Box:
        """Bounding box of the remaining bodies."""
        from .volume.rest import box_of_the_rest

        whole, rest = self.shells.bounds(), self.shells.bounds(self.stays)
        return box_of_the_rest(self.planned, whole, rest, self._outermost, self.clock.work)

    def _outermost(self) -> NDArray[np.float64]:
        """Extreme vertices of the remaining triangles, of each piece."""
        from .volume.rest import outermost

        kept = map(self._kept, range(len(self.pieces)))
        return np.concatenate([outermost(mesh.vertices) for mesh in kept if len(mesh.vertices)])

    def _stay(self, number: int) -> NDArray[np.bool_]:
        """Mask of the remaining triangles of a piece, bool [m]."""
        found: NDArray[np.bool_] = self.stays[self.shells.of_label[self.pieces.labels(number)]]
        return found

    def _kept(self, number: int) -> Mesh:
        """Remaining triangles of a piece, scene units."""
        mesh = self.pieces.mesh(number)
        return mesh if self.stays.all() else mesh.selected(self._stay(number), self.clock.work.threads)

    def finished(self) -> Iterator[Finished]:
        """Place and clean the pieces, mm. Pieces held in memory are released.

        Yields
        ------
        Finished
            Triangles that are finished with each piece.
        """
        from .mesh.window import Window

        voxel, threads = self.planned.voxel * self.place.scale, self.clock.work.threads
        window, count = Window(voxel, threads), len(self.pieces)
        for number in range(count):
            with self.clock("finishing"):
                self.clock.work.progress("finishing", number / count)
                mesh, known = self._placed(number)
                self.pieces.drop(number)
                end = self.place.scale * self.pieces.ends[number] + self.place.offset[0]
                made = window.add(mesh, end, known)
                del mesh  # free it before the checks of the caller
            self.clock.work.progress("finishing", (number + 1) / count)
            yield made

    def _placed(self, number: int) -> tuple[Mesh, Certificate]:
        """Remaining triangles of a piece, mm, and their certificate. Triangles moved to the bed are not
        certified.
        """
        mesh = self._kept(number)
        points = self.place.mm(mesh.vertices)
        points[points[:, 2] < self._flat, 2] = 0
        stay = self._stay(number)
        holds = (np.arange(len(stay)) < len(stay) - self.pieces.fresh[number])[stay]
        planes = self._grid.planes[:, 2]
        if ((planes >= 0) & (planes < self._flat)).any():  # the plane is above some vertices now
            holds &= (points[:, 2] > 0)[mesh.triangles].all(axis=1)
        return replace(mesh, vertices=points), replace(self._grid, holds=holds)


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
        self._stride = max(1, round(VERTICES_A_BRICK * bricks / MOST_ERRORS))
        self._errors: list[NDArray[np.float64]] = []

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
            passed = piece.passed
            yield passed  # the consumer may write it meanwhile
            with self._finish.clock("checking"):
                self._tally.add(piece)
                self._errors.append(self._off(passed.vertices[:: self._stride]))

    def _off(self, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances of vertices in mm from the surface, scene units."""
        from .volume.accuracy import surface_error

        planned, place = self._finish.planned, self._finish.place
        return surface_error(planned.root, place.units(vertices), planned.voxel, self._finish.clock.work)

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
