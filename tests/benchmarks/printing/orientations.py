"""Directions up of `orient` beside those of Tweaker-3: volume of supports, by our planner, and time.

Tweaker-3 turns the mesh of the object so that its overhangs are least; it is compared if its module
`MeshTweaker` can be imported. PrusaSlicer 2.5 finds no direction by command line.
"""

from __future__ import annotations

import importlib
import statistics
from collections.abc import Iterator
from typing import Any

from fracslice import make_mesh
from fracslice.common.messages import lacking
from fracslice.fields.box import Triple
from fracslice.formulas import Node
from fracslice.records import Print
from fracslice.slicing import SliceJob, plan_stack
from fracslice.slicing.orientation import orientations
from fracslice.volume.amount import Sizing
from fracslice.work import Work

from ..runner import Row, Run
from .models import NAMES, scene_of

SMALLEST = {"names": ("bauble",)}
RUNS = 1
SIZE, VOXELS = 30.0, 96


def rows(run: Run, names: tuple[str, ...] = NAMES) -> Iterator[Row]:
    work, ratios = Work(threads=run.threads[0]), []
    for name in names:
        row = _row(run, scene_of(name).root, work)
        if "ratio" in row:
            ratios.append(row["ratio"])
        yield {"": name, **row}
    if ratios:
        yield {"": f"median of {len(ratios)}", "ratio": statistics.median(ratios)}


def _row(run: Run, root: Node, work: Work) -> Row:
    """Volumes of supports in both directions, and the time of both searches."""
    found: dict[str, Triple] = {}

    def ours() -> None:
        found["orient"] = orientations(root, Sizing(SIZE), work)[0].up

    acts: dict[str, Any] = {"orient": ours}
    lacks = lacking("MeshTweaker", "the comparison needs")
    if not lacks:
        corners = make_mesh(root, size=SIZE, resolution=VOXELS, threads=run.threads[0]).corners.reshape(-1, 3)
        tweak = importlib.import_module("MeshTweaker").Tweak

        def theirs() -> None:
            x, y, z = tweak(corners, extended_mode=True, verbose=False, min_volume=True).alignment.tolist()
            found["Tweaker-3"] = (x, y, z)

        acts["Tweaker-3"] = theirs
    figures = run.interleaved(acts, warm=False)
    volumes = {name: _supports(root, up, work) for name, up in found.items()}
    row: Row = {f"{name}, mm3": volume for name, volume in volumes.items()}
    if lacks:
        row["Tweaker-3"] = "not installed"
    row |= {f"{name}, CPU s": figures.spread(name, "cpu_s") for name in acts}
    if volumes.get("Tweaker-3"):
        row["ratio"] = volumes["orient"] / volumes["Tweaker-3"]
    return row


def _supports(root: Node, up: Triple, work: Work) -> float:
    """Volume of supports of an object in a direction, mm3."""
    job = SliceJob(size=SIZE, layer=0.1, pixel=0.1, up=up, printing=Print(supports="medium"))
    held = plan_stack(root, job, work).supports
    return held.volume if held else 0.0
