"""Previews show layers as they are: in proportion, the right way up."""

from __future__ import annotations

import io
from collections.abc import Callable

import numpy as np
import pytest
from PIL import Image

from fracslice.formulas import box, transform, union
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.raster import animation, contact_sheet, thumbnail, worst_layers

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
