"""Contouring of signs, piece by piece: roots on grid edges, feature vertices and triangles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from ..kernel import Field
from ..volume.bricks import Bricks, SignBricks
from ..volume.lattice import BRICK
from ..work import Work
from .crossings import Refiner
from .model import Mesh
from .projection import project

if TYPE_CHECKING:
    from .._native import Cells

BLUNT = 1 << 14
"""Blunt cells above which a surface is rough: it has any number of sharp edges."""


@dataclass(frozen=True, eq=False)
class Piece:
    """Part of a surface in some layers of bricks.

    Attributes
    ----------
    mesh : Mesh
        Triangles, scene units; open at the seams. Adjacent pieces have bitwise equal points at their seam.
    end : float
        x at which the piece ends; infinite for the last one.
    blunt : ndarray of float64, shape (n, 3)
        Middles of its blunt cells: a sharp edge or corner of the surface should pass, but does not. Some of
        them if there are more than `BLUNT`.
    """

    mesh: Mesh
    end: float
    blunt: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))


class SurfaceContours:
    """Pieces of the exact surface of a scene, in any order.

    Parameters
    ----------
    root : Field
        Field that `signs` were sampled from.
    signs : SignBricks
        Samples, scene units.
    threads : int
        Threads; 0 for all cores.

    Raises
    ------
    MeshError
        If the surface leaves the samples.
    """

    def __init__(self, root: Field, signs: SignBricks, threads: int) -> None:
        from .._native import Cells

        self.root, self.signs = root, signs
        self._cells = called(Cells, signs.ijk, signs.signs, signs.index, threads)
        self._placement = placement(signs)

    def refiner(self, work: Work) -> Refiner:
        """Return a root finder for pieces by ascending x.

        Returns
        -------
        Refiner
            Root finder without roots.
        """
        origin, voxel, _ = self._placement
        return Refiner(self.root, self._cells, origin, voxel, work)

    def piece(self, first: int, last: int, refiner: Refiner, work: Work) -> Piece:
        """Contour some layers of bricks.

        Parameters
        ----------
        first, last : int
            Layers, last excluded; see `layers`.
        refiner : Refiner
            Root finder; one that made the piece before has the roots at the seam.
        work : Work
            Threads and cancellation.

        Returns
        -------
        Piece
            Bitwise the same for any refiner.

        Raises
        ------
        MeshError, Cancelled
            As `contour`.
        """
        from .._native import Contouring, trust_regions

        cells, signs = self._cells, self.signs
        surface = Contouring(cells, first, last, *self._placement)
        batches = list(_batches(cells, first - 1, last + 1, work.threads << 16))
        before = cells.crossings_before
        needed = [(before(min(begin, last - 1)), before(end + 1)) for begin, end in batches]
        for (_, end), known in zip(batches, refiner.each(needed), strict=True):
            called(surface.advance, end, known.first, known.t, known.normals)
        vertices, triangles, count, cases, to_means, blunt = surface.finish()
        features = vertices[count:]

        def regions(which: np.ndarray, inside: np.ndarray) -> np.ndarray:
            return trust_regions(features, cases, to_means, which, inside, *self._placement)

        project(self.root, features, regions, signs.voxel, work)
        mesh, border = Mesh(vertices, triangles), np.inf
        if last < len(signs.index):  # Unused vertices belong to the next piece.
            mesh = mesh.compact()
            border = signs.origin[0] + signs.voxel * BRICK * last
        return Piece(mesh, border, blunt[: BLUNT + 1])


def _batches(cells: Cells, first: int, last: int, least: int) -> Iterator[tuple[int, int]]:
    """Split layers first to last - 1 into ranges (begin, end), end excluded, of at least `least` crossings,
    so that the crossings of a range are still in the cache when used.
    """
    begin = first
    for end in range(first + 1, last + 1):
        if end == last or cells.crossings_before(end) - cells.crossings_before(begin) >= least:
            yield begin, end
            begin = end


def layers(bricks: SignBricks, most: int) -> list[tuple[int, int]]:
    """Split layers of bricks into pieces.

    Parameters
    ----------
    bricks : SignBricks
        Samples.
    most : int
        Approximate bricks per piece.

    Returns
    -------
    list of tuple of int
        First and last layer, last excluded. The pieces at both ends include the layer beside the samples,
        which may have cells of the surface.
    """
    counts = np.bincount(bricks.ijk[:, 0] // BRICK, minlength=bricks.index.shape[0])
    cuts, size = [-1], 0
    for layer, count in enumerate(counts):
        if size and size + count > most:
            cuts.append(layer)
            size = 0
        size += count
    return list(zip(cuts, [*cuts[1:], len(counts)], strict=True))


def placement(bricks: Bricks | SignBricks) -> tuple[tuple[float, float, float], float, float]:
    """Placement of samples, for native code.

    Returns
    -------
    tuple
        Origin, voxel and minimum edge parameter, as plain numbers.

    Raises
    ------
    MeshError
        If the voxel is too fine for float32 coordinates.
    """
    x, y, z = bricks.origin
    return (float(x), float(y), float(z)), float(bricks.voxel), minimum_edge_parameter(bricks)


def minimum_edge_parameter(bricks: Bricks | SignBricks) -> float:
    """Minimum distance of a vertex from a grid point, in voxels, that keeps vertices distinct in float32.

    Vertices of one cell differ by at least this distance along some axis; four float32 steps survive any
    rounding.

    Parameters
    ----------
    bricks : Bricks or SignBricks
        Samples.

    Raises
    ------
    MeshError
        If the voxel is too fine for float32 coordinates.
    """
    low = np.asarray(bricks.origin, dtype=np.float64)
    high = low + bricks.voxel * 8 * np.asarray(bricks.index.shape)
    extent = np.float32(max(np.abs(low).max(), np.abs(high).max()))
    share = max(1e-4, 4 * float(np.spacing(extent)) / bricks.voxel)
    if share >= 0.5:
        raise MeshError(
            f"a voxel of {bricks.voxel:g} at a distance of {extent:g} is too fine for float32 coordinates"
        )
    return share


def called(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a native function.

    Returns
    -------
    object
        Its result.

    Raises
    ------
    MeshError
        Instead of a `ValueError`.
    """
    try:
        return function(*arguments)
    except ValueError as error:
        raise MeshError(f"cannot mesh the samples: {error}") from None
