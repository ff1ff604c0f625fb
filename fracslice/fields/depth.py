"""Iteration depth of fractals: ``iterations="auto"``, and levels too fine for a voxel size."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from ..common.arrays import affine, quantile, stretches
from ..common.parameters import AUTO, Count
from ..errors import EmptyError
from ..expr.runtime import keep_text, kept_text
from .box import possible_cells
from .cpu import compile_scene
from .registry import Node

DEEPEST = 60
"""Largest automatic depth."""

PROBES = 1 << 12, 1 << 15, 1 << 18
"""Random points to test, until `ENOUGH` of them are inside."""

ENOUGH = 256
"""Sufficient number of surface points."""

CELLS = 1 << 13
"""Largest number of cells searched for the surface."""

STEPS = "steps"
"""Kind of text in the cache."""

WIDE = 8
"""Voxels below which tips of the smallest parts may come off, half their width."""

BISECTIONS = 24
"""Bisection steps per surface point."""


@dataclass(frozen=True)
class Known:
    """Scene tree that compares equal to every tree with the same key."""

    node: Node = field(compare=False)  # scene tree
    key: str = field(init=False)  # its key

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", self.node.key)


def resolve_depths(root: Node, detail: float) -> Node:
    """Replace every automatic depth by a number, for a given size of detail.

    Each fractal is resolved on its own: its depth is the smallest at which one more iteration would move nine
    tenths of its surface by less than half that size, measured in its own units where a transform scales it.

    Parameters
    ----------
    root
        Scene.
    detail
        Size of detail, scene units.

    Returns
    -------
    Node
        Scene with resolved depths.

    Raises
    ------
    KernelError
        If a formula cannot be compiled.
    """
    if not may_be_automatic(root):
        return root
    detail = _within(root, detail)
    children = tuple(resolve_depths(child, detail) for child in root.fields)
    root = root if children == root.fields else _with_fields(root, children)
    automatic = tuple(name for name, value in root.values.items() if value == AUTO)
    return _at(root, automatic, _depth(root, automatic, detail)) if automatic else root


def may_be_automatic(root: Node) -> bool:
    """Return whether a tree has formulas whose depths may be automatic."""
    kinds = (kind for formula in root.formulas for kind in formula.parameters.values())
    return any(isinstance(kind, Count) and AUTO in kind.words for kind in kinds)


def with_depths_of(root: Node, known: Node) -> Node:
    """Give automatic depths the values that they have in another scene of the same elements."""
    if not may_be_automatic(root):
        return root
    if root.formula is not known.formula or len(root.children) != len(known.children):
        return root
    depths = {name: known[name] for name, value in root.values.items() if value == AUTO}
    pairs = zip(root.children, known.children, strict=True)
    children = tuple(with_depths_of(*pair) for pair in pairs)
    return root.changed(children, **depths) if depths or children != root.children else root


def depth_notes(root: Node, known: Node) -> tuple[str, ...]:
    """Describe the automatic depths of a scene, such as "mandelbulb 5"."""
    pairs = zip(root.walk(), known.walk(), strict=True) if known is not root else ()
    return tuple(f"{a.formula.name} {b[n]}" for a, b in pairs for n in a.values if a[n] != b[n])


def visible(root: Node, voxel: float) -> tuple[Node, tuple[str, ...]]:
    """Drop the parts of a scene that fall between samples one voxel apart.

    Each formula decides for itself (`Node.visible`); seams, walls and bends around it are not considered.

    `voxel` in scene units.
    """
    if not root.has_hook("visible"):
        return root, ()
    coarser = root.visible(voxel)
    changed = [
        f"{root.formula.name}: {name} {coarser[name]} of {value}; finer parts are thinner than a voxel"
        for name, value in root.values.items()
        if coarser[name] != value
    ]
    shown = [visible(child, _within(root, voxel)) for child in root.fields]
    children = tuple(child for child, _ in shown)
    whole = coarser if children == root.fields else _with_fields(coarser, children)
    return whole, tuple(dict.fromkeys([*changed, *(note for _, notes in shown for note in notes)]))


def shallower(root: Node, voxel: float) -> tuple[str, ...]:
    """Find the depths at which the smallest parts of a scene are many voxels wide.

    `voxel` in scene units.
    """
    coarse = resolve_depths(_automatic(visible(root, WIDE * voxel)[0]), WIDE * voxel)
    pairs = zip(root.walk(), coarse.walk(), strict=True)
    changed = [f"{a.formula.name}.{n}={b[n]}" for a, b in pairs for n in a.values if a[n] != b[n] < a[n]]
    return tuple(dict.fromkeys(changed))


@contextmanager
def with_depth_advice(root: Node | None, voxel: float) -> Iterator[None]:
    """Add the depths that voxels show to the error of an empty scene.

    `voxel` in scene units.
    """
    try:
        yield
    except EmptyError as error:
        settings = shallower(root, voxel) if root else ()
        raise EmptyError(" or ".join([str(error), *settings])) from None


def _automatic(root: Node) -> Node:
    """Scene with all depths automatic that may be."""
    kinds = root.formula.parameters.items()
    depths = {name: AUTO for name, kind in kinds if isinstance(kind, Count) and AUTO in kind.words}
    return _with_fields(root, tuple(map(_automatic, root.fields)), **depths)


def _with_fields(node: Node, fields: tuple[Node, ...], **values: Any) -> Node:
    """Copy of a node with other fields and values; its steps stay."""
    return node.changed((*node.children[: len(node.children) - len(node.fields)], *fields), **values)


def _within(node: Node, voxel: float) -> float:
    """Voxel size in the units of a node's children; the largest one if a transform stretches."""
    if node.formula.name != "transform":
        return voxel
    return voxel / float(stretches(affine(node.values)[0])[-1])


def _at(node: Node, names: tuple[str, ...], depth: int) -> Node:
    values: dict[str, Any] = dict.fromkeys(names, depth)
    return node.changed(**values)


def _depth(node: Node, names: tuple[str, ...], detail: float) -> int:
    """Smallest sufficient depth; the deepest non-empty one if none is sufficient.

    Solids of successive depths need not be nested: steps of a Mandelbox add and take away in turns, and every
    other step is small. So two successive steps have to be.
    """
    steps = _steps(*(Known(_at(node, names, d)) for d in (1, DEEPEST)))
    for depth in range(1, DEEPEST):
        for k in range(len(steps) + 1, depth + 2):
            steps.append(_step(*(Known(_at(node, names, d)) for d in (k, k + 1))))
            keep_text(STEPS, steps.made_of, " ".join(map(repr, steps)))
        step, following = steps[depth - 1 : depth + 1]
        if step is None:
            return max(depth - 1, 1)
        if max(step, following or 0.0) < detail / 2:
            return depth
    return DEEPEST


class _Steps(list[float | None]):
    """Results of `_step` for a formula from depth 1 on, and what they are made of."""

    def __init__(self, *made_of: str) -> None:
        self.made_of = made_of
        steps = kept_text(STEPS, made_of, lambda: "").split()
        super().__init__(None if step == repr(None) else float(step) for step in steps)


@lru_cache(maxsize=64)
def _steps(first: Known, last: Known) -> _Steps:
    """Steps of a formula so far; `_depth` adds more: a key per depth would take longer."""
    return _Steps(np.__version__, first.key, last.key)


def _step(before: Known, after: Known) -> float | None:
    """Largest displacement of nine tenths of the surface by one more iteration, scene units.

    None if the shallower solid is empty. Exterior values measure it: where the iteration removes material,
    those of the deeper solid on the surface of the other; where it adds material, those of the other solid on
    the surface of the deeper one.
    """
    surfaces = [_surface_points(solid) for solid in (before, after)]
    if not surfaces[0].shape[1]:
        return None
    moved = [
        quantile(compile_scene(other.node, "float64").points(*surface), 0.9)
        for surface, other in zip(surfaces, (after, before), strict=True)
        if surface.shape[1]
    ]
    return float(max(*moved, 0.0))


@lru_cache(maxsize=16)
def _surface_points(solid: Known) -> np.ndarray:
    """Points [3, n] on the surface, the same in every run; n = 0 if nothing is inside.

    They are bisected between random points inside and outside, in cells that may be inside.
    """
    kernel, bounds = compile_scene(solid.node, "float64"), solid.node.bounds
    cells, _, step = possible_cells(lambda p: kernel.points(*p), bounds.lipschitz, bounds.box, CELLS)
    if not cells.shape[1]:
        return cells
    rng = np.random.default_rng(0)
    for probes in PROBES:
        chosen = rng.integers(cells.shape[1], size=probes)
        points = cells[:, chosen] + step[:, None] * rng.uniform(-0.5, 0.5, (3, probes))
        inside = kernel.points(*points) < 0
        count = min(inside.sum(), (~inside).sum())
        if count >= ENOUGH:
            break
    a, b = points[:, inside][:, :count], points[:, ~inside][:, :count]
    for _ in range(BISECTIONS):
        middle = (a + b) / 2
        inner = kernel.points(*middle) < 0
        a, b = np.where(inner, middle, a), np.where(inner, b, middle)
    return b
