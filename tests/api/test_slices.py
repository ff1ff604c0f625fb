"""Layers as arrays and polygons."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from fracslice import Slices, box, cylinder, slice_layers, sphere
from fracslice.errors import SceneError, SliceError
from fracslice.scene import scene

SHAPE = cylinder(3, 2) - (cylinder(1, 4) + (1, 0, 0))
RING = np.pi * (3**2 - 1**2)


@pytest.fixture(scope="module")
def slices() -> Slices:
    return slice_layers(SHAPE, layer=0.1, pixel=0.1)


def test_layers_are_arrays(slices: Slices) -> None:
    images = list(slices)
    assert len(images) == len(slices) == 20
    assert {image.dtype.name for image in images} == {"uint8"}
    assert np.array_equal(np.stack(slices), images)
    assert images[3].sum() / 255 * 0.1**2 == pytest.approx(RING, rel=1e-3)
    assert not images[0].flags.writeable and not slices.contours[0].points.flags.writeable
    assert slices.tops[-1] == pytest.approx(2) and slices.heights.sum() == pytest.approx(2)
    assert slices.size == pytest.approx((6, 6, 2)) and slices.pixel == (0.1, 0.1)


def test_layers_are_indexed_as_sequences_are(slices: Slices) -> None:
    images = list(slices)
    assert np.array_equal(slices[-1], images[-1]) and np.array_equal(slices[7], images[7])
    part = slices[4:19:5]
    assert isinstance(part, Slices) and np.array_equal(part, images[4:19:5])
    assert np.array_equal(part.tops, slices.tops[4:19:5])
    assert np.array_equal(slices[::-6], images[::-6])
    assert list(slices[5:5]) == []
    with pytest.raises(IndexError):
        slices[20]


def test_layers_are_pickled_and_copied(slices: Slices) -> None:
    for again in (pickle.loads(pickle.dumps(slices[4:6])), copy.deepcopy(slices[4:6])):
        assert isinstance(again, Slices) and np.array_equal(again, slices[4:6])
    assert repr(slices.contours[3]).startswith("<Contours: 2 polygons, 25.1")
    assert [p.area for p in pickle.loads(pickle.dumps(slices.polygons[4:6]))] == pytest.approx(
        [RING] * 2, 1e-3
    )


def test_nothing_is_computed_before_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from fracslice.slicing import Slicer

    asked: list[object] = []
    mapped = Slicer.map
    monkeypatch.setattr(
        Slicer, "map", lambda self, make, layers: asked.append(layers) or mapped(self, make, layers)
    )
    slices = slice_layers(SHAPE, layer=0.1, pixel=0.1)
    some, polygons = slices[2:9], slices.polygons
    assert not asked
    assert some[3] is not None and polygons[4] is not None
    assert asked == [range(5, 6), range(4, 5)]


def test_layers_are_polygons(slices: Slices) -> None:
    pytest.importorskip("shapely")
    for polygon in slices.polygons[::5]:
        assert polygon.is_valid and len(polygon.geoms) == 1 and len(polygon.geoms[0].interiors) == 1
        assert polygon.area == pytest.approx(RING, rel=1e-3)
        assert polygon.bounds == pytest.approx((-3, -3, 3, 3), abs=1e-2)
        assert polygon.contains(_point(-2, 0)) and not polygon.contains(_point(1, 0))


def _point(x: float, y: float):
    from shapely import Point

    return Point(x, y)


def test_an_island_within_a_hole_is_a_polygon_of_its_own() -> None:
    pytest.importorskip("shapely")
    shape = cylinder(3, 1) - cylinder(2, 2) | cylinder(1, 1) - cylinder(0.5, 2)
    polygon = slice_layers(shape, layer=0.5, pixel=0.05).polygons[0]
    assert [len(p.interiors) for p in polygon.geoms] == [1, 1]
    assert polygon.is_valid and polygon.area == pytest.approx(np.pi * (9 - 4 + 1 - 0.25), rel=1e-3)


def test_without_shapely_a_line_says_so(monkeypatch: pytest.MonkeyPatch, slices: Slices) -> None:
    import importlib.util

    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(SliceError, match="polygons need shapely, which is not installed: pip install"):
        _ = slices.polygons
    assert slices.contours[0].area == pytest.approx(RING, rel=1e-3)


def test_layers_have_sizes_and_a_range_of_heights() -> None:
    by_scene = slice_layers(scene(sphere(), size="4mm"), layer=0.5, pixel="100um")
    assert by_scene.size == pytest.approx((4, 4, 4), rel=1e-4)
    by_size = slice_layers(sphere(), layer="0.5mm", pixel=(0.1, 0.1), size="4mm")
    assert np.array_equal(np.stack(by_scene), np.stack(by_size))
    adaptive = slice_layers(sphere(2), layer=("0.05mm", 0.4), pixel=0.1)
    assert adaptive.heights.min() < 0.15 and adaptive.heights.max() > 0.3


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"layers": 0.1}, TypeError, r"slice_layers\(\) has no argument 'layers'; did you mean layer\?"),
        ({"layer": "thin"}, SceneError, "layer='thin': expected a length"),
        ({"layer": [0.1]}, SceneError, r"layer=\[0.1\]: expected a length"),
        ({"pixel": 0}, SceneError, "pixel=0: expected"),
        ({"layer": 3}, SliceError, "a layer of 3 mm is as high as the object"),
    ],
)
def test_values_that_cannot_be_are_named(options: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        slice_layers(box(), **options)


def test_progress_is_reported() -> None:
    reported: list[tuple[str, float]] = []
    slices = slice_layers(box(), layer=0.1, progress=lambda stage, share: reported.append((stage, share)))
    list(slices)
    assert reported[-1] == ("slicing", 1.0)
