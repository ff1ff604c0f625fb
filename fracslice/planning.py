"""Plan of a mesh job: the field to mesh, with its edits for printing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .meshjob import MeshJob
from .scene import Print, Scene
from .work import Clock

if TYPE_CHECKING:
    from .volume import Plan


@dataclass(frozen=True)
class Sized:
    """A plan, its scale, and the remaining choice of bodies.

    Attributes
    ----------
    planned : Plan
        Field and voxel.
    scale : float or None
        mm per scene unit; None if it is not yet known.
    left : Print
        Choice of bodies and cavities that is made in the mesh.
    """

    planned: Plan
    scale: float | None
    left: Print


def planned(scene: Scene, what: MeshJob, clock: Clock) -> Sized:
    """Plan the field to be meshed, with its edits.

    Parameters
    ----------
    scene : Scene
        Scene to mesh.
    what : MeshJob
        Size, resolution and changes of the mesh.
    clock : Clock
        Threads, progress, cancellation and timing.

    Returns
    -------
    Sized
        The plan.

    Raises
    ------
    SceneError, VolumeError, Cancelled
        For a scene that cannot be meshed.
    """
    from .volume import plan

    how = what.how(scene)
    with clock("planning"):
        made = plan(scene.root, what.voxels(scene), clock.work)
    return Sized(made, None, how) if how.whole else edited(made, scene, what, clock)


def edited(made: Plan, scene: Scene, what: MeshJob, clock: Clock) -> Sized:
    """Make all edits for printing.

    Parameters
    ----------
    made : Plan
        Plan without edits.
    scene, what, clock
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
    from .printing import printable

    how = what.how(scene)
    with clock("changing"):
        changed, scale = printable(made, what.size(scene), how, clock.work)
    # Walls thinner than a voxel are crumbs in the mesh: choose bodies in the field where it can tell.
    keep = how.keep if made.root.bounds.exterior_only else "all"
    # Keep cavities: the hollow is one.
    return Sized(changed, scale, Print(keep=keep, cavities=how.cavities if how.whole else "keep"))
