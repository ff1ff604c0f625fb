"""Supports of models beside those of PrusaSlicer on the same files: shipped scenes as STL, and a vase.

Models are meshes of 64 voxels, so that PrusaSlicer, which exports layers, too, ends within its limit of time.
Supports are medium ones, and the automatic ones of PrusaSlicer.
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Iterator
from pathlib import Path

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Node, get
from fracslice.scene import Scene, library, read, scene

from ..runner import Row, Run
from .supports import ours, prusa

SMALLEST = {"names": ("menger-tower",), "voxels": 24, "layer": 0.4, "peer": 0}
RUNS = 1
VASE = Path(__file__).parents[3] / "examples/vase.stl"
NAMES = *library.names(), "vase"


def rows(
    run: Run,
    names: tuple[str, ...] = NAMES,
    size: float = 30.0,
    layer: float = 0.1,
    voxels: int = 64,
    peer: int = 1,
) -> Iterator[Row]:
    volumes, times = list[float](), list[float]()
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            model = Path(folder) / f"{name}.stl"
            own = make_mesh(scene_of(name), MeshJob(size=size, resolution=voxels), path=model).report.mesh
            row = ours(run, _model(model), size, layer, orient=False)
            if peer:
                row |= prusa(model, own.volume_mm3, layer, row)
        if "volume, ratio" in row:
            volumes.append(row["volume, ratio"])
            times.append(row["time, ratio"])
        yield {"": name, "triangles": own.triangles, **row}
    if volumes:
        ratios = {"volume, ratio": statistics.median(volumes), "time, ratio": statistics.median(times)}
        yield {"": f"median of {len(volumes)}", **ratios}


def scene_of(name: str) -> Scene:
    """A shipped scene, or the vase."""
    return scene(_model(VASE), unit=1.0) if name == "vase" else read(library.path(name))


def _model(file: Path) -> Node:
    """A model as it lies in its file, mm."""
    return get("model")(str(file), place="as is", units="mm")
