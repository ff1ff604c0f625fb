"""How deep a fractal is for a voxel: ``iterations="auto"``, and levels that are too fine to be shown."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..formulas.parameters import AUTO
from ..formulas.registry import Node
from ..formulas.transforms import affine
from .cpu import compile_scene
from .identity import Known

DEEPEST = 60
PROBES = 4000
BISECTIONS = 24


def resolve_depths(root: Node, voxel: float) -> Node:
    """The scene with every automatic depth replaced by a number, for a voxel size in scene units.

    For each fractal by itself: the smallest depth at which one more step would move nine tenths of its
    surface by less than half a voxel (its own, where a transform scales it). Deeper detail is smaller than
    the samples can show.
    """
    voxel = _within(root, voxel)
    children = tuple(resolve_depths(child, voxel) for child in root.children)
    if AUTO in (v for v in root.values.values() if isinstance(v, str)):
        return root.changed(iterations=_depth(root, voxel))
    return root if children == root.children else root.changed(children)


def visible(root: Node, voxel: float) -> tuple[Node, tuple[str, ...]]:
    """The scene without parts that fall between samples a voxel apart, and what was left out of it, in words.

    What a formula says of itself (`Node.visible`); seams, walls and bends around it are not looked at.
    """
    found = root.visible(voxel)
    told = [
        f"{root.formula.name}: {name} {found[name]} of {value}; finer parts are thinner than a voxel"
        for name, value in root.values.items()
        if found[name] != value
    ]
    shown = [visible(child, _within(root, voxel)) for child in root.children]
    children = tuple(child for child, _ in shown)
    whole = found if children == root.children else found.changed(children)
    return whole, tuple(dict.fromkeys([*told, *(note for _, notes in shown for note in notes)]))


def _within(node: Node, voxel: float) -> float:
    """A voxel in the units of a node's children: the largest, where a transform stretches."""
    if node.formula.name != "transform":
        return voxel
    return voxel / float(np.linalg.svd(affine(node)[0], compute_uv=False)[-1])


def _depth(node: Node, voxel: float) -> int:
    for depth in range(1, DEEPEST):
        step = _step(*(Known(node.changed(iterations=d)) for d in (depth, depth + 1)))
        if step is None:
            return max(depth - 1, 1)
        if step < voxel / 2:
            return depth
    return DEEPEST


@lru_cache(maxsize=256)
def _step(before: Known, after: Known) -> float | None:
    """How far one more step moves nine tenths of the surface at most, scene units; None if there is none."""
    surface = _surface_points(before.node)
    if surface.shape[1] == 0:
        return None
    moved = compile_scene(after.node, "float64").points(*surface)
    return float(np.quantile(moved, 0.9))


def _surface_points(node: Node) -> np.ndarray:
    """Points [3, n] on the surface, always the same: bisected between random points inside and outside."""
    kernel, box = compile_scene(node, "float64"), node.facts.box
    rng = np.random.default_rng(0)
    points = rng.uniform(np.array(box.lo)[:, None], np.array(box.hi)[:, None], (3, PROBES))
    inside = kernel.points(*points) < 0
    count = min(inside.sum(), (~inside).sum())
    a, b = points[:, inside][:, :count], points[:, ~inside][:, :count]
    for _ in range(BISECTIONS):
        middle = (a + b) / 2
        inner = kernel.points(*middle) < 0
        a, b = np.where(inner, middle, a), np.where(inner, b, middle)
    return b
