"""Plan of a mesh job: the field to mesh, with its edits for printing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..common.messages import significant
from ..errors import GridError, VolumeError
from ..records import MeshJob
from ..scene import Print, Scene
from .report import Clock

if TYPE_CHECKING:
    from ..volume import Plan
    from ..volume.sizing import Sizing


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
            from ..printing.framing import frame_bodies

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
        changed, scale = printable(made, size, how, clock.work)
    # Walls thinner than a voxel are crumbs in the mesh: choose bodies in the field where it can tell.
    keep = how.keep if made.root.bounds.exterior_only else "all"
    # Keep cavities: the hollow is one.
    changed = changed.strict if what.proved else changed
    return Sized(changed, scale, Print(keep=keep, cavities=how.cavities if how.whole else "keep"))
