"""The volume of an object by its field, what samples lack of it, and how fine they would have to be."""

from __future__ import annotations

import math

import pytest

from fracslice.formulas import Box, Node, box, difference, julia, menger, sphere, transform, union
from fracslice.volume import extent
from fracslice.volume.amount import VolumeEstimate, amount, finer

pytestmark = pytest.mark.once

BALL = 4 / 3 * math.pi
PLATE = transform(box(size=(2, 2, 0.02)), translate=(0, 0, 0.0123), rotate=(1, 0.3, 0, 10))


def of(root: Node) -> VolumeEstimate:
    return amount(root, [extent(root).outer])


@pytest.mark.parametrize(
    ("root", "volume"),
    [
        (sphere(), BALL),
        (difference(sphere(), sphere(radius=0.9)), BALL * (1 - 0.9**3)),
        (menger(level=3), 8 * (20 / 27) ** 3),
        (julia(c=(0, 0, 0, 0), iterations=12), BALL),
        (PLATE, 0.08),
        (union(sphere(), transform(sphere(radius=0.02), translate=(30, 0, 0))), BALL * (1 + 0.02**3)),
    ],
)
def test_the_volume_of_what_is_known(root, volume):
    result = of(root)
    assert abs(result.volume - volume) < 4 * result.error and result.error < 0.01 * volume


def test_the_volume_is_always_the_same_and_that_of_its_parts():
    one, again = of(sphere()), of(sphere())
    halves = amount(sphere(), [Box((-1, -1, -1), (1, 1, 0)), Box((-1, -1, 0), (1, 1, 1))])
    assert one.volume == again.volume
    assert abs(halves.volume - BALL) < 4 * halves.error


def test_a_difference_is_reported_where_it_is_sure_and_a_hundredth():
    result = VolumeEstimate(2.0, 0.01, of(sphere()).inside)
    assert result.off(1.9) == pytest.approx(-0.05) and result.off(2.2) == pytest.approx(0.1)
    assert result.off(1.985) == result.off(2.015) == VolumeEstimate(2.0, 0.05, result.inside).off(1.9) == 0


@pytest.mark.parametrize(("spacing", "times"), [(0.1, 8), (0.039, 4), (2.0, None)])
def test_samples_must_be_as_near_as_the_plate_is_thick(spacing, times):
    assert finer(PLATE, of(PLATE), -0.5, (-1.05, -1.05, -1.05), (spacing,) * 3) == times


def test_facets_need_finer_samples_too():
    ball = sphere()
    assert finer(ball, of(ball), -0.03, (-1.5, -1.5, -1.5), (0.1,) * 3) == 2
