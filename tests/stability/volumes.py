"""Whether a scene's mesh and layers are solids of its volume, or say how much of it they lack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fracslice import MeshJob, make_mesh
from fracslice.errors import VolumeError
from fracslice.fields.cpu import compile_scene
from fracslice.formulas import Box, Node
from fracslice.scene import scene
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.layers import layers_amount
from fracslice.work import Work

SIZE = 50.0
TOLERANCE, BETWEEN = 0.02, 0.03
"""Shares of the volume: of a mesh or layers against the field, and of layers against the mesh."""

SIDE = 48
"""Cells along each side of the box, with two random points in each."""


@dataclass(frozen=True)
class Volumes:
    """faults: wrong and not reported. reported: something is missing. off, layers: by how much of the
    field's volume the mesh and the layers differ from it.
    """

    faults: tuple[str, ...] = ()
    reported: tuple[str, ...] = ()
    off: float = 0.0
    layers: float = 0.0


def estimate(root: Node, box: Box) -> tuple[float, float]:
    """The volume of the field's inside within a box, and its standard error."""
    cells = np.indices((SIDE,) * 3).reshape(3, -1, 1)
    share = (cells + np.random.default_rng(5).uniform(size=(3, cells.shape[1], 2))) / SIDE
    points = np.array(box.lo)[:, None, None] + np.array(box.size)[:, None, None] * share
    field = compile_scene(root, "float64").points(*points.reshape(3, -1))
    inside = (field < 0).reshape(-1, 2).mean(axis=1)
    cell = float(np.prod(box.size)) / len(inside)
    return cell * float(inside.sum()), cell * float(np.sqrt((inside * (1 - inside)).sum()))


def volumes(root: Node, resolution: float) -> Volumes:
    """Makes both and judges them; what is nothing has no faults."""
    work = Work(threads=1)
    try:
        made = make_mesh(scene(root, size=SIZE), MeshJob(resolution=resolution), work)
    except VolumeError as error:
        return Volumes(reported=(str(error),))
    report, unit, grid = made.report, made.place.scale**3, made.bricks
    faults = [n for n in ("watertight", "manifold", "oriented") if not getattr(report.mesh, n)]
    hi = np.array(grid.origin) + grid.voxel * 8 * np.array(grid.index.shape)
    volume, error = estimate(made.root, Box(grid.origin, (hi[0], hi[1], hi[2])))
    of_mesh = (report.mesh.volume_mm3 + report.removed.bodies_mm3) / unit
    amount = report.amount_mm3
    assert amount is not None
    if abs(amount.object / unit - volume) > 5 * np.hypot(error, amount.error / unit):
        faults.append(f"by the report the volume is {amount.object / unit:.4g}, not {volume:.4g}")
    stack = plan_stack(root, SliceJob(size=SIZE, layer=report.voxel_mm, pixel=(report.voxel_mm,) * 2), work)
    areas = np.array(list(Slicer(stack, work).map(lambda layer: layer.area)))
    of_layers = float(areas @ stack.heights) / stack.scale**3
    of_stack, note, lost, _ = layers_amount(Slicer(stack, work), work)
    if stack.root != made.root:
        faults.append(f"the mesh is of {made.root}, the layers are of {stack.root}")
    quantised = tuple(line for line in stack.notes if line.startswith("whole layers"))
    lacks = bool(of_stack.off or quantised)
    for name, is_, reported in (("mesh", of_mesh, amount.off), ("layers", of_layers, lacks)):
        if abs(is_ - volume) > max(TOLERANCE * volume, 5 * error) and not reported:
            faults.append(f"the volume of the {name} is {is_:.4g}, not {volume:.4g} +- {error:.2g}")
    reported = (
        tuple(line for line in (*report.notes, *report.lost, *note, *lost) if line not in stack.notes)
        + quantised
    )
    if abs(of_layers / of_mesh - 1) > BETWEEN and not reported:
        faults.append(f"the volume of the layers is {of_layers:.4g}, of the mesh {of_mesh:.4g}")
    return Volumes(tuple(faults), reported, of_mesh / volume - 1, of_layers / volume - 1)
