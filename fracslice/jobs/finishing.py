"""From a surface in scene units to finished triangles in mm: selection of bodies, placement, cleaning and
checks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..mesh.pieces import gather_rows
from ..records import PIECES
from ..scene import Print
from ..work import Work, in_background
from .report import Clock, Placement

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..mesh.checks import MeshReport, Tally
    from ..mesh.cleaning import Finished, SelectedPiece
    from ..mesh.quantisation import Frame
    from ..mesh.topology import Removed
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

    Returns float64 (k, 3), mm.
    """
    from ..mesh.contouring import minimum_edge_parameter
    from ..mesh.quantisation import grid_planes

    bed = FLAT * minimum_edge_parameter(signs) * planned.voxel * place.scale
    return place.mm(grid_planes(signs)), (place.scale, place.offset, bed)


def largest_crumb(volumes: NDArray[np.float64], voxel: float) -> float:
    """Return the volume below which bodies are tips that the samples separate from the body beside them.

    `volumes`: float64 (s,); `voxel`: volume of a voxel. Returns half a voxel, or 0 if such
    bodies hold much of the material.
    """
    crumbs = volumes[(volumes > 0) & (volumes < CRUMB * voxel)]
    return CRUMB * voxel if crumbs.sum() < PIECES * volumes.sum() else 0.0


class Finish:
    """Selection of bodies and placement of a surface, decided once for all pieces.

    `dust` in mm3; `scale`: mm per scene unit.
    """

    def __init__(
        self,
        surface: Surface,
        how: Print,
        dust: Callable[[float, float], float],
        scale: float,
        clock: Clock,
    ) -> None:
        from ..mesh.quantisation import place_and_round
        from ..mesh.topology import choose
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
        bottoms = shells.outermost[self.stays & (shells.volumes > 0), 2, 2]
        self.loose = int((bottoms > lowest + planned.voxel).sum())
        """Bodies that do not stand on the plate."""
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
        self.tips = place_and_round(surface.tips, self._frame)
        """The vertices `surface.tips` of the finished mesh, mm."""

    def report(self, tally: Tally) -> MeshReport:
        """Report on the whole mesh."""
        hollow = self.shells.volumes < 0
        bodies, cavities = int((self.stays & ~hollow).sum()), int((self.stays & hollow).sum())
        return tally.report(bodies, cavities, self.misplaced)

    def finished(self) -> Iterator[Finished]:
        """Place and clean the pieces, mm. Pieces held in memory are released."""
        from ..mesh.cleaning import finished_piece

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
        from ..mesh.cleaning import SelectedPiece

        mesh, labels = self.pieces.mesh(number), self.pieces.labels(number)
        self.near.add(mesh.vertices, labels, self.pieces.ends[number])
        fresh = np.arange(len(mesh.triangles) - self.pieces.fresh[number], len(mesh.triangles))
        keep = gather_rows(self.stays[self.shells.of_label], labels, self.clock.work.threads)
        return SelectedPiece(mesh, keep, fresh)


MOST_ERRORS = 1 << 20
"""Approximate maximum of vertices whose distance from the surface is measured, evenly distributed over it."""

VERTICES_A_BRICK = 170


def stride(bricks: int) -> int:
    """Return the stride of the vertices whose distance from the surface is measured."""
    return -(-VERTICES_A_BRICK * bricks // MOST_ERRORS)


def off_surface(
    planned: Plan, place: Placement, vertices: NDArray[np.float64], work: Work
) -> NDArray[np.float64]:
    """Measure the distances of vertices from the surface.

    `vertices`: float64 (n, 3), mm. Returns float64 (n,), scene units.
    """
    from ..volume.accuracy import surface_error

    return surface_error(planned.root, vertices, planned.voxel, work, place.scale, place.offset)


class Check:
    """Checks finished triangles as they pass."""

    def __init__(self, finish: Finish, bricks: int) -> None:
        from ..mesh.checks import Tally

        self._finish, self._tally = finish, Tally(finish.clock.work.threads)
        self._stride = stride(bricks)
        self._errors: list[NDArray[np.float64]] = []
        self.contact = 0.0
        """Area on the plate, mm2."""

    def passing(self, pieces: Iterable[Finished]) -> Iterator[Mesh]:
        """Pass pieces on and check them.

        Yields `Mesh` in mm.
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

    `mesh` in mm; the area in mm2.
    """
    from .._native import touching

    low = mesh.vertices[:, 2] == 0
    near = mesh.triangles[touching(mesh.triangles, low, threads)]
    x, y = np.moveaxis(mesh.vertices[near[low[near].all(1)], :2], 2, 0)
    double = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    return float(np.abs(double).sum()) / 2
