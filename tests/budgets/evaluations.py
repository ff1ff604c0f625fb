"""How often the field is evaluated: by the sampler, along rays, and in slices."""

from __future__ import annotations

import numpy as np

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import Node
from fracslice.rendering import Renderer
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.volume import Lattice, sample
from fracslice.work import Work

from .workloads import WORKLOADS

VOXELS = 128
PIXELS, LAYERS = 256, 8
FRAME = (160, 120)
CAMERA = Camera(eye=(1.9, -2.3, 1.2), fov=50)


def evaluations() -> dict[str, float]:
    """By workload: evaluations per kept sample, per pixel that a contour cuts, and per ray that hits."""
    result = {}
    for name, root in WORKLOADS.items():
        result[f"{name}: evaluations per kept sample, {VOXELS} voxels"] = per_sample(root)
        result[f"{name}: evaluations per cut pixel, {PIXELS} pixels"] = per_pixel(root)
        result[f"{name}: steps per ray that hits"] = per_ray(root)
    return result


def per_sample(root: Node) -> float:
    box = root.bounds.box
    bricks = sample(compile_scene(root), root.bounds, Lattice.around(box, max(box.size) / VOXELS))
    return bricks.evaluations / bricks.values.size


def per_pixel(root: Node) -> float:
    stack = plan_stack(root, SliceJob(size=PIXELS / 5, layer=0.4, pixel=(0.2, 0.2)))
    middle = len(stack.z) // (2 * LAYERS) * LAYERS
    layers = Slicer(stack, Work(threads=1)).map(
        lambda layer: (layer.evaluations, layer.boundary), range(middle, middle + LAYERS)
    )
    spent, cut = np.sum(list(layers), axis=0)
    return float(spent / cut)


def per_ray(root: Node) -> float:
    view = View(camera=CAMERA, lights=(Light(shadows="no"),), shading=Shading(mode="steps"))
    *_, last = Renderer(root, view, FRAME, Work(threads=1), "cpu").passes(samples=1)
    return float(last.image[last.alpha > 0, 0].astype(np.float64).mean())
