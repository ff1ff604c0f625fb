"""Small circles: their layers have the area of the closed form, and contours do not meet."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.formulas import Node, box, cylinder, difference, menger, repeat, sphere, transform
from fracslice.slicing import Contours, SliceJob, Slicer, Stack, plan_stack

pytestmark = pytest.mark.once

PIXEL = 0.2


def stack_of(root: Node, pixels: float, layer: float) -> Stack:
    return plan_stack(root, SliceJob(size=PIXEL * pixels, layer=layer, pixel=(PIXEL, PIXEL)))


def rods(radius: float, pitch: float, side: int) -> Node:
    """Upright rods beside each other, in pixels: `side` by `side`."""
    return repeat(cylinder(radius=radius, height=2), period=(pitch, pitch, 9), count=(side, side, 1))


def middle(stack: Stack) -> tuple[Contours, float]:
    """The contours of the layer in the middle, and the area of its pixels."""
    return next(Slicer(stack).map(lambda layer: (layer.contours, layer.area), [len(stack.z) // 2]))


def following(contours: Contours) -> np.ndarray:
    """The point after each."""
    after = np.arange(1, len(contours.points) + 1)
    after[contours.starts[1:] - 1] = contours.starts[:-1]
    return after


@pytest.mark.parametrize("radius", [3.1, 4, 5, 6.7, 9, 13, 19.6])
def test_small_circles(radius: float) -> None:
    """Of some pixels, anywhere on the lattice: areas within 0.05 %, those of pixels in sum, points within
    0.001 pixels of the circle and all between them within 0.003.
    """
    root = rods(radius, 44.1373, 6)
    contours, covered = middle(stack_of(root, max(root.bounds.box.size), 0.1))
    assert len(contours) == 36
    np.testing.assert_allclose(contours.areas, np.pi * (radius * PIXEL) ** 2, rtol=5e-4)
    assert covered == pytest.approx(36 * np.pi * (radius * PIXEL) ** 2, rel=2e-4)
    for i in range(36):
        corner = contours[i].min(0) / 2 + contours[i].max(0) / 2
        circle = (contours[i] - 44.1373 * PIXEL * (np.round(corner / 44.1373 / PIXEL + 0.5) - 0.5)) / PIXEL
        between = (circle + np.roll(circle, -1, axis=0)) / 2
        assert abs(np.hypot(*circle.T) - radius).max() < 1.5e-3
        assert abs(np.hypot(*between.T) - radius).max() < 3e-3


@pytest.mark.parametrize(("radius", "off"), [(1, 1e-3), (1.5, 3e-4), (2, 1e-4), (2.5, 1e-4)])
def test_pixels_of_the_smallest_circles(radius: float, off: float) -> None:
    """400 of them in sum, anywhere on the lattice; by parabolas instead of arcs 1.4, 0.28, 0.084, 0.038 % of
    the area would be lost.
    """
    root = rods(radius, 11.1373, 20)
    _, covered = middle(stack_of(root, max(root.bounds.box.size), 0.1))
    assert covered == pytest.approx(400 * np.pi * (radius * PIXEL) ** 2, rel=off)


@pytest.mark.parametrize("moved", [(0.53, 0.53), (0.9, 0.4), (1.3, 0.2)])
def test_thin_crescents(moved: tuple[float, float]) -> None:
    """Around one sample in a strip thinner than a pixel, sides turn like a circle's: as arcs they would give
    the pixel up to 0.21 of its area too much. The areas are those of 32 by 32 points in each pixel.
    """
    hole = transform(cylinder(radius=10.1, height=2), translate=(*moved, 0))
    stack = stack_of(difference(cylinder(radius=11.3, height=2), hole), 22.6, 0.1)
    coverage = next(Slicer(stack).map(lambda layer: layer.coverage, [len(stack.z) // 2]))
    (x0, y0, side, _), (rows, columns) = stack.frame, stack.shape
    x = x0 + side * (np.arange(32 * columns) + 0.5) / 32
    y = y0 + side * (np.arange(32 * rows)[:, None] + 0.5) / 32
    inside = (np.hypot(x, y) < 11.3) & (np.hypot(x - moved[0], y - moved[1]) > 10.1)
    areas = inside.reshape(rows, 32, columns, 32).mean((1, 3))
    assert (coverage / 255 - areas).max() < 0.05


@pytest.mark.parametrize(("pixels", "layer"), [(24, 0.2), (100, 0.2), (256, 0.8)])
def test_small_layers_of_a_ball(pixels: int, layer: float) -> None:
    """Of a radius of three pixels and more."""
    stack = stack_of(sphere(), pixels, layer)
    areas = np.array(list(Slicer(stack).map(lambda layer: (layer.contours.area, layer.area))))
    radius = np.sqrt(1 - stack.z**2) * stack.scale
    some = radius > 3 * PIXEL
    np.testing.assert_allclose(areas[some], np.pi * radius[some, None] ** 2 * [1, 1], rtol=5e-4)


def test_straight_sides_get_nothing_but_corners() -> None:
    """Between crossings of rows and columns of samples: as many as corners."""
    contours, _ = middle(stack_of(transform(box(), rotate=(0, 0, 1, 31)), 60.3, 1.0))
    lattice = contours.points / PIXEL
    beside = np.abs(lattice - np.round(lattice)).min(1) > 1e-6
    assert beside.sum() == 4


@pytest.mark.parametrize("pixels", [97, 128, 150])
def test_contours_do_not_meet(pixels: int) -> None:
    """Rods of some pixels less others, whose rims overlap and nearly touch in all ways, and a sponge less a
    ball.
    """
    web = difference(rods(2.7, 9.1, 12), transform(rods(3.3, 8.3, 12), rotate=(0, 0, 1, 11)))
    sponge = difference(transform(menger(level=3), rotate=(0, 0, 1, 17.3)), sphere(radius=0.7))
    assert meetings(middle(stack_of(web, pixels, 0.1))[0]) == 0
    assert meetings(middle(stack_of(sponge, pixels, 2.6))[0]) == 0


def meetings(contours: Contours) -> int:
    """Pairs of sides that meet, those that follow each other left out."""
    after = following(contours)
    order = np.minimum(contours.points[:, 0], contours.points[after, 0]).argsort()
    a, b = contours.points[order], contours.points[after[order]]
    low, high = np.minimum(a, b), np.maximum(a, b)
    last = np.searchsorted(low[:, 0], high[:, 0], side="right")
    result = 0
    for i, end in enumerate(last.tolist()):
        j = np.arange(i + 1, end)
        beside = (low[j, 1] <= high[i, 1]) & (high[j, 1] >= low[i, 1])
        j = j[beside & (after[order[j]] != order[i]) & (after[order[i]] != order[j])]
        result += int((_parted(a[i], b[i], a[j], b[j]) & _parted(a[j], b[j], a[i], b[i])).sum())
    return result


def _parted(a: np.ndarray, b: np.ndarray, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Whether p and q are on two sides of the line through a and b."""

    def side(r: np.ndarray) -> np.ndarray:
        u, v = b - a, r - a
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    return side(p) * side(q) <= 0
