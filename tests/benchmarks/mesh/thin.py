"""Plates and wires thinner than a voxel: bodies, volume, triangles, time against a plate of two voxels.

Off: the volume against the exact one. Samples lack: the share of the volume that samples of the same voxel
miss. Jobs from the scene to the checked mesh in memory, with the attempt by samples that shows the loss.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from fracslice import MeshJob
from fracslice.fields.node import Node
from fracslice.formulas import box, capsule, transform
from fracslice.jobs.mesh import make_mesh
from fracslice.scene import scene
from fracslice.volume import plan
from fracslice.work import Work

from ..runner import Row, Run

ENDS = np.array([(-0.6, -0.5, -0.62), (0.63, 0.57, 0.6)])
REFERENCE = "plate 2"
RUNS = 3
SMALLEST = {"thicknesses": (0.3,), "voxels": 24.0}


def plate(thickness: float, voxels: float) -> tuple[Node, float]:
    """A turned plate, thickness in voxels, and its volume, scene units^3."""

    def of(units: float) -> Node:
        return transform(box(size=(2, 2, units)), rotate=(1, 2, 3, 37.0))

    units = thickness * max(plan(of(0.01), voxels).box.size) / voxels
    return of(units), 4 * units


def wire(thickness: float, voxels: float) -> tuple[Node, float]:
    """A slanted wire with round ends, diameter in voxels, and its volume, scene units^3."""
    radius = thickness * np.ptp(ENDS, axis=0).max() / voxels / 2
    length = float(np.linalg.norm(ENDS[1] - ENDS[0]))
    node = capsule(from_=ENDS[0].tolist(), to=ENDS[1].tolist(), radius=radius)
    return node, math.pi * radius**2 * (length + 4 / 3 * radius)


def rows(
    run: Run, thicknesses: tuple[float, ...] = (1.0, 0.6, 0.3, 0.1, 0.05), voxels: float = 128.0
) -> Iterator[Row]:
    shapes = {REFERENCE: plate(2, voxels)}
    for name, shape in (("plate", plate), ("wire", wire)):
        shapes |= {f"{name} {thickness:g}": shape(thickness, voxels) for thickness in thicknesses}
    work = Work(threads=run.threads[0])
    acts = {
        name: partial(make_mesh, scene(node, size="40mm"), MeshJob(resolution=voxels), work)
        for name, (node, _) in shapes.items()
    }
    measured = run.interleaved({name: partial(quietly, act) for name, act in acts.items()})
    for name, (_, volume) in shapes.items():
        result = acts[name]()
        report = result.report
        lost = [note.split("samples lose ")[1] for note in report.notes if "samples lose " in note]
        yield {
            "": name,
            "samples lack": lost[0].removesuffix(" of the object's volume") if lost else "",
            "bodies": report.mesh.components,
            "off": f"{report.mesh.volume_mm3 / result.place.scale**3 / volume - 1:+.2%}",
            "triangles": report.mesh.triangles,
            "defects": ", ".join(report.problems) or "none",
            "CPU s": measured.spread(name, "cpu_s"),
            f"times {REFERENCE}": measured.ratio(name, REFERENCE, "cpu_s"),
        }


def quietly(act: partial) -> None:  # type: ignore[type-arg]
    """Run; a result that were returned would count as figures."""
    act()
