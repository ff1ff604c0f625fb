"""Layers of a print as a studio shows them: the pixels of one, what of it hangs in the air, and figures."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..checks.fitting import misfit
from ..checks.layer_checks import PrintReport
from ..common.arrays import distinct
from ..common.messages import duration, format_count, significant
from ..mesh.drawing import BEHIND, Size
from ..slicing import Layer, Slicer, Stack
from ..slicing.feature_graph import Runs, layer_components, overlaps, unsupported_pixels
from ..slicing.layers import SupportedLayer
from ..slicing.printers import START, Printer, Resin
from ..slicing.raster import INK
from ..work import Work

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

HANGS, ISLAND, SUPPORT, BED = (236, 140, 50), (214, 60, 200), (84, 150, 214), (70, 76, 88)
"""Colours of pixels with nothing below them, of islands, of supports, and of the printer's screen, sRGB."""

HELD, HANGING, ALONE = 1, 2, 3
"""Classes of pixels: supports, those with nothing below them, and islands; 0: others."""

FILLED = 0.9
"""Share of the page that a whole layer fills."""

RING = 14
"""Radius of the ring around a place, pixels."""

LEAST, MOST = 0.2, 1000.0
"""Limits of the enlargement."""

SPREAD = 24
"""Layers by whose areas the volume of all is estimated."""


@dataclass(frozen=True)
class Window:
    """What of a layer is seen: its middle, mm from that of the object, and an enlargement of the whole."""

    x: float = 0.0
    y: float = 0.0
    zoom: float = 1.0

    def scale(self, stack: Stack, size: Size) -> float:
        """Pixels of a millimetre in a picture of a size."""
        across, along, _ = stack.size
        return self.zoom * FILLED * min(size[0] / across, size[1] / along)

    def dragged(self, right: float, down: float, scale: float) -> Window:
        """Moved with the mouse by pixels, of which a mm has `scale`."""
        return replace(self, x=self.x - right / scale, y=self.y + down / scale)

    def zoomed(self, factor: float) -> Window:
        """Enlarged about its middle."""
        return replace(self, zoom=min(max(self.zoom * factor, LEAST), MOST))


@dataclass(frozen=True, eq=False)
class LayerImage:
    """A layer with what is wrong in it."""

    image: NDArray[np.uint8]  # sRGB [ny, nx, 3], front row first
    classes: NDArray[np.uint8]  # number of the colour of each pixel
    area: float  # mm2
    bodies: int  # components
    islands: int  # components with nothing below them
    hanging: float  # area without anything below it, mm2


@dataclass(frozen=True, eq=False)
class PrintLayers:
    """Planned layers, and what is known of their print."""

    stack: Stack
    work: Work
    printer: Printer | None
    resin: Resin | None
    areas: dict[int, float] = field(default_factory=dict)  # of layers that were looked at, mm2

    def __len__(self) -> int:
        return len(self.stack.z)

    @cached_property
    def slicer(self) -> Slicer:
        """Slicer of the stack."""
        return Slicer(self.stack, self.work)

    @cached_property
    def _carried(self) -> Slicer | None:
        """Slicer of the object without its supports, where layers do not tell them apart."""
        supports = self.stack.supports
        if supports is None or supports.carried.bounds.exterior_only:
            return None
        return Slicer(replace(self.stack, root=supports.carried, supports=None), self.work)

    def look(self, index: int) -> LayerImage:
        """A layer, compared with the one below it."""
        *below, now = self.slicer.map(_read, [index - 1, index] if index else [index])
        self.areas[index] = now.area
        pixel, classes = self.stack.pixel, now.classes
        if self._carried:
            (own,) = self._carried.map(lambda layer: layer.coverage, [index])
            classes[own < now.coverage] = HELD
        if not below:
            return LayerImage(_colours(now), classes, now.area, len(layer_components(now.runs)[0]), 0, 0.0)
        reach = max(float(self.stack.heights[index]) / min(pixel), 1.0)
        bare = unsupported_pixels(below[0].runs, now.runs, reach)
        classes[_mask(bare, np.ones(len(bare.begin), bool))] = HANGING
        solid, held = (layer_components(runs)[0] for runs in (now.runs, below[0].runs))
        alone = np.ones(len(solid), bool)
        alone[overlaps(held, solid)[:, 1]] = False
        classes[_mask(now.runs, alone[solid.label])] = ALONE
        hanging = float((bare.end - bare.begin).sum()) * pixel[0] * pixel[1]
        return LayerImage(_colours(now), classes, now.area, len(solid), int(alone.sum()), hanging)

    def survey(self) -> None:
        """Look at the areas of some layers, by which the volume of all is estimated."""
        chosen = distinct(np.linspace(0, len(self) - 1, SPREAD).astype(int)).tolist()
        self.areas.update(zip(chosen, self.slicer.map(lambda layer: layer.area, chosen), strict=True))

    def figures(
        self, seen: LayerImage | None, index: int, report: PrintReport | None
    ) -> list[tuple[str, str]]:
        """Names and values of figures of a layer, and of the whole print."""
        stack = self.stack
        rows = [("height", f"{stack.tops[index]:.3f} mm of {stack.tops[-1]:.2f} mm")]
        if seen:
            rows += [
                ("area", f"{significant(seen.area)} mm2"),
                ("bodies", format_count(seen.bodies, "body", "bodies")),
                ("islands", str(seen.islands)),
                ("overhang", f"{significant(seen.hanging)} mm2"),
            ]
        size = " x ".join(significant(side) for side in stack.size)
        rows.append(("object", f"{format_count(len(self), 'layer')}, {size} mm"))
        if self.printer and (unfit := misfit(stack, self.printer)):
            rows.append(("printer", unfit.text))
        return rows + self._print(report)

    def _print(self, report: PrintReport | None) -> list[tuple[str, str]]:
        """Resin, time and cost."""
        areas, about = (np.array(report.areas), "") if report else (self._estimate(), "about ")
        resin, ml = self.resin or START, float(areas @ self.stack.heights) / 1000
        rows = [("resin", f"{about}{significant(ml)} ml, {significant(ml * resin.density)} g")]
        if self.resin:
            rows.append(("time", duration(resin.seconds(areas))))
        if resin.price:
            rows.append(("cost", f"{about}{ml / 1000 * resin.price:.2f}"))
        return rows

    def _estimate(self) -> NDArray[np.float64]:
        """Areas of the layers, by those that were looked at, mm2."""
        known = sorted(self.areas)
        return np.interp(np.arange(len(self)), known, [self.areas[k] for k in known])

    def picture(
        self, seen: LayerImage, window: Window, size: Size, at: tuple[float, float] | None = None
    ) -> NDArray[np.uint8]:
        """A layer from above on the printer's screen, its back up; uint8 [rows, columns, 3].

        `at`: a place that is marked, mm from the middle of the object.
        """
        from PIL import Image, ImageDraw

        scale = window.scale(self.stack, size)
        page = Image.new("RGB", size, BEHIND)
        draw, pixel = ImageDraw.Draw(page), scale * np.array(self.stack.pixel)
        middle = np.array(size) / 2 + scale * np.array([-window.x, window.y])
        if self.printer:
            reach = scale * np.array(self.printer.screen) / 2
            draw.rectangle([*(middle - reach), *(middle + reach)], outline=BED)
        corner = middle - pixel * seen.classes.shape[::-1] / 2
        _paste(seen, page, corner, pixel)
        if pixel.min() < 1:
            _warn(seen, draw, corner, pixel)
        if at:
            x, y = middle + scale * np.array([at[0], -at[1]])
            draw.ellipse([x - RING, y - RING, x + RING, y + RING], outline=ISLAND, width=2)
        return np.asarray(page)


def _paste(seen: LayerImage, page: Image, corner: NDArray[np.float64], pixel: NDArray[np.float64]) -> None:
    """Paste what is seen of a layer; `corner`: its upper left one on the page, `pixel`: size of a pixel."""
    from PIL import Image

    count = np.array(seen.classes.shape[::-1])
    low = np.maximum(np.floor(corner), 0).astype(int)
    high = np.minimum(np.ceil(corner + pixel * count), page.size).astype(int)
    if (high <= low).any():
        return
    box = np.clip([(low - corner) / pixel, (high - corner) / pixel], 0, count)
    how = Image.Resampling.BOX if pixel.min() < 1 else Image.Resampling.NEAREST
    (left, upper), (right, lower) = low.tolist(), high.tolist()
    part = Image.fromarray(np.ascontiguousarray(seen.image[::-1]))
    page.paste(part.resize((right - left, lower - upper), how, tuple(box.ravel().tolist())), (left, upper))


def _warn(seen: LayerImage, draw: ImageDraw, corner: NDArray[np.float64], pixel: NDArray[np.float64]) -> None:
    """Draw what is wrong over a layer whose pixels are smaller than those of the page and hide it."""
    for number, colour in ((HANGING, HANGS), (ALONE, ISLAND)):
        rows, columns = np.nonzero(seen.classes[::-1] == number)
        places = np.unique(np.floor(corner + pixel * np.stack([columns, rows], 1)).astype(int), axis=0)
        draw.point(places.ravel().tolist(), fill=colour)


@dataclass(frozen=True, eq=False)
class _Read:
    """What is read of a layer, before the next one is sampled."""

    runs: Runs
    coverage: NDArray[np.uint8]
    classes: NDArray[np.uint8]  # number of the colour of each pixel
    area: float


def _read(layer: Layer) -> _Read:
    coverage = layer.coverage
    classes = np.zeros(coverage.shape, np.uint8)
    if isinstance(layer, SupportedLayer):
        classes[layer.own.coverage < layer.supports.coverage] = HELD
    return _Read(layer.runs, coverage, classes, layer.area)


def _mask(runs: Runs, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels of some runs, bool [ny, nx]."""
    rows = np.repeat(np.arange(runs.height), np.diff(runs.rows))[chosen]
    steps = np.zeros((runs.height, runs.width + 1), np.int32)
    np.add.at(steps, (rows, runs.begin[chosen]), 1)
    np.add.at(steps, (rows, runs.end[chosen]), -1)
    return np.asarray(steps.cumsum(1)[:, :-1] > 0)


def _colours(of: _Read) -> NDArray[np.uint8]:
    """Colours of the pixels of a layer by their classes and coverage, uint8 [ny, nx, 3]."""
    table = np.array([INK[1], SUPPORT, HANGS, ISLAND])  # in the order of the classes
    share = of.coverage[..., None] / np.float32(255)
    colours: NDArray[np.float64] = INK[0] + share * (table[of.classes] - INK[0]) + 0.5
    return colours.astype(np.uint8)
