"""A millimetre is a millimetre: walls, gaps, bases and rafts measured on the layers."""

from __future__ import annotations

import math

import pytest

from fracslice.checks.layer_checks import PrintReport, check_layers
from fracslice.checks.problems import Limits
from fracslice.errors import VolumeError
from fracslice.formulas import Node, box, cone, sphere, transform, union
from fracslice.scene import Print
from fracslice.slicing import SliceJob, plan_stack

pytestmark = pytest.mark.once


def checked(root: Node, **printing: float | str) -> PrintReport:
    how = Print(**printing)  # type: ignore[arg-type]
    coarse = Limits(wall=1, floor=1)  # the solid is sampled as finely as its limits ask
    job = SliceJob(size=20, layer=0.2, pixel=(0.2, 0.2), printing=how)
    return check_layers(plan_stack(root, job), coarse)


@pytest.mark.parametrize(
    ("root", "full", "left"),
    [
        pytest.param(box(), 8000, 16**3, id="cube"),
        pytest.param(
            sphere(), 4 / 3 * math.pi * 1000, 4 / 3 * math.pi * 512, id="ball", marks=pytest.mark.nightly
        ),
    ],
)
def test_hollow(root: Node, full: float, left: float) -> None:
    report = checked(root, hollow=2.0, drain=0.0)
    assert report.volume == pytest.approx(full - left, rel=3e-3)
    assert len(report.cavities) == 1
    assert report.cavities[0].volume == pytest.approx(left, rel=0.01)


@pytest.mark.nightly
def test_a_formula_that_is_no_distance_is_hollowed_in_mm() -> None:
    """A box squeezed to a third in x: its field grows three times as slowly there."""
    squeezed = transform(box(size=(3, 1, 1)), scale=(1 / 3, 1, 1))
    assert checked(squeezed, hollow=2.0, drain=0.0).volume == pytest.approx(8000 - 16**3, rel=5e-3)


def test_drains_let_the_resin_out() -> None:
    report = checked(box(), hollow=2.0, drain=3.0)
    assert not report.cavities
    assert not report.traps
    assert len(report.bodies) == 1
    assert not report.cups or report.cups[0].volume < 0.01 * 16**3


@pytest.mark.nightly
def test_walls_too_thick_to_leave_a_hollow() -> None:
    with pytest.raises(VolumeError, match="leave nothing"):
        checked(box(), hollow=11.0)


def test_the_largest_body_stays() -> None:
    loose = union(box(), transform(box(size=(0.3, 0.3, 0.3)), translate=(0.8, 0, 0)))
    assert len(checked(loose).bodies) == 2
    report = checked(loose, keep="largest")
    assert len(report.bodies) == 1
    assert report.size == pytest.approx((20, 20, 20), abs=0.1)
    assert report.volume == pytest.approx(8000, rel=0.01)


def test_gaps_are_closed_up_to_their_width() -> None:
    """Two halves, a millimetre apart."""
    half = box(size=(0.475, 1, 1))
    halves = union(transform(half, translate=(-0.2625, 0, 0)), transform(half, translate=(0.2625, 0, 0)))
    gap = 0.05 * 20
    assert len(checked(halves, gap=0.8 * gap).bodies) == 2
    report = checked(halves, gap=1.5 * gap)
    assert len(report.bodies) == 1
    assert report.volume == pytest.approx(8000, rel=0.01)


def test_a_base_that_takes_the_widest_part_makes_layers_narrower() -> None:
    """A cone's foot: the size is that of the layers, and the raft is a tenth larger on each side."""
    cut = checked(cone(radius=1, height=2), base=10.0)
    assert cut.size == pytest.approx((10, 10, 10), abs=0.05)
    assert checked(cone(radius=1, height=2), base=10.0, raft=1.0).size[:2] == pytest.approx((12, 12), abs=0.1)


def test_base_and_raft() -> None:
    flat = checked(sphere(), base=2.0)
    assert flat.size[2] == pytest.approx(18, abs=0.05)
    cap = math.pi * 4 * (30 - 2) / 3
    assert flat.volume == pytest.approx(4 / 3 * math.pi * 1000 - cap, rel=5e-3)
    raft = checked(sphere(), raft=1.0)
    assert raft.size == pytest.approx((24, 24, 20.5), abs=0.1)
    assert raft.volume == pytest.approx(4 / 3 * math.pi * 1000 + 576, rel=5e-3)
