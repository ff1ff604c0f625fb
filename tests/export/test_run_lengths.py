"""Run lengths of pictures, decoded by what the formats' descriptions say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fracslice._slices import Encoding, Slab, encoded
from fracslice.errors import Cancelled, SliceError
from fracslice.formulas import difference, menger, sphere
from fracslice.slicing import Layer, SliceJob, Slicer, plan_stack
from fracslice.slicing.layers import Pictures, Sampler
from fracslice.slicing.printers import Printer
from fracslice.slicing.raster import Screen
from fracslice.work import Work
from tests.export import decoders

pytestmark = pytest.mark.once

RNG = np.random.default_rng(0)
KINDS = {
    Encoding.GOO: (decoders.goo, lambda image: image),
    Encoding.RLE7: (decoders.rle7, lambda image: image >> 1),
    Encoding.RLE4: (decoders.rle4, lambda image: np.rint(image / 17).astype(int)),
    Encoding.RLE1: (decoders.rle1, lambda image: image >> 7),
}


def pictures() -> list[np.ndarray]:
    """Noise, ramps whose steps are small and large, and runs of every size of length."""
    steps = np.cumsum(RNG.choice([0, 0, 0, 1, -1, 15, -15, 16, 255], 4096))
    lengths = [1, 2, 15, 16, 125, 126, 255, 256, 4095, 4096, 16383, 16384, 2**20 - 1, 2**20, 2**21]
    runs = np.repeat(RNG.integers(0, 4, 2 * len(lengths)) * 85, np.repeat(lengths, 2))
    return [
        RNG.integers(0, 256, (37, 101)).astype(np.uint8),
        steps.astype(np.uint8).reshape(64, 64),
        runs.astype(np.uint8).reshape(2, -1),
        *(np.full((3, 5), value, np.uint8) for value in (0, 1, 128, 255)),
    ]


@pytest.mark.parametrize("encoding", KINDS)
def test_every_pixel_comes_back(encoding: Encoding) -> None:
    decode, level = KINDS[encoding]
    for image in pictures():
        data = encoded(image, encoding)
        assert (decoders.picture(decode(data), image.shape) == level(image)).all()


@pytest.mark.parametrize("encoding", KINDS)
@pytest.mark.parametrize(("portrait", "mirror"), [(True, True), (False, True), (False, False)])
def test_layers_are_encoded_from_their_tiles(encoding: Encoding, portrait: bool, mirror: bool) -> None:
    """The same bytes as from the picture, though none is made."""
    machine = Printer("test", "Test", (97, 83), (24.25, 20.75), 30, mirror=mirror, portrait=portrait)
    root = difference(menger(level=1), sphere(radius=0.9))
    stack = plan_stack(root, SliceJob(size=12, layer=1, pixel=machine.pixel))
    screen = Screen(stack, printer=machine)

    def both(layer: Layer) -> tuple[bytes, bytes]:
        return screen.encoded(layer, encoding), encoded(screen.picture(layer), encoding)

    assert all(straight == over for straight, over in Slicer(stack).map(both))


@pytest.mark.parametrize("encoding", KINDS)
def test_pictures_that_are_made_with_the_samples_are_those_of_each_layer(
    encoding: Encoding, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes, areas and evaluations; several layers are made in a call, whichever are chosen."""
    stack = plan_stack(
        difference(menger(level=2), sphere(radius=0.9)), SliceJob(size=12, layer=0.4, pixel=0.1)
    )
    screen, chosen, calls = Screen(stack, gamma=2.2), [2, 3, 5, 9, *range(16, 30)], list[list[int]]()
    real = Sampler.pictures

    def counted(self: Sampler, slab: Slab, layers: list[int], pictures: Pictures) -> Any:
        calls.append(layers)
        return real(self, slab, layers, pictures)

    monkeypatch.setattr(Sampler, "pictures", counted)

    def made(layer: Layer) -> tuple[bytes, float, int, float]:
        return screen.encoded(layer, encoding), layer.area, layer.boundary, layer.evaluations

    each, together = (Slicer(stack, Work(threads=2)) for _ in range(2))
    assert list(together.map(made, chosen, screen.pictures(encoding))) == list(each.map(made, chosen))
    assert together.areas == each.areas
    assert 4 <= len(calls) < len(chosen)


def test_pictures_that_are_made_with_the_samples_are_cancelled() -> None:
    work = Work(threads=1)
    stack = plan_stack(sphere(), SliceJob(size=20, layer=0.2, pixel=0.1))
    screen = Screen(stack)
    layers = Slicer(stack, work).map(
        lambda layer: screen.encoded(layer, Encoding.PNG), pictures=screen.pictures(Encoding.PNG)
    )
    next(layers)
    work.cancel.set()
    with pytest.raises(Cancelled):
        list(layers)


def test_pictures_of_changed_outlines_are_not_made_with_the_samples() -> None:
    stack = plan_stack(sphere(), SliceJob(size=4, layer=1, pixel=0.1))
    assert Screen(stack).pictures(Encoding.PNG)
    assert not Screen(stack, compensation=0.05).pictures(Encoding.PNG)
    assert not Screen(stack, blur=1).pictures(Encoding.PNG)


def test_the_sampling_of_pictures_stops_at_the_rim() -> None:
    stack = plan_stack(sphere(), SliceJob(size=4, layer=1, pixel=0.1))
    screen = Screen(replace(stack, corner=(0.0, 0.0)))
    with pytest.raises(SliceError, match="finite <bounds>"):
        list(Slicer(screen.stack).map(lambda layer: layer.area, pictures=screen.pictures(Encoding.PNG)))
