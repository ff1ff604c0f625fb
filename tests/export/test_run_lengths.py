"""Run lengths of pictures, decoded by what the formats' descriptions say."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice._slices import Encoding, encoded
from fracslice.formulas import difference, menger, sphere
from fracslice.slicing import Layer, SliceJob, Slicer, plan_stack
from fracslice.slicing.printers import Printer
from fracslice.slicing.raster import Screen
from tests.export import decoders

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
    screen = Screen(stack, machine)

    def both(layer: Layer) -> tuple[bytes, bytes]:
        return screen.encoded(layer, encoding), encoded(screen.picture(layer), encoding)

    assert all(straight == over for straight, over in Slicer(stack).map(both))
