"""The implicit job: from a scene to a 3MF file that holds its formula."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import SceneError
from ..formulas import Node
from ..formulas.box import Box
from ..records import MeshJob
from ..scene import Print, Scene
from ..work import Work
from .planning import plan_mesh
from .report import Clock, Placement


@dataclass(frozen=True)
class Implicit:
    """A file that holds a formula."""

    path: Path  # the file
    operations: int  # operations of the formula
    root: Node  # the field that was written
    place: Placement  # map from the scene to the file
    box: Box  # bounds of the object, mm
    notes: tuple[str, ...]  # details that the voxel is too large to resolve


def make_implicit(
    scene: Scene, what: MeshJob | None = None, path: str | Path = "", work: Work | None = None
) -> Implicit:
    """Write the formula of a scene as 3MF with the volumetric and implicit extensions.

    `what`: the size, and the voxel that automatic depths follow from.
    """
    from ..export import check_target
    from ..export.implicit import write_implicit
    from ..kernel.graph import graph
    from ..volume.sizing import sizing
    from .mesh_writing import metadata

    what, clock = what or MeshJob(), Clock(work or Work())
    _refuse(what.edits(scene))
    check_target(path)
    size = sizing(scene, what.size, what.scale, clock.work)
    made = plan_mesh(scene, what, size, clock)
    plan = made.planned
    assert plan.root.tree is not None
    (x, y, _), scale = plan.box.centre, made.scale
    place = Placement(scale, (-scale * x, -scale * y, -scale * plan.box.lo[2]))
    box, outer = (Box.around(map(tuple, place.mm(np.array([b.lo, b.hi])))) for b in (plan.box, plan.outer))
    operations = graph(plan.root.tree, place.scale, place.offset)
    about = metadata(scene)
    file = write_implicit(operations, outer, plan.voxel * scale, path, about)
    return Implicit(file, len(operations), plan.root.tree, place, box, plan.notes)


def _refuse(how: Print) -> None:
    """Raise an error for a change that needs samples of the field."""
    names = ["bridge", "gap", "thickness", "hollow"]
    changes = [name for name in names if getattr(how, name)]
    changes += [name for name in ("keep", "cavities") if getattr(how, name) not in ("all", "keep")]
    if changes:
        raise SceneError(f"{changes[0]}: needs samples of the field; expected a mesh, or formulas alone")
