"""The surface of a planned scene, in as many pieces as memory asks for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .errors import TooLargeError
from .memory import available_bytes
from .work import Clock

if TYPE_CHECKING:
    from .mesh.pieces import Pieces
    from .mesh.refine import Refined
    from .mesh.survey import WholeShells
    from .volume import Plan, SignBricks

BYTES_A_BRICK = 30_000
"""Peak memory for each brick of samples, its triangles in all their stages included; measured."""

BRICKS = 1 << 13
"""In a piece of a mesh that does not fit in memory, and in one that always does: 256 voxels along the longest
side."""


@dataclass(frozen=True, eq=False)
class Surface:
    """The exact surface of a field, scene units. signs: its samples. tips: those that it was mended at,
    float64 [k, 3]."""

    planned: Plan
    signs: SignBricks
    pieces: Pieces
    shells: WholeShells
    tips: NDArray[np.float64]

    @property
    def thin(self) -> str:
        """What walls came to that are thinner than a voxel, in words; empty where all are thicker."""
        return self.shells.thin_walls(self.planned.voxel)


def sampled(planned: Plan, clock: Clock) -> SignBricks:
    """The signs of a planned scene around its surface."""
    from .volume import sample_scene_signs

    with clock("sampling"):
        return sample_scene_signs(planned, clock.work)


def refuse_what_does_not_fit(signs: SignBricks, voxel: float) -> None:
    """Raise `TooLargeError`, naming a voxel that fits, for a surface that takes more memory than there is.

    voxel: mm. The number of bricks grows like a power of the resolution, the surface's dimension by counting
    boxes of one and of two bricks.
    """
    needed, free = len(signs) * BYTES_A_BRICK, available_bytes()
    if len(signs) <= BRICKS or needed <= free:
        return
    boxes = len(np.unique(signs.ijk >> 4, axis=0))
    dimension = min(max(math.log2(len(signs) / boxes), 2.0), 3.0)
    fits = voxel * (needed / free) ** (1 / dimension)
    raise TooLargeError(
        f"a voxel of {voxel:.3g}mm needs about {needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are "
        f"free; a voxel of {fits * 1.02:.3g}mm fits"
    )


def made(planned: Plan, signs: SignBricks, most: int, folder: Path | None, clock: Clock) -> Surface:
    """The surface through some samples, in pieces of about `most` bricks.

    folder: where pieces are laid aside, if they are more than one.
    """
    from .mesh.extract import Piece, contour, contour_pieces
    from .mesh.pieces import Pieces
    from .mesh.survey import survey
    from .mesh.tips import Pointed, with_tips

    work, pieces = clock.work, Pieces(folder)
    pointed = Pointed(planned.voxel, work.threads)
    with clock("meshing"):
        if most >= len(signs):
            made = iter([Piece(contour(planned.root, signs, work), np.inf)])
        else:
            made = contour_pieces(planned.root, signs, work, most)
        for piece in made:
            pieces.add(piece)
            pointed.add(piece)
            work.progress("meshing", min((piece.end - planned.outer.lo[0]) / planned.outer.size[0], 1.0))
        pieces, tips = with_tips(planned, pieces, pointed.points, work)
        return Surface(planned, signs, pieces, survey(pieces, planned.voxel, work.threads), tips)


def refined(surface: Surface, chord: float, clock: Clock) -> tuple[Surface, Refined]:
    """A surface of one piece with more triangles, nowhere farther off than a chord, scene units."""
    from .mesh.extract import Piece
    from .mesh.pieces import Pieces
    from .mesh.refine import refine
    from .mesh.survey import survey

    planned, pieces = surface.planned, Pieces()
    with clock("refining"):
        mesh, done = refine(planned.root, surface.pieces.mesh(0), chord, planned.voxel, clock.work)
        pieces.add(Piece(mesh, np.inf), fresh=len(mesh.triangles))
        shells = survey(pieces, planned.voxel, clock.work.threads)
        return Surface(planned, surface.signs, pieces, shells, surface.tips), done
