"""Plan of a mesh job: the field to mesh, with its edits for printing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..common.digits import significant
from ..errors import GridError, VolumeError
from ..meshjob import MeshJob
from ..scene import Print, Scene
from .clock import Clock

if TYPE_CHECKING:
    from ..volume import Plan
    from ..volume.sizing import Sizing


@dataclass(frozen=True)
class Sized:
    """A plan, its scale, and the remaining choice of bodies.

    Attributes
    ----------
    planned : Plan
        Field and voxel.
    scale : float
        mm per scene unit.
    left : Print
        Choice of bodies and cavities that is made in the mesh.
    """

    planned: Plan
    scale: float
    left: Print


def planned(scene: Scene, what: MeshJob, size: Sizing, clock: Clock) -> Sized:
    """Plan the field to be meshed, with its edits.

    Parameters
    ----------
    scene : Scene
        Scene to mesh.
    what : MeshJob
        Resolution and changes of the mesh.
    size : Sizing
        Size of the object.
    clock : Clock
        Threads, progress, cancellation and timing.

    Raises
    ------
    SceneError, VolumeError, Cancelled
        For a scene that cannot be meshed.
    """
    from ..volume import plan
    from ..volume.sizing import oriented

    how = what.how(scene)
    with clock("planning"):
        root = oriented(scene.root, what.up, size.stretch, clock.work)
        made = plan(root, what.voxels(size.longest), clock.work)
        if how.bodies is not None:
            from ..printing.framing import framed

            made = framed(made, size, how.bodies, clock.work)
    if not how.whole:
        return edited(made, scene, what, size, clock)
    return Sized(made.strict if what.proved else made, size.scale(made.box), how)


@contextmanager
def in_mm(size: Sizing) -> Iterator[None]:
    """Add the voxel in mm to the error of too large a grid.

    Parameters
    ----------
    size : Sizing
        Size of the object.

    Raises
    ------
    VolumeError
        If the managed block raises `GridError`.
    """
    try:
        yield
    except GridError as error:
        raise VolumeError(f"{error}, {significant(size.longest / error.most)} mm") from None


def edited(made: Plan, scene: Scene, what: MeshJob, size: Sizing, clock: Clock) -> Sized:
    """Make all edits for printing.

    Parameters
    ----------
    made : Plan
        Plan without edits.
    scene, what, size, clock
        As for `planned`.

    Returns
    -------
    Sized
        The plan of the edited field.

    Raises
    ------
    SceneError, VolumeError, Cancelled
        For edits that cannot be made.
    """
    from ..printing import printable

    how = what.how(scene)
    with clock("changing"):
        changed, scale = printable(made, size, how, clock.work)
    # Walls thinner than a voxel are crumbs in the mesh: choose bodies in the field where it can tell.
    keep = how.keep if made.root.bounds.exterior_only else "all"
    # Keep cavities: the hollow is one.
    changed = changed.strict if what.proved else changed
    return Sized(changed, scale, Print(keep=keep, cavities=how.cavities if how.whole else "keep"))
