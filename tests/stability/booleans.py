"""Random unions, intersections and differences of models and shapes, beside manifold3d's of fine meshes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import manifold3d
import numpy as np
from manifold3d import CrossSection, Manifold
from scipy.spatial.transform import Rotation

from fracslice import Mesh, from_trimesh, make_mesh
from fracslice.fields.devices import reference
from fracslice.formulas import Node, box, cylinder, difference, intersection, sphere, torus, transform, union

FINE, RESOLUTIONS, WITHIN = 256, (48, 96, 192), 0.005
"""Sides of the circles of meshes, voxels along the longest side, and greatest error of a volume: thin
wedges need small ones.
"""

LEAST = 0.1
"""Least share of the smaller volume that the result must have: of less, samples show too little."""

SIDE = 96
"""Samples along each side of the box of a smooth union, which is no operation on meshes."""


class Pair(NamedTuple):
    """A shape, and the same as a mesh."""

    node: Node
    solid: Manifold


def of_model(solid: Manifold) -> Pair:
    made = solid.to_mesh()
    return Pair(from_trimesh(Mesh(np.array(made.vert_properties)[:, :3], np.array(made.tri_verts))), solid)


def hull(rng: np.random.Generator) -> Pair:
    return of_model(Manifold.hull_points(rng.normal(size=(rng.integers(6, 30), 3)) / 2))


def carved(rng: np.random.Generator) -> Pair:
    block, hole = Manifold.cube((1.4, 1.1, 1.2), True), Manifold.cylinder(3, 0.35, 0.25, 12, True)
    return of_model(block - hole.rotate(tuple(rng.uniform(0, 90, 3))))


def star(rng: np.random.Generator) -> Pair:
    angle = np.linspace(0, 2 * np.pi, 2 * int(rng.integers(3, 7)), endpoint=False)
    far = np.where(np.arange(len(angle)) % 2, 0.45, 0.9)
    outline = np.column_stack([far * np.cos(angle), far * np.sin(angle)])
    return of_model(Manifold.extrude(CrossSection([outline]), rng.uniform(0.5, 1)))


def ball(rng: np.random.Generator) -> Pair:
    radius = rng.uniform(0.5, 0.9)
    return Pair(sphere(radius), Manifold.sphere(radius, FINE))


def block(rng: np.random.Generator) -> Pair:
    size = tuple(rng.uniform(0.5, 1.5, 3).tolist())
    return Pair(box(size), Manifold.cube(size, True))


def rod(rng: np.random.Generator) -> Pair:
    radius, height = rng.uniform(0.3, 0.7), rng.uniform(0.6, 1.6)
    return Pair(cylinder(radius, height), Manifold.cylinder(height, radius, radius, FINE, True))


def ring(rng: np.random.Generator) -> Pair:
    radius, tube = rng.uniform(0.5, 0.8), rng.uniform(0.2, 0.35)
    circle = CrossSection.circle(tube, FINE // 4).translate((radius, 0))
    return Pair(torus(radius, tube), Manifold.revolve(circle, FINE))


MODELS, SHAPES = (hull, carved, star), (ball, block, rod, ring)
Draw = Callable[[np.random.Generator], Pair]


def placed(draw: Draw, rng: np.random.Generator) -> Pair:
    """A shape, turned and moved at random."""
    pair, turn, move = draw(rng), rng.normal(size=3), rng.uniform(-0.4, 0.4, 3)
    degrees = float(rng.uniform(0, 180))
    matrix = Rotation.from_rotvec(np.radians(degrees) * turn / np.linalg.norm(turn)).as_matrix()
    node = transform(pair.node, rotate=(*turn.tolist(), degrees), translate=tuple(move.tolist()))
    return Pair(node, pair.solid.transform(np.column_stack([matrix, move])))


def drawn(seed: int) -> tuple[Node, float]:
    """A model and a shape, in any order, or two models, under an operation; and the volume."""
    rng = np.random.default_rng(seed)
    for _ in range(100):
        draws = [MODELS[rng.integers(3)], (MODELS + SHAPES)[rng.integers(7)]]
        one, other = (placed(draws[k], rng) for k in rng.permutation(2))
        kind, least = int(rng.integers(4)), LEAST * min(one.solid.volume(), other.solid.volume())
        if kind == 3:
            smooth = union(one.node, other.node, smooth=0.1)
            return smooth, sampled(smooth)
        of = (union, intersection, difference)[kind](one.node, other.node)
        solid: manifold3d.Manifold = (
            one.solid + other.solid,
            one.solid ^ other.solid,
            one.solid - other.solid,
        )[kind]
        if solid.volume() > least:
            return of, solid.volume()
    raise AssertionError("no pair overlaps")


def sampled(root: Node) -> float:
    """Volume of a field by samples, with the share of cells that its surface passes by its distance."""
    field, extent = reference(root), root.bounds.box
    low, size = np.array(extent.lo), np.array(extent.size)
    cells = np.stack(np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 3, indexing="ij")).reshape(3, -1)
    values = field(*(low[:, None] + size[:, None] * cells))
    edge = np.cbrt(np.prod(size)) / SIDE
    return float(np.clip(0.5 - values / edge, 0, 1).mean() * np.prod(size))


def faults(seed: int) -> tuple[str, ...]:
    """What is wrong with the meshes of a random operation; its volume may need the finest one."""
    root, volume = drawn(seed)
    for resolution in RESOLUTIONS:
        made = make_mesh(root, resolution=resolution, threads=1)
        off = made.volume / volume - 1
        if made.report.problems or abs(off) < WITHIN:
            return made.report.problems
    return (f"volume off by {off:.2%}",)
