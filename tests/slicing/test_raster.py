"""Pictures for screens: compensation, gamma, place and mirror."""

from __future__ import annotations

import math
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fracslice._slices import Encoding, encoded
from fracslice.errors import SliceError
from fracslice.formulas import Node, box, mandelbulb, menger, sphere, transform, union
from fracslice.slicing import Layer, SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.printers import Printer, Resin, printer
from fracslice.slicing.raster import Screen, blur, compensate, shrink
from tests.export import decoders

pytestmark = pytest.mark.once

SMALL = Printer("small", "Small", (120, 100), (12.0, 10.0), 30)


def stack_of(root, size: float = 6.0, at: Printer = SMALL) -> Stack:  # type: ignore[no-untyped-def]
    return plan_stack(root, SliceJob(size=size, layer=0.5, pixel=at.pixel))


def picture(screen: Screen) -> np.ndarray:
    layers = list(Slicer(screen.stack).map(screen.picture))
    return layers[len(layers) // 2]


ELL = union(box(size=(2, 0.5, 0.5)), transform(box(size=(0.5, 1, 0.5)), translate=(0.75, 0.5, 0)))
"""Its short leg is at the right, and points to the back."""


def heavy(image: np.ndarray) -> tuple[bool, bool]:
    """Whether the object's mass lies in the lower and the right half of its box."""
    rows, columns = np.nonzero(image > 127)
    return (
        bool(rows.mean() > (rows.min() + rows.max()) / 2),
        bool(columns.mean() > (columns.min() + columns.max()) / 2),
    )


def test_the_back_is_up_and_the_right_is_right_unless_mirrored() -> None:
    stack = stack_of(ELL)
    assert heavy(picture(Screen(stack))) == (True, True)
    assert heavy(picture(Screen(stack, mirror=True))) == (True, False)
    assert heavy(picture(Screen(stack, printer=SMALL))) == (True, False)
    assert heavy(picture(Screen(stack, printer=SMALL, mirror=False))) == (True, True)


def test_portrait_screens_have_the_bed_s_x_upwards() -> None:
    """As PrusaSlicer 2.5 writes it for the SL1; compared by hand, pixel by pixel."""
    tall = Printer("tall", "Tall", (120, 100), (12.0, 10.0), 30, portrait=True)
    image = picture(Screen(stack_of(ELL), printer=tall))
    assert image.shape == (120, 100)
    assert heavy(image) == (False, False)


@pytest.mark.parametrize(
    "name", ["sl1", "sl1s", "photon-mono", "photon-mono-4k", "mars-5", "sonic-mini-8k-s"]
)
def test_objects_lie_in_the_middle_of_every_screen(name: str) -> None:
    machine = printer(name)
    stack = plan_stack(sphere(), SliceJob(size=10, layer=2, pixel=machine.pixel))
    image = picture(Screen(stack, printer=machine))
    pixels = machine.pixels[::-1] if not machine.portrait else machine.pixels
    assert image.shape == pixels
    assert image.dtype == np.uint8
    assert image.flags.c_contiguous
    rows, columns = np.nonzero(image)
    assert abs(rows.mean() - (pixels[0] - 1) / 2) <= 1
    assert abs(columns.mean() - (pixels[1] - 1) / 2) <= 1
    covered = image.sum() / 255 * machine.pixel[0] * machine.pixel[1]
    middle = len(stack.z) // 2
    assert covered == pytest.approx(math.pi * (1 - stack.z[middle] ** 2) * 25, rel=2e-3)


def test_an_object_as_large_as_the_bed_fits() -> None:
    image = picture(Screen(stack_of(box(size=(12, 10, 1)), 12.0), printer=SMALL))
    assert image.shape == (100, 120)
    assert (image[1:-1, 1:-1] == 255).all()


def test_too_large_for_the_printer() -> None:
    with pytest.raises(SliceError, match=r"12\.002 mm along x, the Small has 12 mm"):
        Screen(stack_of(box(size=(12.002, 1, 1)), 12.002), printer=SMALL)
    with pytest.raises(SliceError, match="13 mm along x, the Small has 12 mm"):
        Screen(stack_of(box(size=(13, 1, 1)), 13.0), printer=SMALL)


@pytest.mark.parametrize("machine", [None, SMALL, replace(SMALL, portrait=True)])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"mirror": True},
        {"mirror": False},
        {"gamma": 2.2, "levels": 4},
        {"compensation": 0.1},
        {"blur": 2},
    ],
)
@pytest.mark.parametrize("root", [ELL, mandelbulb(), menger(level=2)])
def test_deflated_pictures_are_the_pictures(
    root: Node, options: dict[str, Any], machine: Printer | None
) -> None:
    """As the library zlib reads them, whatever way they are turned; larger layers are cropped."""
    for size in (6.1, 9.9 - 2 * options.get("compensation", 0)):
        screen = Screen(stack_of(root, size), printer=machine, **options)
        rows, columns = screen.shape

        def made(layer: Layer, screen: Screen = screen) -> tuple[bytes, np.ndarray]:
            return screen.encoded(layer, Encoding.PNG), screen.picture(layer)

        for data, picture in Slicer(screen.stack).map(made, range(0, len(screen.stack.z), 5)):
            rows_read = np.frombuffer(zlib.decompress(data), np.uint8).reshape(rows, columns + 1)
            assert not rows_read[:, 0].any()
            assert (rows_read[:, 1:] == picture).all()


def test_deflated_pictures_are_small() -> None:
    """An empty screen takes two bits for each 258 pixels, as little as deflate can say."""
    empty = np.zeros((2400, 3840), np.uint8)
    assert len(encoded(empty, Encoding.PNG)) < empty.size / 1032 + 250
    noise = np.random.default_rng(0).integers(0, 256, (300, 400), np.uint8)
    assert len(encoded(noise, Encoding.PNG)) < 1.01 * noise.size + 250


@pytest.mark.parametrize("seed", range(4))
def test_any_runs_are_deflated(seed: int) -> None:
    """Runs of all lengths around those that deflate codes apart, in an image of any strides; codes that would
    be longer than 15 bits.
    """
    rng = np.random.default_rng(seed)
    lengths = rng.choice([1, 2, 3, 4, 257, 258, 259, 260, 261, 516, 519, 70_000], 4000)
    values = np.minimum(rng.geometric(0.5, 4000) - 1, 255) * 7 % 256
    size = lengths.sum() // 1000 * 1000
    image = np.repeat(values.astype(np.uint8), lengths)[:size].reshape(1000, -1)
    for turned in (image, image[::-1], image[:, ::-1].T):
        rows = np.frombuffer(zlib.decompress(encoded(turned, Encoding.PNG)), np.uint8).reshape(
            len(turned), -1
        )
        assert (rows[:, 1:] == turned).all()
    rare = np.repeat(np.arange(25, dtype=np.uint8), [1, 1, *np.cumsum(2 ** np.arange(18)), 1, 1, 1, 1, 1])
    rare = rng.permutation(rare)[None]
    assert zlib.decompress(encoded(rare, Encoding.PNG)) == b"\0" + rare.tobytes()


@pytest.mark.parametrize("by", [0.05, 0.13, 0.3, -0.08, -0.21])
def test_compensation_moves_outlines(by: float) -> None:
    stack = stack_of(sphere())
    before, after = picture(Screen(stack)), picture(Screen(stack, compensation=by))
    radius = [math.sqrt(i.sum() / 255 * 0.01 / math.pi) for i in (before, after)]
    assert radius[1] - radius[0] == pytest.approx(by, abs=0.02)


@pytest.mark.parametrize("machine", [None, SMALL, replace(SMALL, portrait=True)])
def test_outlines_move_beyond_the_pixels_of_the_object(machine: Printer | None) -> None:
    stack = stack_of(box(size=(6, 4, 3)))
    image = picture(Screen(stack, printer=machine, compensation=0.9, blur=2))
    sides = [0.1 * (np.ptp(at) + 1) for at in np.nonzero(image > 127)]
    assert sorted(sides) == pytest.approx([5.8, 7.8])
    assert picture(Screen(stack, printer=machine, blur=16)).sum() / 25500 == pytest.approx(24, rel=0.01)


def test_outlines_that_move_beyond_the_bed_are_refused() -> None:
    stack = stack_of(box(size=(11.9, 9, 1)), 11.9)
    Screen(stack, printer=SMALL, compensation=0.05)
    with pytest.raises(SliceError, match=r"is 12\.1 mm along x"):
        Screen(stack, printer=SMALL, compensation=0.1)


def test_a_compensation_that_leaves_nothing_is_refused() -> None:
    stack = stack_of(box(size=(6, 1.5, 3)))
    assert picture(Screen(stack, compensation=-0.5)).any()
    with pytest.raises(SliceError, match=r"nothing is left of an object 1\.5 mm wide"):
        Screen(stack, compensation=-0.75)


def test_compensation_of_a_straight_edge_is_exact() -> None:
    image = np.zeros((9, 12), np.uint8)
    image[:, :5], image[:, 5] = 255, 128
    assert compensate(image, 0.13, (0.1, 0.1))[4].tolist() == [255] * 6 + [205] + [0] * 5
    assert compensate(image, -0.13, (0.1, 0.1))[4].tolist() == [255] * 4 + [51] + [0] * 7


@pytest.mark.parametrize("compensation", [0.0, 0.1])
def test_only_the_layers_that_are_exposed_longer_lose_their_foot(compensation: float) -> None:
    """By the share of the exposure that they have beyond that of others: two bottom layers, one between."""
    stack = stack_of(box(size=(6, 4, 3)))
    resin = Resin(2, 20, bottom_layers=2, transition_layers=1)
    job = SliceJob(size=6, elephant_foot=0.4, compensation=compensation)
    screen = Screen.of(stack, job, resin)
    assert screen.foot == pytest.approx([1, 1, 0.5][: len(screen.foot)])
    areas = [image.sum() / 25500 for image in Slicer(stack).map(screen.picture)]
    for area, by in zip(areas, [0.4, 0.4, 0.2, 0, 0], strict=False):
        side = 2 * (compensation - by)
        assert area == pytest.approx((6 + side) * (4 + side), rel=0.01)
    files = Slicer(stack).map(lambda layer: screen.encoded(layer, Encoding.GOO))
    for data, image in zip(files, Slicer(stack).map(screen.picture), strict=True):
        assert (decoders.picture(decoders.goo(data), image.shape) == image).all()


def test_what_is_thinner_than_the_foot_stays() -> None:
    """Tips of supports on the plate are not lost."""
    image = np.zeros((40, 40), np.uint8)
    image[4:8, 4:36] = 255
    image[16:36, 8:32] = 255
    made = shrink(image, 0.3, (0.1, 0.1))
    assert (made[4:8] == image[4:8]).all()
    assert (made[19:33, 11:29] == 255).all()
    assert int(made[16:36].sum()) == 255 * 14 * 18


def test_gamma_leaves_black_and_white() -> None:
    stack = stack_of(sphere())
    before, after = picture(Screen(stack)), picture(Screen(stack, gamma=2.0))
    grey = (before > 0) & (before < 255)
    assert (after[~grey] == before[~grey]).all()
    assert grey.any()
    np.testing.assert_allclose(after[grey], 255 * (before[grey] / 255.0) ** 2, atol=0.5)


@pytest.mark.parametrize("levels", [1, 2, 4, 8, 255])
def test_grey_levels_of_anti_aliasing(levels: int) -> None:
    stack = stack_of(sphere())
    before, after = picture(Screen(stack)).astype(float), picture(Screen(stack, levels=levels))
    assert len(np.unique(after)) <= levels + 1 and after.max() == 255
    assert np.abs(after - before).max() <= 255 / levels / 2 + 0.5


def test_blur_is_the_mean_over_a_square() -> None:
    """Also beyond the object's own pixels, where the screen has some."""
    dot = np.zeros((7, 9), np.uint8)
    dot[3, 4] = 250
    expected = np.zeros((7, 9))
    expected[2:5, 3:6] = 28
    assert (blur(dot, 1) == expected).all()
    machine = Printer("s", "S", (200, 200), (20.0, 20.0), 30)
    stack = stack_of(box(size=(6, 6, 6)))
    sharp, soft = (picture(Screen(stack, printer=machine, blur=b)).astype(int) for b in (0, 3))
    assert soft.sum() == pytest.approx(sharp.sum(), rel=0.01)
    assert (soft > 0).any(0).sum() == (sharp > 0).any(0).sum() + 6


@pytest.mark.parametrize(
    "options",
    [
        {"gamma": 0.0},
        {"gamma": math.nan},
        {"compensation": 2.0},
        {"elephant_foot": 1.5},
        {"compensation": math.nan},
        {"levels": 0},
        {"blur": 17},
    ],
)
def test_impossible_screens(options: dict[str, float]) -> None:
    with pytest.raises(SliceError, match="expected"):
        Screen(stack_of(sphere()), **options)  # type: ignore[arg-type]


def test_unknown_printers() -> None:
    with pytest.raises(SliceError, match="did you mean saturn-4-ultra"):
        printer("saturn 4 ultra")
    with pytest.raises(SliceError, match="known: sl1"):
        printer("xyz")


def test_pixels_of_the_printers_are_what_makers_say() -> None:
    """Micrometres, to a tenth."""
    reported = {"sl1": (47.25, 47.25), "sl1s": (50, 50), "mars-5-ultra": (18, 18), "saturn-4-ultra": (19, 24)}
    reported |= {
        "saturn-4-ultra-16k": (14, 19),
        "photon-mono-m7-pro": (16.8, 24.8),
        "halot-mage-pro": (29.7, 29.7),
    }
    reported |= {"sonic-mini-8k-s": (22, 22), "photon-mono-4": (17, 17), "photon-mono-4k": (35, 35)}
    for name, pixel in reported.items():
        assert np.array(printer(name).pixel) * 1000 == pytest.approx(pixel, abs=0.05)
