"""From a scene to its surface: the plan with its edits for printing, and the surface, in one piece or in
pieces that fit in memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..common.memory import available_bytes
from ..common.messages import significant
from ..errors import GridError, TooLargeError, VolumeError
from ..records import MeshJob
from ..scene import Print, Scene
from ..volume.bricks import BRICK
from ..volume.pruning import distinct
from .report import Clock

if TYPE_CHECKING:
    from ..mesh.pieces import Pieces
    from ..mesh.refine import Refined
    from ..mesh.shells import WholeShells
    from ..volume import Plan, SignBricks
    from ..volume.sampler import Evaluate
    from ..volume.sizing import Sizing
    from .mesh_steps import Executor, Sampled


@dataclass(frozen=True)
class Sized:
    """A plan, its scale, and the remaining choice of bodies."""

    planned: Plan  # field and voxel
    scale: float  # mm per scene unit
    left: Print  # choice of bodies and cavities that is made in the mesh


def plan_mesh(scene: Scene, what: MeshJob, size: Sizing, clock: Clock) -> Sized:
    """Plan the field to be meshed, with its edits."""
    from ..volume import plan
    from ..volume.sizing import orient_field

    how = what.edits(scene)
    with clock("planning"):
        root = orient_field(scene.root, what.up, size.stretch, clock.work)
        made = plan(root, what.voxels(size.longest), clock.work)
        if how.bodies is not None:
            from ..printing.edits import frame_bodies

            made = frame_bodies(made, size, how.bodies, clock.work)
    if not how.whole:
        return apply_edits(made, scene, what, size, clock)
    return Sized(made.strict if what.proved else made, size.scale(made.box), how)


@contextmanager
def in_mm(size: Sizing) -> Iterator[None]:
    """Add the voxel in mm to the error of too large a grid."""
    try:
        yield
    except GridError as error:
        raise VolumeError(f"{error}, {significant(size.longest / error.most)} mm") from None


def apply_edits(made: Plan, scene: Scene, what: MeshJob, size: Sizing, clock: Clock) -> Sized:
    """Make all edits for printing."""
    from ..printing import printable

    how = what.edits(scene)
    with clock("changing"):
        changed, scale = printable(made, size, how, clock.work, measured=False)
    # Walls thinner than a voxel are crumbs in the mesh: choose bodies in the field where it can tell.
    keep = how.keep if made.root.bounds.exterior_only else "all"
    # Keep cavities: the hollow is one.
    changed = changed.strict if what.proved else changed
    return Sized(changed, scale, Print(keep=keep, cavities=how.cavities if how.whole else "keep"))


BYTES_A_CROSSING = 140
"""Peak memory by grid edges that the surface crosses, bytes: 125 to 150 measured, on meshes of 66 and 375
million triangles.
"""

COUNTED = 1 << 12
"""Bricks whose crossings are counted."""

BRICKS = 1 << 13
"""Bricks per piece of a mesh that does not fit in memory, and of a mesh that always fits: 256 voxels along
the longest side.
"""


@dataclass(frozen=True, eq=False)
class Surface:
    """Exact surface of a field, scene units."""

    planned: Plan  # sampled field
    signs: SignBricks  # its samples
    pieces: Pieces  # labelled pieces of the mesh
    shells: WholeShells  # shells of the mesh
    tips: NDArray[np.float64]  # vertices that were added at tips, and at sharp edges that samples cut off

    @property
    def thin(self) -> str:
        """Note on walls thinner than a voxel; empty if there are none."""
        return self.shells.thin_walls(self.planned.voxel)


def sample_surface(planned: Plan, clock: Clock, evaluate: Evaluate | None = None) -> SignBricks:
    """Sample the signs of a planned scene around its surface.

    `planned`: field and voxel.
    """
    from ..volume import sample_scene_signs

    with clock("sampling"):
        return sample_scene_signs(planned, clock.work, evaluate)


def has_thin_walls(signs: SignBricks) -> bool:
    """True if walls thinner than a voxel hold too much of the material for the samples to distinguish
    bodies.
    """
    from ..printing.samples import thin_share
    from ..records import PIECES

    return thin_share(signs) >= PIECES


def refuse_what_does_not_fit(signs: SignBricks, voxel: float) -> None:
    """Raise an error for a surface that needs more memory than is available.

    The number of bricks grows with a power of the resolution: the box-counting dimension of the surface,
    estimated from boxes of one and of two bricks.

    `voxel` in mm.
    """
    needed, free = len(signs) * crossings_a_brick(signs) * BYTES_A_CROSSING, available_bytes()
    if len(signs) <= BRICKS or needed <= free:
        return
    boxes = len(distinct(np.ravel_multi_index((signs.ijk // (2 * BRICK)).T, signs.index.shape)))
    dimension = min(max(math.log2(len(signs) / boxes), 2.0), 3.0)
    fits = voxel * (needed / free) ** (1 / dimension)
    raise TooLargeError(
        f"a voxel of {voxel:.3g}mm needs about {needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are "
        f"free; a voxel of {fits * 1.02:.3g}mm fits"
    )


def crossings_a_brick(signs: SignBricks) -> float:
    """Count the grid edges that the surface crosses, in bricks that are spread evenly."""
    some = signs.signs[:: max(len(signs) // COUNTED, 1)]
    changes = some[:, 1:] ^ some[:, :-1], some[:, :, 1:] ^ some[:, :, :-1], (some ^ (some >> 1)) & 0x7F
    within = sum(int(np.bitwise_count(change).sum()) for change in changes)
    return within / len(some) * BRICK / (BRICK - 1)


def surface_of(
    of: Sampled, cuts: list[tuple[int, int]], pieces: Pieces, executor: Executor, clock: Clock
) -> Surface:
    """Mesh the surface of samples.

    `cuts`: layers of bricks of each piece; `pieces`: where they are kept, empty.
    """
    from ..mesh.ridges import with_ridges
    from ..mesh.shells import survey
    from ..mesh.tips import Pointed, with_tips
    from .mesh_steps import Contour

    planned, work = of.planned, clock.work
    with clock("meshing"):
        found = executor.summary(Contour(of, cuts, pieces), "meshing")
        for end, triangles in zip(found.ends.tolist(), found.triangles.tolist(), strict=True):
            pieces.count(end, triangles)
        pieces.first_labels = np.cumsum([0, *found.components.counts[:-1]]).tolist()
        pointed = Pointed(planned.voxel, work.threads)
        pointed.join(found.pointed, np.inf)
        changed, tips = with_tips(planned, pieces, pointed.points, work)
        changed, tips = with_ridges(planned, changed, found.blunt, tips, work)
        if changed is pieces:
            shells = found.components.shells()
        else:
            shells = survey(changed, planned.voxel, work.threads)
        return Surface(planned, of.signs, changed, shells, tips)


def refine_surface(surface: Surface, chord: float, clock: Clock) -> tuple[Surface, Refined]:
    """Refine a surface in one piece.

    `chord`, and the lengths of the result, in scene units.
    """
    from ..mesh.contouring import Piece
    from ..mesh.pieces import Pieces
    from ..mesh.refine import refine
    from ..mesh.shells import survey

    planned, pieces = surface.planned, Pieces()
    with clock("refining"):
        mesh, done = refine(planned.root, surface.pieces.mesh(0), chord, planned.voxel, clock.work)
        pieces.add(Piece(mesh, np.inf), fresh=len(mesh.triangles))
        shells = survey(pieces, planned.voxel, clock.work.threads)
        return Surface(planned, surface.signs, pieces, shells, surface.tips), done
