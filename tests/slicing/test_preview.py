"""Previews show layers as they are: in proportion, the right way up."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image

from fracslice.formulas import box, difference, transform, union
from fracslice.records import Print
from fracslice.slicing import SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.feature_graph import MARKS, FeatureBox
from fracslice.slicing.raster import HELD, animation, contact_sheet, elevations, page, thumbnail, worst_layers

pytestmark = pytest.mark.once

PLATE = union(box(size=(4, 2, 0.5)), transform(box(size=(1, 1, 1)), translate=(1.5, 0.5, 0.5)))
"""Its tower is at the right, at the back."""


@pytest.mark.parametrize("pixel", [(0.1, 0.1), (0.1, 0.2), (0.2, 0.1), (0.005, 0.01)])
def test_thumbnails_have_the_proportions_of_the_object(pixel: tuple[float, float]) -> None:
    stack = plan_stack(PLATE, SliceJob(size=4, layer=0.25, pixel=pixel))
    low, *_, high = Slicer(stack).map(thumbnail)
    rows, columns = np.nonzero(np.asarray(low)[..., 0] > 200)
    assert max(low.size) <= 200
    assert np.ptp(columns) / np.ptp(rows) == pytest.approx(2, rel=0.12)
    rows, columns = np.nonzero(np.asarray(high)[..., 0] > 200)
    assert rows.max() < high.height / 2 + 1 and columns.min() > high.width / 2


@pytest.mark.parametrize("write", [contact_sheet, animation, lambda *of: worst_layers(of[0], [0], of[1])])
def test_one_layer_is_a_preview(write: Callable[..., None]) -> None:
    file = io.BytesIO()
    write(plan_stack(box(size=(4, 2, 0.2)), SliceJob(size=4, layer=0.5, pixel=(0.1, 0.2))), file)
    with Image.open(file) as picture:
        picture.load()


def seen(stack: Stack, marks: list[FeatureBox]) -> np.ndarray:
    file = io.BytesIO()
    elevations(stack, marks, file)
    with Image.open(file) as picture:
        return np.asarray(picture.convert("RGB"), int)


def test_elevations_are_seen_through() -> None:
    hollow = difference(box(size=(4, 2, 4)), transform(box(size=(1, 2.2, 1)), translate=(-1, 0, 1)))
    stack = plan_stack(hollow, SliceJob(size=4, layer=0.1, pixel=0.05))
    picture = seen(stack, [])
    front, right = widths(stack)
    assert picture.shape == (480, front + right + 8, 3)
    assert (
        picture[120, front // 2 - 120].min() == 255
    )  # a hole from the front to the back, left of the middle
    assert picture[360, front // 2 - 120].max() < 255
    beside = picture[:, front + 8 + right // 2].min(1)
    assert 255 > beside[120] > beside[360]  # from the right, less is behind each other


def widths(stack: Stack) -> tuple[int, int]:
    """Pixels across both elevations of a stack that is 4 mm high."""
    along, across = stack.shape
    return round(120 * stack.pixel[0] * across), round(120 * stack.pixel[1] * along)


def test_boxes_of_elevations_are_where_features_are() -> None:
    stack = plan_stack(box(size=(4, 2, 4)), SliceJob(size=4, layer=0.1, pixel=0.05))
    marks = [FeatureBox("island", (0.5, -0.5, 1.0), (1.5, 0.5, 2.0))]
    rows, columns = np.nonzero((seen(stack, marks) == MARKS["island"]).all(2))
    front, right = widths(stack)
    assert (rows.min(), rows.max()) == pytest.approx((240, 360), abs=2)
    own, other = columns[columns < front] - front / 2, columns[columns > front] - front - 8 - right / 2
    assert (own.min(), own.max()) == pytest.approx((60, 180), abs=2)
    assert (other.min(), other.max()) == pytest.approx((-60, 60), abs=2)


def test_supports_of_elevations_have_a_colour() -> None:
    job = SliceJob(size=4, layer=0.1, pixel=0.05, printing=Print(supports="medium"))
    held = (seen(plan_stack(box(size=(4, 2, 4)), job), []) == HELD).all(2)
    assert held[-40:].mean() > 5 * held[:200].mean() == 0


def test_a_page_counts_its_boxes() -> None:
    marks = [FeatureBox("sealed cavity", (0, 0, 0), (1, 1, 1))] * 2 + [
        FeatureBox("island", (0, 0, 0), (1, 1, 1))
    ]
    text = page("a", [], "would print", [], np.ones(1), np.ones(1), b"", b"", marks).decode()
    assert "Boxes: " in text and ">1 island</span>, <span" in text and ">2 sealed cavities</span>." in text
    assert f"rgb{MARKS['island']}" in text
