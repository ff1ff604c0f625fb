"""Whether an object has one size: mm per scene unit and volume of its meshes and layers, at several voxels.

Shipped scenes of 30 mm and sets whose specks hold the size. About a quarter of an hour on one core.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracslice import MeshJob
from fracslice.errors import VolumeError
from fracslice.formulas import Node, julia, mandelbulb, quaternion_mandelbrot
from fracslice.jobs.mesh import make_mesh
from fracslice.scene import library, read, scene
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.layers import layers_amount
from fracslice.volume.amount import Completeness
from fracslice.volume.extent import _kept
from fracslice.work import Work
from tests.examples import EXAMPLES

from ..runner import Row, Run

SIZE = 30.0
EXACT, TOLERANCE = 1e-6, 0.01

SETS: dict[str, Node] = {
    "mandelbulb 3": mandelbulb(power=3, iterations=10),
    "mandelbulb 8": mandelbulb(power=8, iterations=10),
    "julia dust": julia(c=(-0.4969, 0.3651, 0.6223, 0.4209), iterations=12),
    "quaternion mandelbrot": quaternion_mandelbrot(iterations=12),
}

OTHERS = (
    "julia 4d",
    "mandelbulb 2",
    "mandelbulb 5",
    "mandelbulb 7.5",
    "mandelbulb in pieces",
    "mandelbulb julia",
    "apollonian",
    "tetrabrot",
    "mandelbox -1.5",
    "abox",
    "bristorbrot",
    "burning ship",
    "amazing surf",
    "quaternion cube",
    "cosine bulb",
    "lambda bulb",
    "benesi",
)
ROOTS = SETS | {name: EXAMPLES[name] for name in OTHERS}

SMALLEST = {"names": ("mandelbulb 3",), "resolutions": (32.0,)}

Made = tuple[float, float, bool]
"""mm per scene unit, share of the object's volume, and true if a note or problem says what is missing."""


def of_mesh(root: Node, resolution: float, work: Work) -> Made:
    made = make_mesh(scene(root, size=SIZE), MeshJob(resolution=resolution), work)
    report = made.report
    assert report.amount_mm3 is not None
    share = report.amount_mm3.made / report.amount_mm3.object
    return made.place.scale, share, bool(report.notes or report.lost)


def of_layers(root: Node, resolution: float, work: Work) -> Made:
    step = SIZE / resolution
    stack = plan_stack(root, SliceJob(size=SIZE, layer=step, pixel=(step, step)), work)
    found: Completeness = layers_amount(Slicer(stack, work), work)
    said = bool(found.notes or found.problems or stack.notes)
    return stack.scale, found.amount.made / found.amount.object, said


def rows(
    run: Run,
    names: tuple[str, ...] = (*ROOTS, *library.names()),
    resolutions: tuple[float, ...] = (50.0, 100.0, 144.0, 200.0),
) -> Iterator[Row]:
    work = Work(threads=run.threads[0])
    for name in names:
        root = ROOTS[name] if name in ROOTS else read(library.path(name)).root
        scales, shares, unsaid = [], [], 0
        for resolution in resolutions:
            for kind in (of_mesh, of_layers):
                _kept.clear()  # each measures the object itself
                try:
                    scale, share, said = kind(root, resolution, work)
                except VolumeError:  # no sample is inside
                    continue
                scales.append(scale)
                shares.append(share)
                unsaid += abs(share - 1) > TOLERANCE and not said
        spread = np.ptp(scales) / scales[0] if scales else 0.0
        if spread > EXACT:
            run.faults.append(f"{name}: mm per scene unit differs by {spread:.1e}")
        yield {
            "": name,
            "made": len(scales),
            "scales differ by": f"{spread:.0e}",
            "volume, least": f"{min(shares, default=0):.3f}",
            "greatest": f"{max(shares, default=0):.3f}",
            "off and unsaid": unsaid,
        }
