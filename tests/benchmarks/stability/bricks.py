"""Samples never taken: bricks of the box that are sampled, and steps of the kept samples' orbits.

A vector of 32 lanes stops when all of them have escaped.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracslice.expr.graph import ON_ARRAYS, Evaluator
from fracslice.fields.cpu import compile_scene
from fracslice.fields.linker import FIELD, link
from fracslice.formulas import Node
from fracslice.volume import Lattice, sample
from fracslice.volume.bricks import INSIDE, Bricks
from tests.budgets.instructions import LANES
from tests.budgets.workloads import WORKLOADS

from ..runner import Row, Run

SMALLEST = {"voxels": 16, "solids": ("sphere",)}


def sampled(root: Node, voxels: int) -> Bricks:
    box = root.bounds.box
    return sample(compile_scene(root), root.bounds, Lattice.around(box, max(box.size) / voxels))


def orbit_steps(root: Node, result: Bricks, most: int = 400) -> tuple[float, float]:
    """Steps per sample until it leaves, and until all of its vector have left; the reference counts them."""
    linked, alive = link(root), []
    counting = {**ON_ARRAYS, "any_of": lambda mask: alive.append(mask) or bool(np.any(mask))}
    named = linked.program.functions
    picked = result.ijk[:: max(1, len(result) // most)]
    index = picked[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T
    points = np.asarray(result.origin) + result.voxel * index.reshape(-1, 3)
    with np.errstate(all="ignore"):
        Evaluator(counting, named)(named[FIELD], *points.T, linked.parameters)
    masks = np.array(alive)
    return float(masks.sum(0).mean()), float(masks.reshape(len(masks), -1, LANES[32]).any(2).sum(0).mean())


def rows(run: Run, voxels: int = 256, solids: tuple[str, ...] = tuple(WORKLOADS)) -> Iterator[Row]:
    for name in solids:
        root = WORKLOADS[name]
        result = sampled(root, voxels)
        inside, whole = int((result.index == INSIDE).sum()), result.index.size
        row = {"": name, "bricks in the box": whole, "sampled": len(result), "inside, never sampled": inside}
        row["evaluations of dense"] = f"{result.evaluations / (512 * whole):.1%}"
        row["per kept sample"] = f"{result.evaluations / result.values.size:.2f}"
        if "iterations" in root.values:
            own, vector = orbit_steps(root, result)
            steps = {"until its vector has left": f"{vector:.2f}", "until it has left": f"{own:.2f}"}
            row = {**row, "iterations": root["iterations"], **steps}
        yield row
