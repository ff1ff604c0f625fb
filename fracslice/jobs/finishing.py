"""Selection of bodies, placement and cleaning: from a surface in scene units to finished triangles in mm."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..mesh.gathering import gathered
from ..meshjob import PIECES
from ..scene import Print
from .clock import Clock
from .placement import Placement

if TYPE_CHECKING:
    from ..mesh.components import Removed
    from ..mesh.halo import Finished, SelectedPiece
    from ..mesh.mesh_report import MeshReport
    from ..mesh.quantisation import Frame
    from ..mesh.tally import Tally
    from ..volume import Plan, SignBricks
    from .surfaces import Surface

FLAT = 0.1
"""Fraction of the minimum distance between vertices. Vertices within this height of the bed are moved to the
bed, which keeps a flat base flat; a larger one would fold the small triangles around a lowest vertex.
"""

CRUMB = 0.5
"""Volume of a body around a single sample, at most, voxels."""


def placing(planned: Plan, signs: SignBricks, place: Placement) -> tuple[NDArray[np.float64], Frame]:
    """Return what quantisation needs of a placement.

    Parameters
    ----------
    planned : Plan
        Sampled field.
    signs : SignBricks
        Its samples.
    place : Placement
        Placement of the mesh.

    Returns
    -------
    ndarray of float64, shape (k, 3)
        Planes of the grid, mm.
    Frame
        Scale, translation and height of the bed.
    """
    from ..mesh.contouring import minimum_edge_parameter
    from ..mesh.quantisation import grid_planes

    bed = FLAT * minimum_edge_parameter(signs) * planned.voxel * place.scale
    return place.mm(grid_planes(signs)), (place.scale, place.offset, bed)


def largest_crumb(volumes: NDArray[np.float64], voxel: float) -> float:
    """Return the volume below which bodies are tips that the samples separate from the body beside them.

    Parameters
    ----------
    volumes : ndarray of float64, shape (s,)
        Volumes of the shells, negative for cavities.
    voxel : float
        Volume of a voxel.

    Returns
    -------
    float
        Half a voxel; 0 if bodies as small as this hold much of the material.
    """
    crumbs = volumes[(volumes > 0) & (volumes < CRUMB * voxel)]
    return CRUMB * voxel if crumbs.sum() < PIECES * volumes.sum() else 0.0


class Finish:
    """Selection of bodies and placement of a surface, decided once for all pieces.

    Parameters
    ----------
    surface : Surface
        Labelled surface.
    how : Print
        Choice of bodies and cavities.
    dust : callable
        Maps the volume of the object and that of crumbs to the volume below which a body is removed, mm3.
    scale : float
        mm per scene unit.
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
        dust: Callable[[float, float], float],
        scale: float,
        clock: Clock,
    ) -> None:
        from ..mesh.components import choose
        from ..mesh.quantisation import placed
        from ..mesh.touching import NearBodies

        planned, pieces, shells = surface.planned, surface.pieces, surface.shells
        self.planned, self.pieces, self.shells, self.clock = planned, pieces, shells, clock
        unit = scale**3
        nested, self.misplaced = surface.nested(how.cavities == "fill", clock.work.threads)
        sized = replace(nested, volumes=nested.volumes * unit)
        limit = dust(float(sized.volumes.sum()), largest_crumb(sized.volumes, planned.voxel**3 * unit))
        self.stays, removed = choose(sized, keep=how.bodies, dust_mm3=limit, cavities=how.cavities)
        (x, y, _), lowest = planned.box.centre, float(shells.bounds(self.stays)[0, 2])
        self.place = Placement(scale, (-scale * x, -scale * y, -scale * lowest))
        self.removed: Removed = removed
        self.size: list[float] = (scale * np.ptp(shells.bounds(), axis=0)).tolist()
        """Size of all bodies, removed ones included, mm."""
        self.volume = float(nested.volumes[self.stays].sum()) * unit
        """Volume of all bodies, removed ones included, mm3."""
        self.volume += removed.bodies_mm3 - removed.filled_mm3
        volumes = nested.volumes[self.stays]
        self.cavities = -float(volumes[volumes < 0].sum()) * unit
        """Volume of the cavities that stay, mm3."""
        self.near = NearBodies(shells, self.stays, planned.voxel, clock.work.threads)
        """Bodies that nearly touch, complete after the last piece."""
        self._planes, self._frame = placing(planned, surface.signs, self.place)
        self.tips = placed(surface.tips, self._frame)
        """The vertices `surface.tips` of the finished mesh, mm."""

    def report(self, tally: Tally) -> MeshReport:
        """Report on the whole mesh.

        Parameters
        ----------
        tally : Tally
            Sums over all pieces.
        """
        hollow = self.shells.volumes < 0
        bodies, cavities = int((self.stays & ~hollow).sum()), int((self.stays & hollow).sum())
        return tally.report(bodies, cavities, self.misplaced)

    def finished(self) -> Iterator[Finished]:
        """Place and clean the pieces, mm. Pieces held in memory are released.

        Yields
        ------
        Finished
            Triangles that are finished with each piece.
        """
        from ..mesh.halo import finished_piece

        work, voxel, count = self.clock.work, self.planned.voxel, len(self.pieces)
        ends, before, own = [-np.inf, *self.pieces.ends], None, self._kept(0)
        for number in range(count):
            with self.clock("finishing"):
                work.progress("finishing", number / count)
                after = self._kept(number + 1) if number + 1 < count else None
                place = (ends[number], ends[number + 1]), voxel, self._planes, self._frame
                made = finished_piece(own, before, after, *place, work.threads)
                self.pieces.drop(number)
                if after is not None:
                    before, own = own, after
                else:
                    del before, own  # free them before the checks of the caller
            work.progress("finishing", (number + 1) / count)
            yield made

    def _kept(self, number: int) -> SelectedPiece:
        """The next piece, with the choice of its bodies."""
        from ..mesh.halo import SelectedPiece

        mesh, labels = self.pieces.mesh(number), self.pieces.labels(number)
        self.near.add(mesh.vertices, labels, self.pieces.ends[number])
        fresh = np.arange(len(mesh.triangles) - self.pieces.fresh[number], len(mesh.triangles))
        keep = gathered(self.stays[self.shells.of_label], labels, self.clock.work.threads)
        return SelectedPiece(mesh, keep, fresh)
