"""Layers of supports, cut beam by beam, beside samples of the field of the same beams."""

from __future__ import annotations

import math
import zlib

import numpy as np
import pytest

from fracslice._slices import Encoding, Slab
from fracslice.errors import SliceError
from fracslice.formulas import Node, capsule, intersection, plane, union
from fracslice.slicing.layers import BeamSampler, FieldSampler, Sampler
from fracslice.volume import Pillars

pytestmark = pytest.mark.once

SHAPE, FRAME, FLOOR = (97, 129), np.array([-3.2, -2.4, 0.05, 0.05]), -1.4
NO_RAFT = np.empty((0, 4))


def beams(seed: int) -> np.ndarray:
    """Round cones of all directions, some of which are balls, [n, 2, 4]."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform(-1, 1, (12, 2, 3)) * [2.4, 1.7, 1.5]
    radii = rng.uniform(0.1, 0.5, (12, 2, 1)) * rng.choice([0.3, 1.0], (12, 1, 1))
    ends[:2, 1] = ends[:2, 0] + 0.1 * (ends[:2, 1] - ends[:2, 0])  # within the larger ball
    return np.concatenate([ends, radii], 2)


def field_of(balls: np.ndarray) -> Node:
    parts = (capsule(a[:3], b[:3], a[3], b[3]) for a, b in balls.tolist())
    return intersection(union(*parts), plane(normal=(0, 0, -1), offset=-FLOOR))


def painted(sampler: Sampler, z: np.ndarray) -> tuple[list[np.ndarray], list[float], Slab]:
    """Pictures of layers, their areas in pixels, and the slab."""
    slab, pictures, areas = sampler.slab(z), [], []
    for layer in range(len(z)):
        sampler.sample(slab, layer)
        pictures.append(np.zeros((SHAPE[0] - 1, SHAPE[1] - 1), np.uint8))
        areas.append(slab.paint(layer, pictures[-1])[0])
    return pictures, areas, slab


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_beams_are_cut_where_their_field_is_zero(seed: int) -> None:
    balls, z = beams(seed), np.linspace(-1.7, 1.6, 11)
    root = field_of(balls)
    cut, areas, _ = painted(BeamSampler(Pillars(balls, FLOOR, NO_RAFT), FRAME, SHAPE), z)
    sampled, others, _ = painted(FieldSampler(root.kernel(), root, root.bounds, FRAME, SHAPE), z)
    assert not cut[0].any() and sum(picture.any() for picture in cut) > 6
    off = np.abs(np.array(cut, int) - np.array(sampled))
    assert int((off > 24).sum()) < 0.03 * int(
        ((np.array(cut) > 0) & (np.array(cut) < 255)).sum()
    )  # at corners
    np.testing.assert_allclose(areas, others, rtol=4e-3, atol=1)


def test_a_ball_has_the_area_of_a_circle() -> None:
    ball = np.array([[[0.01, 0.02, 0, 1.5]] * 2])
    _, (area,), slab = painted(BeamSampler(Pillars(ball, -9.0, NO_RAFT), FRAME, SHAPE), np.array([0.5]))
    assert area * 0.05**2 == pytest.approx(math.pi * (1.5**2 - 0.5**2), rel=3e-4)
    rows, runs, same, _ = slab.runs(0, (SHAPE[0] - 1, SHAPE[1] - 1))
    assert same == area and len(rows) == SHAPE[0] and (np.diff(runs) > 0).all()


def test_a_raft_is_the_cut_of_its_half_spaces() -> None:
    raft = np.array(
        [(0, 0, 1, 0.0), (0, 0, -1, 1.0), (1, 0, -1, 1.0), (-1, 0, -1, 1), (0, 1, -1, 1), (0, -1, -1, 0.5)]
    )
    _, areas, _ = painted(
        BeamSampler(Pillars(np.empty((0, 2, 4)), 0.0, raft), FRAME, SHAPE), np.array([-1.2, -0.8, -0.3, 0.2])
    )
    area = 2 * 0.7 * (0.7 + 0.2)  # less a quarter of a pixel at each corner
    np.testing.assert_allclose(np.array(areas) * 0.05**2, [0, 0, area, 0], atol=0.05**2 + 1e-6)


def test_beams_beyond_the_border_are_refused() -> None:
    far = np.array([[[3.2, 0, 0, 1.0]] * 2])
    with pytest.raises(SliceError, match="reach the border"):
        painted(BeamSampler(Pillars(far, -9.0, NO_RAFT), FRAME, SHAPE), np.array([0.0]))


def test_two_slabs_are_shown_with_the_greater_part_of_each_pixel() -> None:
    view = ((100, 140), False, False, (0, 0), (SHAPE[0] - 1, SHAPE[1] - 1), bytes(range(256)), Encoding.PNG)
    first, second = (BeamSampler(Pillars(beams(seed), -9.0, NO_RAFT), FRAME, SHAPE) for seed in (3, 4))
    z = np.array([0.1])
    (own,), _, slab = painted(first, z)
    (other,), _, beside = painted(second, z)
    both = np.maximum(own, other)
    data, area, cut = slab.picture(0, *view, [beside])
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(100, 141)[:, 1:]
    assert (rows[::-1][: len(both), : both.shape[1]] == both).all()
    assert area == pytest.approx(both.sum() / 255, abs=0.5) and cut >= int(((both > 0) & (both < 255)).sum())
