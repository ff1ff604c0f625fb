"""Plates: parts are where they should be, apart from each other, and as they are alone."""

from __future__ import annotations

import math
import zlib
from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest

from fracslice._slices import Encoding
from fracslice.errors import SliceError
from fracslice.formulas import Node, box, sphere, transform, union
from fracslice.jobs.plates import PlateRecipe
from fracslice.jobs.slices import SliceRecipe
from fracslice.records import Print
from fracslice.scene import scene
from fracslice.scene.model import to_xml
from fracslice.slicing import SliceJob, Slicer, Stack, plan_layers
from fracslice.slicing.layers import MeanSlicer
from fracslice.slicing.packing import (
    Beds,
    Footprint,
    Spot,
    outline_of_layers,
    outline_of_mesh,
    packed,
    plate_of,
)
from fracslice.slicing.printers import PRINTERS, Printer
from fracslice.slicing.raster import Screen
from fracslice.work import Work
from tests.export import decoders

pytestmark = pytest.mark.once

L_SHAPE = union(box(size=(8, 2, 2)), transform(box(size=(2, 6, 4)), translate=(-3, 2, 0)))
"""No turn of it is like another."""

SCREEN = Printer("small", "Small", (300, 200), (30.0, 20.0), 50.0)


def stack_of(node: Node, **options: object) -> Stack:
    job = SliceJob(**{"size": 8.0, "layer": 0.5, "pixel": 0.1} | options)
    return plan_layers(node, job, Work(1))


def plate(*turns: int) -> Stack:
    part = stack_of(L_SHAPE)
    spots = [Spot(turn, (9.0 * k - 9.0, 0.0)) for k, turn in enumerate(turns)]
    return plate_of([part] * len(turns), spots)


@pytest.mark.parametrize("turns", [(0, 1), (2, 3)])
def test_a_plate_is_the_union_of_its_parts(turns: tuple[int, ...]) -> None:
    """The field at the middles of pixels says what the pictures show, and the contours have its area."""
    whole = plate(*turns)
    x0, y0, dx, dy = whole.frame
    ny, nx = whole.shape
    x, y = np.meshgrid(x0 + dx * (np.arange(nx) + 0.5), y0 + dy * (np.arange(ny) + 0.5))
    made = Slicer(whole, Work(1)).map(
        lambda one: (one.index, one.coverage, one.contours.area, one.runs, one.area)
    )
    for index, coverage, area, runs, painted in made:
        values = whole.root.kernel("cpu", "float64").points(x, y, np.full_like(x, whole.z[index]))
        assert ((coverage >= 128) == (values < 0))[abs(values) > 0.06].all()
        assert (coverage[values < -0.08] == 255).all()
        assert area == pytest.approx(painted, rel=1e-3)
        assert int((runs.end - runs.begin).sum()) == int((coverage >= 128).sum())


@pytest.mark.parametrize(("portrait", "mirror"), list(product((False, True), repeat=2)))
def test_what_is_encoded_from_runs_is_the_picture(portrait: bool, mirror: bool) -> None:
    printer = replace(SCREEN, portrait=portrait, mirror=mirror)
    for other in (plate(0, 3), plate(1, 2)):
        screen = Screen(other, printer=printer)
        for layer in (1, 6):
            slicer = Slicer(other, Work(1))
            dense = next(slicer.map(screen.picture, [layer]))
            data = next(slicer.map(lambda one, at=screen: at.encoded(one, Encoding.GOO), [layer]))
            assert dense.any()
            assert np.array_equal(decoders.picture(decoders.goo(data), dense.shape), dense)
            data = next(slicer.map(lambda one, at=screen: at.encoded(one, Encoding.PNG), [layer]))
            assert zlib.decompress(data) == np.pad(dense, ((0, 0), (1, 0))).tobytes()


def test_a_mean_of_sections_is_that_of_the_parts() -> None:
    part = stack_of(sphere(4))
    two = plate_of([part, part], [Spot(0, (-5.0, 0.0)), Spot(0, (5.0, 0.0))])
    one = list(MeanSlicer(part, Work(1), 4).map(lambda layer: layer.area))
    both = list(MeanSlicer(two, Work(1), 4).map(lambda layer: layer.area))
    assert both == pytest.approx([2 * area for area in one])


def test_parts_are_packed_apart_and_on_the_bed() -> None:
    """Measured on outlines finer than the cells of the packing."""
    part, work = stack_of(L_SHAPE), Work(1)
    outline = outline_of_layers(part, 0.25, work)
    spots = packed([outline] * 5, ["l"] * 5, 0.25, Beds((22.0, 20.0), 1.5))
    whole = plate_of([part] * 5, spots)
    assert whole.size[0] <= 22
    assert whole.size[1] <= 20
    covered = list(Slicer(whole, work).map(lambda layer: layer.coverage > 0))
    from scipy.ndimage import distance_transform_edt, label

    parts, count = label(np.any(covered, 0))
    assert count == 5
    for k in range(1, 6):
        away = distance_transform_edt(parts != k)[(parts != k) & (parts > 0)]
        assert away.min() * 0.1 >= 1.5


def test_beds_hold_what_lies_on_them() -> None:
    """Rectangles of whose sizes no cell is a divisor, one as large as a bed."""
    rng = np.random.default_rng(4)
    sizes = [(110.3, 100.1), *map(tuple, rng.uniform(5, 60, (24, 2)).tolist())]
    cell, bed = 0.5, (110.3, 100.1)
    cells = [[2 * math.ceil(side / cell / 2 - 1e-9) + 2 for side in size] for size in sizes]
    outlines = [Footprint(np.ones(n[::-1], bool), size) for n, size in zip(cells, sizes, strict=True)]
    spots = packed(outlines, ["r"] * len(sizes), cell, Beds(bed, 3.0, most=None))
    taken = []
    for outline, spot in zip(outlines, spots, strict=True):
        half = np.array(outline.turned(spot.turns).size) / 2
        taken.append((spot.bed, spot.middle - half, spot.middle + half))
        assert (abs(np.array(spot.middle)) + half <= np.array(bed) / 2 + 1e-9).all()
    for (n, low, high), (m, lower, higher) in combinations(taken, 2):
        assert n != m or max((lower - high).max(), (low - higher).max()) >= 3 - 1e-9
    area = sum(w * d for w, d in sizes[1:])
    assert 1 + max(spot.bed for spot in spots) <= 2 + math.ceil(1.6 * area / math.prod(bed))


def test_outlines_of_meshes_are_those_of_layers() -> None:
    from fracslice import make_mesh

    mask = outline_of_layers(stack_of(L_SHAPE), 0.25, Work(1)).mask
    made = make_mesh(L_SHAPE, size=8, resolution=32, threads=1, chord="0.01mm")
    mesh = outline_of_mesh(made, 0.25).mask
    assert abs(np.array(mask.shape) - mesh.shape).max() <= 2
    assert abs(int(mask.sum()) - int(mesh.sum())) < 0.15 * mask.sum()


def test_what_does_not_fit_is_named() -> None:
    part = SliceRecipe(to_xml(scene(L_SHAPE, unit=1.0)), "l.xml", SliceJob(printer=SCREEN, layer=0.5))
    with pytest.raises(
        SliceError, match=r"^l\.xml: no room for it on the Small 2 mm beside .*; \d of 40 parts fit"
    ):
        PlateRecipe((part,) * 40).run(Work(1))
    large = replace(part, job=replace(part.job, size=60))
    with pytest.raises(SliceError, match=r"^l\.xml: the object is 60 mm along x, the Small has 30 mm"):
        PlateRecipe((part, large)).run(Work(1))
    ranged = replace(part, job=replace(part.job, layer=(0.1, 0.5)))
    with pytest.raises(SliceError, match="layers of one height"):
        PlateRecipe((ranged,)).run(Work(1))


def test_each_part_has_its_own_changes_for_printing() -> None:
    """Half of the plate is hollow, and its holes are where its part is."""
    job = SliceJob(printer=PRINTERS["mars-5"], layer=0.5)
    ball = SliceRecipe(to_xml(scene(sphere(8), unit=1.0)), "ball", job)
    hollow = replace(ball, job=replace(job, printing=Print(hollow=2, drain=2)))
    run = PlateRecipe((ball, hollow)).run(Work(1))
    assert len(run.stack.drains) == 2
    inside = run.stack.root.kernel("cpu", "float64")
    for drain in run.stack.drains:
        x, y, z = (np.array([a]) for a in drain.start)
        assert inside.points(x, y, z)[0] > 0
    areas = np.array(list(run.slicer.map(lambda layer: layer.area)))
    volume = float(areas @ run.stack.heights)
    solid = 4 / 3 * np.pi * 8**3
    assert solid < volume < 1.7 * solid
