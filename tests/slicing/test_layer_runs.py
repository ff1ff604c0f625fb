"""What is computed on layers as runs of pixels, against the same on pictures."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy import ndimage

from fracslice import _slices
from fracslice.slicing.feature_graph import Runs, _largest_near, layer_components, overlaps

from .test_checks import runs_of

pytestmark = pytest.mark.once

RNG = np.random.default_rng(7)
EIGHT = np.ones((3, 3))


def image_of(runs: Runs) -> np.ndarray:
    image = np.zeros((runs.height, runs.width), bool)
    for y in range(runs.height):
        for r in range(runs.rows[y], runs.rows[y + 1]):
            image[y, runs.begin[r] : runs.end[r]] = True
    return image


def pictures() -> list[np.ndarray]:
    """Noise of several densities, blobs, and plain pictures."""
    noise = [RNG.random((17, 23)) < share for share in (0.1, 0.4, 0.6, 0.9)]
    blobs = [ndimage.gaussian_filter(RNG.random((40, 31)), s) > 0.5 for s in (1.0, 2.5)]
    return [*noise, *blobs, np.zeros((5, 9), bool), np.ones((5, 9), bool), np.eye(8, dtype=bool)]


PICTURES = pictures()


@pytest.mark.parametrize("image", PICTURES)
def test_components_are_those_of_the_picture(image: np.ndarray) -> None:
    for found, pixels, around in zip(
        layer_components(runs_of(image)), (image, ~image), (EIGHT, None), strict=True
    ):
        labels, count = ndimage.label(pixels, around)
        assert len(found) == count
        np.testing.assert_array_equal(image_of(found.runs), pixels)
        for k in range(count):
            rows, columns = np.nonzero(labels == k + 1)  # both are numbered by their first pixels
            assert found.nodes.area[k] == len(rows)
            np.testing.assert_array_equal(
                found.nodes.middle[k], (np.mean(columns + 0.5), np.mean(rows + 0.5))
            )
            border = np.isin(rows, (0, image.shape[0] - 1)) | np.isin(columns, (0, image.shape[1] - 1))
            assert found.nodes.open[k] == border.any()


def test_overlaps_are_the_pairs_that_share_a_pixel() -> None:
    for share in (0.1, 0.4, 0.7):
        below, above = RNG.random((2, 19, 26)) < share
        pairs = ndimage.label(below, EIGHT)[0] - 1, ndimage.label(above, EIGHT)[0] - 1
        both = below & above
        expected = np.unique(np.stack([pairs[0][both], pairs[1][both]], 1), axis=0)
        solid = [layer_components(runs_of(image))[0] for image in (below, above)]
        np.testing.assert_array_equal(overlaps(*solid), expected)


@pytest.mark.parametrize("reach", [1.0, 1.5, 2.9])
def test_pixels_far_from_the_layer_below_are_unsupported(reach: float) -> None:
    for share in (0.02, 0.1, 0.5):
        below, above = RNG.random((21, 24)) < share, RNG.random((21, 24)) < 0.5
        away = ndimage.distance_transform_edt(~below)
        found = Runs(*_slices.unsupported(runs_of(below), runs_of(above), reach), 24)
        np.testing.assert_array_equal(image_of(found), above & (away > reach))


@pytest.mark.parametrize("image", PICTURES)
@pytest.mark.parametrize("times", [1, 3, 4])
def test_pixels_are_counted_in_coarse_ones(image: np.ndarray, times: int) -> None:
    rest = [(0, -n % times) for n in image.shape]
    blocks = np.pad(image, rest).reshape(
        -(-image.shape[0] // times), times, -(-image.shape[1] // times), times
    )
    np.testing.assert_array_equal(_slices.count_pixels(runs_of(image), times), blocks.sum((1, 3)))


def narrow(image: np.ndarray, longest: int) -> np.ndarray:
    """Pixels of runs along a row of at most so many."""
    result = np.zeros(image.shape, bool)
    for y, row in enumerate(image):
        ends = np.flatnonzero(np.diff(row.astype(int), prepend=0, append=0))
        for begin, end in zip(ends[::2], ends[1::2], strict=True):
            result[y, begin:end] = end - begin <= longest
    return result


@pytest.mark.parametrize("image", PICTURES)
@pytest.mark.parametrize("gaps", [False, True])
def test_narrow_runs_are_marked(image: np.ndarray, gaps: bool) -> None:
    along, up = 3, 2
    rows, columns = narrow(image != gaps, along), narrow((image != gaps).T, up).T
    if gaps:  # before the first run of a row and behind the last, and below and above those of a column
        for lines, marks in ((image, rows), (image.T, columns.T)):
            for line, mark in zip(lines, marks, strict=True):
                solid = np.flatnonzero(line)
                low, high = (solid[0], solid[-1]) if len(solid) else (len(line), -1)
                mark[:low], mark[high + 1 :] = False, False
    else:  # columns that end at the upper border have no end
        columns &= np.logical_or.accumulate(~image[::-1])[::-1]
    np.testing.assert_array_equal(_slices.narrow_pixels(runs_of(image), gaps, 1, (along, up)), rows | columns)


def test_a_picture_of_a_part_of_a_layer() -> None:
    image = RNG.random((12, 15)) < 0.5
    large = np.pad(image, 40)
    for top, left in ((0, 0), (-3, -4), (5, 9), (-20, 2), (13, 3), (2, 30)):
        shown = _slices.painted(runs_of(image), (top, left), (9, 11))
        np.testing.assert_array_equal(shown, large[40 + top : 49 + top, 40 + left : 51 + left])


@pytest.mark.parametrize("pixel", [(1.0, 1.0), (0.05, 0.05), (0.019, 0.024)])
def test_distances_are_those_of_scipy_to_the_last_bit(pixel: tuple[float, float]) -> None:
    for image in [*PICTURES[:7], RNG.random((60, 70)) < 0.99]:
        if not image.all():
            expected = ndimage.distance_transform_edt(image, sampling=pixel[::-1])
            np.testing.assert_array_equal(_slices.distances(image, pixel), expected)
    assert np.isinf(_slices.distances(np.ones((3, 4), bool), pixel)).all()


def test_the_largest_of_nine_pixels() -> None:
    image = RNG.random((13, 17))
    np.testing.assert_array_equal(_largest_near(image), ndimage.maximum_filter(image, 3))


@pytest.mark.parametrize("image", PICTURES)
def test_pixels_that_hang_together(image: np.ndarray) -> None:
    held = image & (RNG.random(image.shape) < 0.02)
    labels, _ = ndimage.label(image, EIGHT)
    expected = image & np.isin(labels, labels[held])
    np.testing.assert_array_equal(_slices.connected_to(image, held), expected)


@pytest.mark.parametrize("step", [(0, 1), (1, 0), (1, 1), (1, -1)])
@pytest.mark.parametrize("image", PICTURES[:6])
def test_spans_between_held_pixels(image: np.ndarray, step: tuple[int, int]) -> None:
    held = image & (RNG.random(image.shape) < 0.3)

    def steps(y: int, x: int, dy: int, dx: int) -> float:
        for n in range(99):
            v, u = y + n * dy, x + n * dx
            if not (0 <= v < image.shape[0] and 0 <= u < image.shape[1] and image[v, u]):
                break
            if held[v, u]:
                return n
        return np.inf

    expected = [
        [steps(y, x, *step) + steps(y, x, -step[0], -step[1]) for x in range(image.shape[1])]
        for y in range(image.shape[0])
    ]
    np.testing.assert_array_equal(_slices.spans(image, held, step), np.array(expected, np.float32))


def test_grey_dilation_is_the_largest_of_the_cones() -> None:
    image = np.where(RNG.random((14, 16)) < 0.6, 255, RNG.integers(0, 256, (14, 16))).astype(np.uint8)
    cone = 255 * (1.7 - np.hypot(*np.mgrid[-3:4, -3:4]))
    expected = image.astype(float)
    for y, x in zip(*np.nonzero(image), strict=True):
        for v, u in product(range(max(y - 3, 0), min(y + 4, 14)), range(max(x - 3, 0), min(x + 4, 16))):
            grown = min(image[y, x] + cone[v - y + 3, u - x + 3], 255.0)
            expected[v, u] = max(expected[v, u], np.floor(grown + 0.5))
    np.testing.assert_array_equal(_slices.dilated(image, cone), expected)


def layered(count: int, layers: int, edges: int) -> tuple[np.ndarray, np.ndarray]:
    """Layers of nodes in order, and pairs (below, above) of adjacent layers, by layers."""
    layer = np.sort(RNG.integers(0, layers, count))
    pairs = RNG.integers(0, count, (edges, 2))
    pairs = pairs[layer[pairs[:, 1]] == layer[pairs[:, 0]] + 1]
    return layer, pairs[np.argsort(layer[pairs[:, 0]], kind="stable")]


def reachable(edges: np.ndarray, starts: np.ndarray) -> set[int]:
    """Nodes that edges, either way, connect with some."""
    found = set(starts.tolist())
    while True:
        more = {b for a, b in [*edges.tolist(), *edges[:, ::-1].tolist()] if a in found} - found
        if not more:
            return found
        found |= more


def test_nodes_that_no_free_one_is_connected_to_so_far() -> None:
    for _ in range(5):
        layer, edges = layered(40, 8, 300)
        free = RNG.random(len(layer)) < 0.1
        later = layer[edges].max(1)
        closed = _slices.closed_nodes(edges, later, layer, free)
        for i in range(len(layer)):
            out = reachable(edges[later <= layer[i]], np.flatnonzero(free))
            assert closed[i] == (i not in out)


def test_nodes_that_grow_from_others() -> None:
    layer, edges = layered(40, 6, 200)
    roots = np.flatnonzero(layer == 0)[:2]
    expected = np.zeros(40, bool)
    expected[roots] = True
    for below, above in edges:
        expected[above] |= expected[below]
    np.testing.assert_array_equal(_slices.held_nodes(edges, roots, 40), expected)


def test_the_weakest_cut_is_the_largest_ratio_of_what_hangs_on_it() -> None:
    """All cuts, one by one, with the components above each."""
    for _ in range(20):
        layer, edges = layered(30, 7, 120)
        area = RNG.integers(1, 50, 30).astype(float)
        firm = np.where(RNG.random(30) < 0.8, area, 0)
        starts = np.searchsorted(layer[edges[:, 0]], np.arange(8))
        best, foot, least = (0.0, 0.0, 0, -1), 3.0, 5.0
        for cut in range(6, -1, -1):
            below, above = edges[starts[cut] : starts[cut + 1]], edges[starts[cut + 1] :]
            for node in below[:, 1]:
                part = reachable(above, np.array([node]))
                touching = np.unique([a for a, b in below if b in part])
                contact, carried = firm[touching].sum(), max(area[list(part)])
                ratio = best[1] / best[0] if best[0] else 0.0
                if contact and carried >= (least if cut else foot) and carried >= ratio * contact:
                    first = next(a for a, b in below if b in part and firm[a] == firm[touching].max())
                    best = contact, carried, cut, first
        assert _slices.weakest_cut(area, firm, edges, starts, foot, least) == best


def test_runs_that_are_none_are_refused() -> None:
    good = runs_of(np.eye(4))
    for bad in (
        Runs(good.rows[:-1], good.begin, good.end, 4),
        Runs(good.rows, good.begin, good.end, 3),
        Runs(good.rows, good.end, good.begin, 4),
        Runs(good.rows[::-1].copy(), good.begin, good.end, 4),
    ):
        with pytest.raises(ValueError, match="row"):
            _slices.gaps(bad)
    with pytest.raises(ValueError, match="layers differ in size"):
        _slices.unsupported(good, runs_of(np.eye(5)), 1.0)
