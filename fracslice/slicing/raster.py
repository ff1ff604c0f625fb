"""From coverage to what a printer's screen shows: compensation, blur, grey levels, place and mirroring;
previews of planned layers: a contact sheet, an animation, the worst layers of a check, a page of HTML.

All raise `SliceError` if a layer cannot be sampled, and `Cancelled` when the work is cancelled.
"""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from .._slices import Encoding, dilated, encoded
from ..common.parameters import record
from ..errors import SliceError
from ..records import RasterOptions
from ..work import Work
from .feature_graph import MARKS, FeatureBox, counted
from .layers import Layer, Pictures, ScreenView, Slicer, SupportedLayer
from .printers import START, Printer, Resin
from .stack import Stack

if TYPE_CHECKING:
    from PIL.Image import Image


@record
class Screen(RasterOptions):
    """Turns layers into pictures."""

    stack: Stack = field(kw_only=False)  # the planned layers
    # share of the elephant foot that the first layers have, from 1 for a bottom layer
    foot: tuple[float, ...] = ()

    @classmethod
    def of(cls, stack: Stack, job: RasterOptions, resin: Resin | None = None) -> Screen:
        """Screen of a stack with the options of a job, for the bottom layers of a resin."""
        foot = (resin or START).overexposure(len(stack.z)) if job.elephant_foot else ()
        return cls(stack, **{f.name: getattr(job, f.name) for f in fields(RasterOptions)}, foot=foot)

    def __post_init__(self) -> None:
        super().__post_init__()
        if -2 * self.compensation >= (width := min(self.stack.size[:2])):
            raise SliceError(
                f"compensation {self.compensation:g} mm: nothing is left of an object {width:.3g} mm wide"
            )
        if self.printer:
            check_fits(self.stack, self.printer, max(self.compensation, 0.0))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of a picture."""
        if not self.printer:
            return self._grown
        across, along = self.printer.pixels
        return (across, along) if self.printer.portrait else (along, across)

    def picture(self, layer: Layer) -> np.ndarray:
        """Picture of a layer.

        Returns uint8 [rows, columns].
        """
        image = np.zeros(self.shape, np.uint8)
        bed, mine = self._bed(image), self._place
        bed[mine.on_bed] = self._graded(self._changed(layer)[mine.of_layer])
        return image

    def _graded(self, coverage: np.ndarray) -> np.ndarray:
        """Grey levels of coverages, uint8. A table of bytes is looked up faster in bytes than by an array."""
        table = self._levels.tobytes()
        if table == bytes(range(256)):
            return coverage
        return np.frombuffer(coverage.tobytes().translate(table), np.uint8).reshape(coverage.shape)

    def _changed(self, layer: Layer) -> np.ndarray:
        """Coverage after compensations and blur, uint8, in the shape of `_grown`."""
        coverage = layer.coverage
        if any(self._margin):
            coverage = np.pad(coverage, [(n, n) for n in self._margin])
        if self.compensation:
            coverage = compensate(coverage, self.compensation, self.stack.pixel)
        if foot := self._foot_of(layer):
            coverage = shrink(coverage, foot, self.stack.pixel)
        if self.blur:
            coverage = blur(coverage, self.blur)
        return coverage

    def encoded(self, layer: Layer, encoding: Encoding, shown: np.ndarray | None = None) -> bytes:
        """Encode the picture of a layer.

        A section without compensation and blur is encoded from its tiles, as runs of equal pixels, and the
        picture is never allocated.

        `shown`: uint8 [256], optional.
        """
        if not self._is_direct or not layer.is_tiled or self._foot_of(layer):
            image = self.picture(layer)
            return encoded(image if shown is None else shown[image], encoding)
        view = self._view
        if shown is not None:
            view = view._replace(levels=shown[self._levels].tobytes())
        return layer.encoded(view, encoding)

    def pictures(self, encoding: Encoding) -> Pictures | None:
        """Pictures for `Slicer.map` to make; None if they are not made of the samples alone."""
        return (self._view, encoding) if self._is_direct and not any(self.foot) else None

    def _foot_of(self, layer: Layer) -> float:
        """Distance by which the outlines of a bottom layer move inwards, mm."""
        return self.elephant_foot * self.foot[layer.index] if layer.index < len(self.foot) else 0.0

    @property
    def _is_direct(self) -> bool:
        """True if a pixel depends on the coverage of one pixel."""
        return not (self.compensation or self.blur)

    @cached_property
    def _margin(self) -> tuple[int, int]:
        """Rows and columns on each side of a layer that compensation and blur reach."""
        width, height = (math.ceil(max(self.compensation, 0.0) / side) for side in self.stack.pixel)
        return height + self.blur, width + self.blur

    @property
    def _grown(self) -> tuple[int, int]:
        """Rows and columns of a layer with its margin."""
        (rows, columns), (above, beside) = self.stack.shape, self._margin
        return rows + 2 * above, columns + 2 * beside

    @cached_property
    def _view(self) -> ScreenView:
        """The screen for native code."""
        mine = self._place
        at = [on.start - of.start for on, of in zip(mine.on_bed, mine.of_layer, strict=True)]
        backwards = self.mirrored != self._portrait
        place = at[0], at[1]
        levels = self._levels.tobytes()
        return ScreenView(self.shape, self._portrait, backwards, place, self.stack.shape, levels)

    @cached_property
    def _levels(self) -> np.ndarray:
        """Grey level for each coverage, uint8 [256]."""
        shares = np.rint(self.levels * (np.arange(256) / 255) ** self.gamma) / self.levels
        return np.rint(255 * shares).astype(np.uint8)

    @cached_property
    def _place(self) -> _Window:
        """The layer centred on the bed; it may be a few empty pixels larger than the bed."""
        bed = self.printer.pixels[::-1] if self.printer else self._grown
        on_bed, of_layer = [], []
        for mine, available in zip(self._grown, bed, strict=True):
            first, count = (available - mine) // 2, min(mine, available)
            on_bed.append(slice(max(first, 0), max(first, 0) + count))
            of_layer.append(slice(max(-first, 0), max(-first, 0) + count))
        return _Window((on_bed[0], on_bed[1]), (of_layer[0], of_layer[1]))

    @property
    def _portrait(self) -> bool:
        """True if rows of the picture run along x of the bed."""
        return bool(self.printer and self.printer.portrait)

    @property
    def mirrored(self) -> bool:
        """True if the picture is mirrored along x."""
        return self.mirror if self.mirror is not None else bool(self.printer and self.printer.mirror)

    def _bed(self, image: np.ndarray) -> np.ndarray:
        """View of a picture as seen from above, row 0 at the front."""
        if self._portrait:
            return image[::-1].T if self.mirrored else image[::-1, ::-1].T
        return image[::-1, ::-1] if self.mirrored else image[::-1]


@dataclass(frozen=True)
class _Window:
    """Where a layer lies on the bed: rows and columns of the bed, and those of the layer that they show."""

    on_bed: tuple[slice, slice]
    of_layer: tuple[slice, slice]


def check_fits(stack: Stack, printer: Printer, grown: float = 0.0) -> None:
    """Check that the object fits a printer.

    `grown` in mm.
    """
    x, y, z = stack.size
    size = x + 2 * grown, y + 2 * grown, z
    for axis, mine, most in zip("xyz", size, printer.build_volume, strict=True):
        if mine > most * (1 + 1e-6):
            raise SliceError(
                f"the object is {mine:.6g} mm along {axis}, the {printer.title} has {most:.6g} mm"
            )


def blur(image: NDArray[np.uint8], radius: int) -> NDArray[np.uint8]:
    """Mean over squares of pixels; beyond its borders the picture is black.

    `image`: uint8 [rows, columns]. Returns uint8 [rows, columns].
    """
    side = 2 * radius + 1
    sums = np.pad(image, ((radius + 1, radius), (radius + 1, radius))).astype(np.uint32)
    for axis in (0, 1):
        sums = np.cumsum(sums, axis, out=sums)
    means = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    return ((means + side * side // 2) // (side * side)).astype(np.uint8)


def compensate(image: np.ndarray, by: float, pixel: tuple[float, float]) -> np.ndarray:
    """Move the outlines of a coverage image outwards.

    A pixel's coverage is taken as its distance to the outline, in pixels, and grows with that distance: grey
    dilation with a cone. Exact for outlines along an axis, within a fifth of a pixel for all others.

    `image`: uint8 [ny, nx]; `by` in mm; `pixel`: width and height of a pixel, mm. Returns uint8 [ny, nx].
    """
    unit = math.sqrt(pixel[0] * pixel[1])
    amount, reach = abs(by) / unit, math.ceil(abs(by) / min(pixel)) + 1
    dy, dx = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    cone = 255 * (amount - np.hypot(dy * pixel[1], dx * pixel[0]) / unit)
    grown = dilated(image if by > 0 else 255 - image, cone)
    return grown if by > 0 else 255 - grown


def shrink(image: np.ndarray, by: float, pixel: tuple[float, float]) -> np.ndarray:
    """Move the outlines of a coverage image inwards; what is so thin that nothing would be left stays.

    `image`: uint8 [ny, nx]; `by` in mm; `pixel`: width and height of a pixel, mm. Returns uint8 [ny, nx].
    """
    less = compensate(image, -by, pixel)
    regained = compensate(less, by + 2 * max(pixel), pixel)
    return np.where(regained < image, image, less)


CELLS, CELL, CAPTION, FRAMES, ABREAST = 24, 200, 120, 60, 3
INK = np.array([(24, 26, 33), (240, 196, 105)], float)
ALARM = (214, 60, 60)


def thumbnail(layer: Layer) -> Image:
    """Shrink a layer's coverage by box averaging, in colour.

    Returns at most `CELL` pixels along a side.
    """
    from PIL import Image

    whole = Image.fromarray(np.ascontiguousarray(layer.coverage[::-1]))
    small = whole.resize(_square(layer.stack, CELL), Image.Resampling.BOX)
    share = np.asarray(small, float)[..., None] / 255
    return Image.fromarray(np.uint8(INK[0] + share * (INK[1] - INK[0])))


def _square(stack: Stack, most: float = math.inf) -> tuple[int, int]:
    """Width and height of a layer's picture with square pixels, at most `most` along a side."""
    (ny, nx), (across, along) = stack.shape, stack.pixel
    width, height = nx * across, ny * along
    side = max(min(across, along), max(width, height) / most)
    return max(round(width / side), 1), max(round(height / side), 1)


def _spread_layers(layers: range, count: int) -> list[int]:
    """At most `count` of the layers, evenly spaced, each in the middle of its interval."""
    total = len(layers)
    return sorted(layers[int((i + 0.5) * total / min(count, total))] for i in range(min(count, total)))


def contact_sheet(
    stack: Stack, file: BinaryIO, work: Work | None = None, layers: range | None = None
) -> None:
    """Write a PNG with 24 layers, evenly spaced, each with its height above the bed."""
    chosen = _spread_layers(range(len(stack.z)) if layers is None else layers, CELLS)
    images = list(Slicer(stack, work or Work()).map(thumbnail, chosen))
    _sheet(stack, chosen, images, math.ceil(math.sqrt(1.5 * max(len(images), 1)))).save(file, "PNG")


def _sheet(stack: Stack, layers: Sequence[int], images: Sequence[Image], across: int) -> Image:
    """Thumbnails in rows, each with its caption."""
    from PIL import Image, ImageDraw

    width = max([CAPTION, *(i.width for i in images)]) + 8
    height = max([0, *(i.height for i in images)]) + 24
    sheet = Image.new("RGB", (across * width + 8, -(-len(images) // across) * height + 8), "white")
    draw = ImageDraw.Draw(sheet)
    for n, (index, image) in enumerate(zip(layers, images, strict=True)):
        x, y = 8 + n % across * width, 8 + n // across * height
        sheet.paste(image, (x, y))
        draw.text((x, y + image.height + 2), f"layer {index}, {stack.tops[index]:.2f} mm", "black")
    return sheet


def animation(stack: Stack, file: BinaryIO, work: Work | None = None) -> None:
    """Write an endless animated WebP that climbs through up to 60 layers in three seconds."""
    chosen = _spread_layers(range(len(stack.z)), FRAMES)
    frames = list(Slicer(stack, work or Work()).map(thumbnail, chosen))
    frames[0].save(file, "WEBP", save_all=True, append_images=frames[1:], duration=50, loop=0, lossless=True)


def worst_layers(stack: Stack, layers: Sequence[int], file: BinaryIO, work: Work | None = None) -> None:
    """Write a PNG of layers at full resolution, pixels with nothing below them in red."""
    from PIL import Image

    layers = layers or [0]
    wanted = sorted({n for k in layers for n in (max(k - 1, 0), k)})
    solid = dict(zip(wanted, Slicer(stack, work or Work()).map(_solid, wanted), strict=True))
    pictures = []
    for k in layers:
        bare = solid[k] & ~solid[k - 1] if k else np.zeros_like(solid[k])
        colours = np.array([INK[0], INK[1], ALARM], np.uint8)
        picture = Image.fromarray(colours[solid[k] + 1 * bare][::-1])
        pictures.append(picture.resize(_square(stack), Image.Resampling.NEAREST))
    _sheet(stack, layers, pictures, min(len(layers), ABREAST)).save(file, "PNG")


ROWS = 480
"""Layers of an elevation, at most, and its height, pixels."""

XRAY = np.array([(225, 222, 215), (60, 58, 54)], float)
"""Colours of an elevation where the way through the object is short, and where it is longest, sRGB."""

HELD = (60, 130, 200)
"""Colour of supports, sRGB."""


def elevations(stack: Stack, marks: Sequence[FeatureBox], file: BinaryIO, work: Work | None = None) -> None:
    """Write a PNG from the front and from the right: an object as by X-rays, its supports and boxes."""
    from PIL import Image, ImageDraw

    work, chosen = work or Work(), _spread_layers(range(len(stack.z)), ROWS)

    def sides(layer: Layer) -> list[np.ndarray]:
        own, whole = _solid(layer.own if isinstance(layer, SupportedLayer) else layer), _solid(layer)
        return [np.asarray(solid.mean(axis)) for axis in (0, 1) for solid in (own, whole)]

    seen = [np.array(rows) for rows in zip(*Slicer(stack, work).map(sides, chosen), strict=True)]
    share, pictures = ROWS / float(stack.tops[-1]), []
    for axis, (own, whole) in enumerate((seen[:2], seen[2:])):
        across = own.shape[1] * stack.pixel[axis] * share
        shades = XRAY[0] + (own / max(own.max(), 1e-9))[..., None] * (XRAY[1] - XRAY[0])
        shades[own == 0] = np.where((whole > 0)[..., None], HELD, 255)[own == 0]
        shown = Image.fromarray(shades.astype(np.uint8)[::-1])
        picture = shown.resize((max(round(across), 1), ROWS), Image.Resampling.BOX)
        draw = ImageDraw.Draw(picture)
        for kind, low, top in marks:
            left, right = (across / 2 + share * corner[axis] for corner in (low, top))
            upper, lower = (ROWS - share * corner[2] for corner in (top, low))
            wider = 2 * list(MARKS).index(kind)  # boxes of two kinds around the same
            box = left - wider, upper - wider, right + wider, lower + wider
            draw.rectangle(box, outline=MARKS[kind], width=2)
        pictures.append(picture)
    both = Image.new("RGB", (sum(p.width for p in pictures) + 8, ROWS), "white")
    both.paste(pictures[0], (0, 0))
    both.paste(pictures[1], (pictures[0].width + 8, 0))
    both.save(file, "PNG")


def _solid(layer: Layer) -> np.ndarray:
    """Pixels of a layer that are at least half covered."""
    return layer.coverage >= 128


WIDTH, HEIGHT, MARGIN = 720, 220, 40
"""Size of the plot and the space for its labels, pixels."""

_STYLE = "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}img,svg{max-width:100%}"


def page(
    title: str,
    lines: Sequence[str],
    verdict: str,
    problems: Sequence[str],
    tops: NDArray[np.float64],
    areas: NDArray[np.float64],
    picture: bytes,
    sides: bytes,
    marks: Sequence[FeatureBox],
    views: Sequence[bytes] = (),
) -> bytes:
    """Compose a summary page.

    `tops`, `areas`: float64 [n], mm, mm2; `picture`: PNG of `worst_layers`, `sides`: of `elevations`,
    `views`: of the object.
    """
    shown = [f'<img alt="The object" width="48%" src="{_source(view)}">' for view in views]
    text = [
        "<!DOCTYPE html>",
        f'<html lang="en"><meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>',
        f"<h1>{escape(title)}</h1>",
        *(f"<p>{escape(line)}</p>" for line in lines),
        f"<h2>{escape(verdict.capitalize())}</h2>",
        *(["<ul>", *(f"<li>{escape(problem)}</li>" for problem in problems), "</ul>"] if problems else []),
        *(["<h2>The object</h2>", "<p>Red hangs in the air, orange is thin.</p>", *shown] if shown else []),
        "<h2>From the front and from the right</h2>",
        f"<p>{_legend(marks)}</p>",
        f'<img alt="From the front and from the right" src="{_source(sides)}">',
        "<h2>Cross-section over height</h2>",
        "<p>The force that peels a layer from the film grows with its area.</p>",
        plot(tops, areas),
        "<h2>Worst layers</h2>",
        "<p>Red has nothing below it.</p>",
        f'<img alt="Worst layers" src="{_source(picture)}">',
        "</html>",
    ]
    return "\n".join([*text, ""]).encode()


def _legend(marks: Sequence[FeatureBox]) -> str:
    """What the boxes of an elevation are around, in their colours; supports are blue."""
    boxes = [f'<span style="color:rgb{MARKS[kind]}">{text}</span>' for kind, text in counted(marks).items()]
    return "As by X-rays; supports are blue. " + (f"Boxes: {', '.join(boxes)}." if boxes else "")


def _source(picture: bytes) -> str:
    """A PNG as the source of an image."""
    return f"data:image/png;base64,{b64encode(picture).decode('ascii')}"


def plot(tops: NDArray[np.float64], areas: NDArray[np.float64]) -> str:
    """Plot areas over height as SVG.

    `tops`, `areas`: float64 [n], mm, mm2.
    """
    most, high = max(float(areas.max(initial=0)), 1e-9), float(tops[-1])
    inner, tall = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    column = np.minimum((tops / high * inner).astype(int), inner - 1)
    largest = np.full(inner, -1.0)
    np.maximum.at(largest, column, areas)
    shown = np.flatnonzero(largest >= 0)
    points = " ".join(f"{MARGIN + x},{MARGIN + tall * (1 - largest[x] / most):.1f}" for x in shown.tolist())
    bottom, label = HEIGHT - MARGIN, HEIGHT - MARGIN / 2
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" font-size="12">'
        f'<path d="M{MARGIN} {MARGIN}V{bottom}H{WIDTH - MARGIN}" fill="none" stroke="#888"/>'
        f'<polyline points="{points}" fill="none" stroke="#b25"/>'
        f'<text x="{MARGIN}" y="{MARGIN - 8}">{most:.4g} mm2</text>'
        f'<text x="{MARGIN}" y="{label}">0</text>'
        f'<text x="{WIDTH - MARGIN}" y="{label}" text-anchor="end">{high:.4g} mm</text></svg>'
    )
