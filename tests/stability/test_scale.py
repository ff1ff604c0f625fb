"""A scene a million times smaller or larger is the same object: the same bricks, the same mesh."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fracslice.formulas import Node
from fracslice.mesh.contouring import contour
from fracslice.scene import library, read
from fracslice.volume import plan, sample_scene
from tests.examples import stamped

from .scaling import SCALINGS

pytestmark = pytest.mark.once

VOXELS = 40.0
OFTEN = "hybrid", "lattice-cube", "mandelbulb", "menger-tower", "spinning-top"
"""Scenes of every run; the others in a night."""


@pytest.mark.parametrize(("way", "factor"), [("parameters", 2.0**-20), ("transform", 2.0**20)])
@pytest.mark.parametrize("name", stamped(library.names(), OFTEN))
def test_same_bricks(name: str, way: str, factor: float) -> None:
    root = read(library.path(name)).root
    own, other = (plan(r, VOXELS) for r in (root, SCALINGS[way](root, factor)))
    a, b = sample_scene(own), sample_scene(other)
    assert np.array_equal(a.index, b.index) and np.array_equal(a.ijk, b.ijk)
    differ = (a.values < 0) != (b.values < 0)
    assert (np.abs(a.values[differ]) < 1e-5 * own.voxel).all(), "on the surface itself rounding chooses"
    np.testing.assert_allclose(b.values / factor, a.values, rtol=0, atol=1e-4 * own.voxel)
    assert np.isclose(other.voxel, factor * own.voxel, rtol=1e-6), "faces are known to 1e-6"


@pytest.mark.parametrize(
    ("name", "factor"),
    stamped(
        product(("mandelbulb", "quaternion-julia", "menger-ball"), (2.0**-20, 2.0**20)),
        [("quaternion-julia", 2.0**-20), ("menger-ball", 2.0**20)],
    ),
)
def test_same_mesh(name: str, factor: float) -> None:
    root = read(library.path(name)).root
    a, b = (mesh_of(r) for r in (root, SCALINGS["parameters"](root, factor)))
    assert np.array_equal(a[1], b[1])
    voxel = np.ptp(a[0], axis=0).max() / VOXELS
    off = np.abs(b[0] / factor - a[0]).max(axis=1) / voxel
    assert (off > 1e-4).mean() < 1e-3, "where two ways to the surface are equally long, rounding chooses"
    assert off.max() < 1


def mesh_of(root: Node) -> tuple[np.ndarray, np.ndarray]:
    planned = plan(root, VOXELS)
    mesh = contour(planned.root, sample_scene(planned))
    return mesh.vertices, mesh.triangles
