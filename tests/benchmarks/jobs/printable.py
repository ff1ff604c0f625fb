"""CPU seconds and memory of `fracslice mesh` with a repair for printing, 80 mm at 128 voxels; second run."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from ..runner import Row, Run, process
from .command import COMMAND

SOLIDS = {"sponge": '<menger level="2"/>', "Mandelbulb": "<mandelbulb/>"}
REPAIRS = ("none", "--bridge 2mm", "--cavities fill --keep largest", "--thickness 3mm", "--hollow 3mm")
RUNS = 3
SMALLEST = {"solids": ("sponge",), "repairs": ("none",), "resolution": 12}


def rows(
    run: Run,
    solids: tuple[str, ...] = tuple(SOLIDS),
    repairs: tuple[str, ...] = REPAIRS,
    resolution: int = 128,
) -> Iterator[Row]:
    for name in solids:
        with tempfile.TemporaryDirectory() as folder:
            scene, stl = Path(folder) / "scene.xml", Path(folder) / "mesh.stl"
            scene.write_text(f'<scene version="1"><solid size="80mm">{SOLIDS[name]}</solid></scene>')
            words = [*COMMAND, "mesh", scene, "-o", stl, "--resolution", resolution, "--quiet"]
            words += ["--threads", run.threads[0]]
            acts = {repair: [*words, *repair.replace("none", "").split()] for repair in repairs}
            measured = run.interleaved(
                {repair: partial(process, command) for repair, command in acts.items()}
            )
        for repair in repairs:
            spent = {"CPU s": measured.spread(repair, "cpu_s"), "peak MB": measured.spread(repair, "peak_mb")}
            yield {"": name, "repair": repair, **spent}
