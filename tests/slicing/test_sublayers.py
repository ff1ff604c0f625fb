"""Grey levels as shares of a layer's height, on a plane that slopes gently."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fracslice.errors import ExportError, SliceError
from fracslice.export.layers import write_slices
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import Node, box, intersection, transform
from fracslice.slicing import SliceJob, Slicer, Stack, adapted, plan_stack
from fracslice.slicing.layers import WHOLE, MeanSlicer, section_weights
from fracslice.slicing.printers import PRINTERS, Resin
from fracslice.slicing.raster import Screen
from fracslice.work import Work

pytestmark = pytest.mark.once

SLOPE = 0.12


def wedge() -> Node:
    """A plate with a sloping top: z = SLOPE x."""
    angle = -np.degrees(np.arctan(SLOPE))
    below = transform(box(size=(8, 8, 4)), translate=(0, 0, -2))
    return intersection(box(size=(2, 0.5, 0.6)), transform(below, rotate=(0, 1, 0, angle)))


@pytest.fixture(scope="module")
def stack() -> Stack:
    return plan_stack(wedge(), SliceJob(size=20, layer=0.5, pixel=(0.1, 0.1)))


def off(stack: Stack, sections: int) -> np.ndarray:
    """Height of the printed top above the plane, mm, where a pixel cures as deep as it is grey."""
    slicer = MeanSlicer(stack, Work(), sections)
    height = np.zeros(stack.shape)
    for layer, picture in enumerate(slicer.map(lambda one: one.coverage)):
        height += picture / 255 * stack.heights[layer]
    rows, columns = stack.shape
    x = (np.arange(columns) + 0.5 - columns / 2) * stack.pixel[0]
    inner = np.abs(x) < 8
    top = stack.size[2] - SLOPE * (x.max() - x.min()) / 2 + SLOPE * x
    return (height[rows // 2] - height[rows // 2, inner].mean() - top + top[inner].mean())[inner]


def test_stairs_of_a_slope_are_halved_at_least(stack: Stack) -> None:
    errors = {n: np.abs(off(stack, n)).max() for n in (1, 2, 4, 8)}
    assert errors[1] == pytest.approx(0.25, abs=0.02)  # half a layer
    assert errors[2] < errors[1] / 2 * 1.05
    assert errors[4] < errors[1] / 3
    assert errors[8] < errors[1] / 5


def test_the_volume_and_the_pictures_of_the_middle_stay(stack: Stack) -> None:
    one = list(Slicer(stack).map(lambda layer: layer.area))
    slicer = MeanSlicer(stack, Work(), 8)
    eight = list(slicer.map(lambda layer: layer.area))
    assert [slicer.areas[k] for k in range(len(eight))] == eight
    assert np.sum(one) == pytest.approx(np.sum(eight), rel=4e-3)
    same = list(MeanSlicer(stack, Work(), 1).map(lambda layer: layer.coverage))
    assert all((a == b).all() for a, b in zip(same, Slicer(stack).map(lambda one: one.coverage), strict=True))


def test_chosen_layers_of_any_height_on_any_number_of_threads(stack: Stack) -> None:
    uneven = adapted(stack, 1.5)
    assert len(uneven.z) < len(stack.z)
    made = []
    for threads in (1, 3):
        screen = Screen(uneven)
        slicer = MeanSlicer(uneven, Work(threads=threads), 4)
        made.append(list(slicer.map(screen.picture)))
        some = list(slicer.map(screen.picture, [1, 3]))
        assert all((a == b).all() for a, b in zip(some, (made[-1][1], made[-1][3]), strict=True))
    assert all((a == b).all() for a, b in zip(*made, strict=True))


def cured(doses: np.ndarray, layer: float, penetration: float, critical: float) -> np.ndarray:
    """Height at which resin begins to be cured in columns, mm, by summed doses of layers of one height.

    doses: of each layer from the lowest, by a whole one, [n, columns]; the light comes from above.
    """
    z = np.arange(0, len(doses) * layer, 1e-3)
    total = np.zeros((len(z), doses.shape[1]))
    for k, dose in enumerate(doses):
        depth = (k + 1) * layer - z[:, None]
        total += np.where(depth > 0, dose * np.exp(-np.maximum(depth, 0) / penetration), 0)
    return z[(total >= critical).argmax(0)]


def test_a_face_that_looks_down_is_cured_without_stairs() -> None:
    """By the working curve of Jacobs 1992, within half a section; the offset of the face is the resin's."""
    layer, n, resin = 0.1, 8, Resin(4.0, 30.0, penetration=0.08, critical=0.5)
    face = np.linspace(0.9, 1.1, 81)  # its height in each column, among 30 layers
    middles = (np.arange(30)[:, None] + (np.arange(n) + 0.5) / n) * layer
    solid = middles[..., None] > face
    errors = {}
    for penetration in (resin.penetration, math.inf):
        weights = np.array(section_weights(layer, n, penetration)) / WHOLE
        doses = np.einsum("lsx,s->lx", solid, weights)
        made = cured(doses, layer, resin.penetration, resin.critical / resin.exposure)
        errors[penetration] = face - made - resin.excess(layer)
    assert np.abs(errors[resin.penetration]).max() < layer / n / 2 + 2e-3
    assert np.ptp(errors[math.inf]) > 1.5 * np.ptp(errors[resin.penetration])
    assert sum(section_weights(layer, n, 0.08)) == sum(section_weights(layer, n, math.inf)) == WHOLE
    assert section_weights(layer, 4, math.inf) == [WHOLE // 4] * 4


def test_a_working_curve_weights_the_sections_of_layers(stack: Stack) -> None:
    """Of a face that looks up, grey pixels get more light, walls the same."""
    plain, more = (
        list(MeanSlicer(stack, Work(), 4, p).map(lambda one: one.coverage)) for p in (math.inf, 0.5)
    )
    grey = [(a > 0) & (a < 255) for a in plain]
    difference = np.concatenate([(b.astype(int) - a)[g] for a, b, g in zip(plain, more, grey, strict=True)])
    assert difference.min() >= 0 and difference.max() > 20
    assert all((b[a == v] == v).all() for a, b in zip(plain, more, strict=True) for v in (0, 255))


def test_too_short_an_exposure_is_refused(stack: Stack, tmp_path: Path) -> None:
    resin = Resin(1.0, 30.0, penetration=0.2, critical=0.5)
    assert resin.cured_depth(resin.exposure) == pytest.approx(0.2 * np.log(2))
    run = SliceRun(stack, Screen(stack, printer=PRINTERS["mars-5"]), resin=resin)
    with pytest.raises(ExportError, match=r"1 s cures 0.14 mm, a layer is 0.5 mm: expected at least 6.09 s"):
        write_slices(run, tmp_path / "a.goo")
    assert not list(tmp_path.iterdir())


def test_other_numbers_are_refused(stack: Stack) -> None:
    with pytest.raises(SliceError, match="sections=3: expected one of 1, 2, 4, 8"):
        SliceRun(stack, Screen(stack), sections=3)


def test_contours_have_one_section(stack: Stack, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="contours are of one section per layer"):
        write_slices(SliceRun(stack, Screen(stack), sections=2), tmp_path / "a.cli")
    with pytest.raises(ExportError, match="without compensation"):
        write_slices(SliceRun(stack, Screen(stack, compensation=0.1)), tmp_path / "a.cli")
