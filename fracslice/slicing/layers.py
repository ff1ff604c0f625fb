"""Layers in order, computed in parallel, slab by slab, and released once read.

`fracslice._slices` does the work; this module provides the bounds that it needs of a field. Blocks are
subdivided top down: of 64, 32 and 16 pixels over all layers of the slab, of 8 over a few of them, of 4 over
one or two. A block is dropped where ``|f| > bound * reach`` at its centre shows that no sample in it has the
other sign. In the remaining blocks of each layer, one sample of each block of 2 pixels is evaluated, then the
others, unless the bound of a value covers them. Closure follows: where two neighbours differ in sign and one
sign is only implied, that sample is evaluated. Nothing within a layer is evaluated twice.

Above 16 pixels the bound is the formula's own, which is proven or measured with a margin. Escape-time
fractals are far from it: their values are a fifth of the distance outside and a fiftieth inside (means on
Mandelbulbs and Julia sets), and subdivision to single pixels by that bound would cost more than the contours.
In a scene of fractals with a potential only, blocks of 16 are dropped by half of the bound outside and by a
tenth inside. Smaller blocks are dropped by the steepness of the field there, but not below `LIKELY`. Single
samples are dropped where two blocks around theirs all have one sign: inside, the signs around a sample are
better evidence of the distance to the surface than its value. Specks of a pixel or two are lost, below 0.1 %
of the area (tests/slicing/test_layers.py). Orbits that grow linearly, such as a Mandelbox, have values near
to the distance on both sides: there, and where a scene mixes fractals with other shapes, small blocks are
dropped by `MIXED` of the bound.

A section in the middle of a layer gives stairs on a slope. The mean of n sections, by the midpoint rule, is
the share of a pixel's volume in the layer that is inside, to 1/2n; of a resin whose penetration depth is
known, sections are weighted by the light that they need.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from .._slices import (
    Beams,
    BeamSlab,
    BorderError,
    Encoding,
    FieldSlab,
    Memory,
    ProbeBounds,
    Slab,
    plate_picture,
)
from ..common.arrays import dot
from ..errors import SliceError
from ..fields.box import Box
from ..fields.field import Bounds, Field, Kernel
from ..volume import Pillars
from ..volume.amount import Completeness, compare_volumes
from ..work import Work
from .contours import Contours, contours, gathered
from .stack import Stack, Standing

if TYPE_CHECKING:
    from .feature_graph import Runs


LIKELY = 0.06, 0.015
"""Minimum bounds for small blocks of a fractal, outside and inside, as fractions of its own bound."""

MIXED = 0.25
"""Fraction of the bound for small blocks of scenes with other shapes or linear growth."""


SOLID = 128
"""Least coverage of a pixel that counts as solid."""


class ScreenView(NamedTuple):
    """How a screen shows a layer, its back up."""

    shape: tuple[int, int]  # rows and columns of the picture
    transposed: bool  # rows of the picture run along y of the layer
    backwards: bool  # columns run from right to left
    # row and column of the layer's first pixel on the screen, seen from above, the first row in front
    at: tuple[int, int]
    layer: tuple[int, int]  # rows and columns of the layer
    levels: bytes  # grey level for each coverage, 256 bytes, the first 0, the last 255


Pictures = tuple[ScreenView, Encoding]
"""Pictures to make of layers: the screen that shows them, and their encoding."""

Encoded = tuple[bytes, float, int]
"""Encoded picture of a layer, its area in pixels, and the number of pixels that the contour cuts."""


class Sampler(ABC):
    """Samples slabs of a stack. Safe to use from many threads.

    `frame`: float64 [4], scene units; `shape`: rows and columns of the lattice.
    """

    def __init__(self, frame: np.ndarray, shape: tuple[int, int]) -> None:
        self.frame, self.shape = frame, shape
        self._memory = Memory()

    @abstractmethod
    def slab(self, z: np.ndarray) -> Slab:
        """Create a slab without samples.

        `z`: float64 [n], scene units.
        """

    @property
    def _lattice(self) -> tuple[float, float, float, float]:
        x0, y0, dx, dy = self.frame.tolist()
        return x0, y0, dx, dy

    def sample(self, slab: Slab, layer: int) -> int:
        """Sample a layer of a slab."""
        before = slab.evaluations
        with _within_the_rim():
            slab.sample(layer)
        return slab.evaluations - before

    def pictures(self, slab: Slab, layers: list[int], pictures: Pictures) -> list[tuple[int, Encoded]]:
        """Sample the first layers of some, as many as take 20 ms, and make their pictures."""
        view, encoding = pictures
        with _within_the_rim():
            return slab.pictures(layers, *view, encoding)


class FieldSampler(Sampler):
    """Samples a field.

    `kernel`: float32 kernel of `root`.
    """

    def __init__(
        self, kernel: Kernel, root: Field, bounds: Bounds, frame: np.ndarray, shape: tuple[int, int]
    ) -> None:
        super().__init__(frame, shape)
        self._entry, self._probe_bounds = kernel.entry, _probe_bounds(root, bounds)

    def slab(self, z: np.ndarray) -> Slab:
        """As `Sampler.slab`."""
        return FieldSlab(
            self._memory, self._entry, self._probe_bounds, self._lattice, z.tolist(), *self.shape
        )


class BeamSampler(Sampler):
    """Cuts pillars, without samples."""

    def __init__(self, pillars: Pillars, frame: np.ndarray, shape: tuple[int, int]) -> None:
        super().__init__(frame, shape)
        self._beams = Beams(pillars.beams, pillars.floor, pillars.raft)

    def slab(self, z: np.ndarray) -> Slab:
        """As `Sampler.slab`."""
        return BeamSlab(self._memory, self._beams, self._lattice, z.tolist(), *self.shape)


@contextmanager
def _within_the_rim() -> Iterator[None]:
    try:
        yield
    except BorderError as error:
        raise SliceError(f"{error}; give it finite <bounds>") from None


def _probe_bounds(root: Field, bounds: Bounds) -> ProbeBounds:
    """Bounds by which blocks are dropped."""
    bound, exterior_only = bounds.lipschitz, bounds.exterior_only
    if exterior_only and root.escape_time_only:
        return ProbeBounds(bound, bound * LIKELY[0], bound * LIKELY[1], True)
    likely = bound * MIXED if exterior_only else bound
    return ProbeBounds(bound, likely, likely, False)


SLAB = 8
"""Number of layers computed together."""


T = TypeVar("T")


@dataclass(eq=False)
class Layer:
    """One layer of a stack, to be read before the next one is sampled.

    Attributes
    ----------
    stack : Stack
        Its stack.
    index : int
        Its number in the stack.
    evaluations : float
        Approximate number of field evaluations for it.
    slab : Slab
        Samples.
    place : int
        Its number in the slab.
    mean : (uint8 [ny, nx], float) or None
        Mean coverage and area of several sections, in place of those of the one sampled, pixels and mm^2.
    picture : Encoded or None
        Picture that was made when the layer was sampled; nothing else can be read then.
    """

    stack: Stack
    index: int
    evaluations: float
    slab: Slab
    place: int
    mean: tuple[np.ndarray, float] | None = None
    picture: Encoded | None = None

    @property
    def top(self) -> float:
        """Upper face, mm above the object's lowest point."""
        return float(self.stack.tops[self.index])

    @property
    def height(self) -> float:
        """Layer height, mm."""
        return float(self.stack.heights[self.index])

    def encoded(self, view: ScreenView, encoding: Encoding) -> bytes:
        """Encode the layer as a screen shows it, from its tiles: the picture is never allocated.

        Parameters
        ----------
        view : ScreenView
            The screen.
        encoding : Encoding
            Encoding of the picture.

        Returns
        -------
        bytes
            Encoded picture.
        """
        data, area, cut = self.picture or self.slab.picture(self.place, *view, encoding, self.slabs[1:])
        self._painted = area, cut
        return data

    @cached_property
    def coverage(self) -> np.ndarray:
        """Coverage of each pixel, uint8 [ny, nx], 255 for full; row 0 is the front (lowest y).

        It is the area cut off by the outline, which is straight between its crossings of the pixel's sides,
        with a corner where it turns.
        """
        if self.mean is not None:
            return self.mean[0]
        image = np.zeros(self.stack.shape, np.uint8)
        self._painted = self.slab.paint(self.place, image)
        return image

    @cached_property
    def runs(self) -> Runs:
        """Solid pixels, at least half covered."""
        from .feature_graph import Runs

        rows, runs, area, cut = self.slab.runs(self.place, self.stack.shape)
        self._painted = area, cut
        begin, end = np.ascontiguousarray(runs.T)
        return Runs(rows, begin, end, self.stack.shape[1])

    @cached_property
    def _painted(self) -> tuple[float, int]:
        """Inside area in pixels, and number of pixels that the contour cuts."""
        return self.slab.paint(self.place, np.zeros(self.stack.shape, np.uint8))

    @property
    def is_tiled(self) -> bool:
        """True if pictures can be made of its tiles."""
        return self.mean is None

    @property
    def slabs(self) -> Sequence[Slab]:
        """What it is put together of."""
        return (self.slab,)

    @property
    def known_area(self) -> float | None:
        """Area in mm^2, of the coverage or else of the contours; None if neither was made."""
        made = vars(self)
        if "_painted" in made:
            return self.area
        return self.contours.area if "contours" in made else None

    @property
    def area(self) -> float:
        """Area in mm^2, from the coverage before rounding."""
        if self.mean is not None:
            return self.mean[1]
        return self._painted[0] * self.stack.pixel[0] * self.stack.pixel[1]

    @property
    def boundary(self) -> int:
        """Number of pixels that the contour cuts."""
        return self._painted[1]

    @cached_property
    def contours(self) -> Contours:
        """Polygons, each crossing within 0.001 pixels of the zero set."""
        return contours(self.slab, self.place, float(self.stack.z[self.index]), self.stack)


@dataclass(eq=False)
class PlateLayer(Layer):
    """A layer of a plate, put together of those of its parts."""

    parts: Sequence[tuple[Standing, Layer]] = ()  # parts that reach so high, and their layers

    @cached_property
    def coverage(self) -> np.ndarray:
        """As `Layer.coverage`."""
        if self.mean is not None:
            return self.mean[0]
        image = np.zeros(self.stack.shape, np.uint8)
        for part, layer in self.parts:
            (row, column), (rows, columns) = part.at, part.shape
            place = image[row : row + rows, column : column + columns]
            np.maximum(place, np.rot90(layer.coverage, -part.turns), out=place)
        self._painted = self._of_parts
        return image

    def encoded(self, view: ScreenView, encoding: Encoding) -> bytes:
        """As `Layer.encoded`."""
        data, area, cut = _put_together(self.parts, view, encoding)
        self._painted = area, cut
        return data

    @cached_property
    def runs(self) -> Runs:
        """As `Layer.runs`."""
        from .feature_graph import Runs

        solid = np.pad(self.coverage >= SOLID, ((0, 0), (1, 1)))
        row, begin = np.nonzero(solid[:, 1:] & ~solid[:, :-1])
        _, end = np.nonzero(solid[:, :-1] & ~solid[:, 1:])
        rows = np.searchsorted(row, np.arange(len(solid) + 1)).astype(np.int32)
        return Runs(rows, begin.astype(np.int32), end.astype(np.int32), self.stack.shape[1])

    @property
    def _of_parts(self) -> tuple[float, int]:
        pixel = self.stack.pixel[0] * self.stack.pixel[1]
        areas, cuts = zip(*((layer.area, layer.boundary) for _, layer in self.parts), strict=True)
        return sum(areas) / pixel, sum(cuts)

    @cached_property
    def _painted(self) -> tuple[float, int]:
        """As `Layer._painted`."""
        return self._of_parts

    @property
    def is_tiled(self) -> bool:
        """As `Layer.is_tiled`."""
        return self.mean is None and all(layer.is_tiled for _, layer in self.parts)

    @cached_property
    def contours(self) -> Contours:
        """As `Layer.contours`."""
        return gathered(
            [
                replace(layer.contours, points=part.moved(layer.contours.points, self.stack.shape))
                for part, layer in self.parts
            ]
        )


def _put_together(parts: Sequence[tuple[Standing, Layer]], view: ScreenView, encoding: Encoding) -> Encoded:
    """Picture of layers of parts."""
    shown: dict[tuple[int, int], tuple[Layer, Standing, list[tuple[int, int]]]] = {}
    for part, layer in parts:
        _, _, places = shown.setdefault((id(part.stack), part.turns), (layer, part, []))
        places.append(_place(part, view))
    pieces = [
        (layer.slabs, layer.place, *_orientation(part, view), places)
        for layer, part, places in shown.values()
    ]
    return plate_picture(pieces, view.shape, view.levels, encoding)


def _orientation(part: Standing, view: ScreenView) -> tuple[bool, bool, tuple[int, int], bool]:
    """How a screen shows a part: transposed, backwards, rows and columns of its lattice, and upside down.

    Down and across the picture are y and x of the plate, or x and y if the screen is transposed; of the part,
    a quarter turn exchanges them and changes the direction of one.
    """
    down, across = ((1, 2), (2, 3)) if view.transposed else ((2, 3), (1, 2))
    transposed = view.transposed != bool(part.turns % 2)
    return transposed, view.backwards != (part.turns in across), part.stack.shape, part.turns in down


def _place(part: Standing, view: ScreenView) -> tuple[int, int]:
    """Row and column of a picture of the first pixel of a part."""
    down, across = (1, 0) if view.transposed else (0, 1)
    row = view.shape[0] - view.at[down] - part.at[down] - part.shape[down]
    column = view.at[across] + part.at[across]
    return row, view.shape[1] - column - part.shape[across] if view.backwards else column


@dataclass(eq=False)
class SupportedLayer(Layer):
    """A layer of an object and of its supports, each sampled by itself: between supports, the object shows
    the same specks as alone. Contours are those of both together.
    """

    own: Layer = field(kw_only=True)
    supports: Layer = field(kw_only=True)
    slicer: Slicer = field(kw_only=True)

    @property
    def slabs(self) -> Sequence[Slab]:
        """See `Layer.slabs`."""
        return self.own.slab, self.supports.slab

    @cached_property
    def coverage(self) -> np.ndarray:
        """See `Layer.coverage`."""
        if self.mean is not None:
            return self.mean[0]
        covered: np.ndarray = np.maximum(self.own.coverage, self.supports.coverage)
        return covered

    @cached_property
    def runs(self) -> Runs:
        """See `Layer.runs`."""
        return self.own.runs | self.supports.runs

    @cached_property
    def _painted(self) -> tuple[float, int]:
        """See `Layer._painted`; what both cover is found by whole pixels."""
        own, supports = self.own.runs, self.supports.runs
        pixels = [int((runs.end - runs.begin).sum()) for runs in (own, supports, own | supports)]
        pixel = self.stack.pixel[0] * self.stack.pixel[1]
        area = (self.own.area + self.supports.area) / pixel - (pixels[0] + pixels[1] - pixels[2])
        return area, self.own.boundary + self.supports.boundary

    @cached_property
    def contours(self) -> Contours:
        """See `Layer.contours`."""
        sampler = self.slicer.whole
        slab = sampler.slab(self.stack.z[self.index : self.index + 1])
        sampler.sample(slab, 0)
        return contours(slab, 0, float(self.stack.z[self.index]), self.stack)


@dataclass(frozen=True, eq=False)
class Slicer:
    """Slices a planned stack.

    Attributes
    ----------
    stack : Stack
        The planned layers.
    work : Work
        Threads, progress and cancellation.
    areas : dict of int to float
        Area of each layer whose picture or contours were made, mm^2.
    """

    stack: Stack
    work: Work = field(default_factory=Work)
    areas: dict[int, float] = field(default_factory=dict, init=False)

    @cached_property
    def whole(self) -> Sampler:
        """Sampler of an object with its supports."""
        return _sampler(self.stack, self.stack.root)

    def map(
        self,
        make: Callable[[Layer], T],
        layers: Sequence[int] | None = None,
        pictures: Pictures | None = None,
    ) -> Iterator[T]:
        """Yield ``make(layer)`` for every layer, or for chosen ones.

        At most a few slabs are in memory at a time. Results do not depend on the number of threads.
        Exceptions of `make` propagate.

        Parameters
        ----------
        make : callable
            Runs in worker threads, and reads the layer before it returns.
        layers : sequence of int, optional
            Numbers of the layers, ascending; all if not given.
        pictures : Pictures, optional
            The pictures that `make` reads, if it reads nothing else. They are made several at a time, because
            threads that need the interpreter after each layer wait for each other.

        Returns
        -------
        iterator
            Results in the order of the layers.

        Raises
        ------
        SliceError
            If the solid reaches the rim of the lattice.
        Cancelled
            When the work is cancelled.
        """
        chosen = range(len(self.stack.z)) if layers is None else layers
        sampled = self._plate() if self.stack.parts else self._alone(pictures)

        def slab(group: list[int]) -> list[T]:
            made = []
            for layer in sampled(group):
                made.append(make(layer))
                if (area := layer.known_area) is not None:
                    self.areas[layer.index] = area
            return made

        groups = [list(g) for _, g in groupby(chosen, lambda index: index // SLAB)]
        for done, made in enumerate(self.work.ordered(slab, groups), 1):
            yield from made
            self.work.progress("slicing", done / len(groups))

    def _alone(self, pictures: Pictures | None) -> Callable[[list[int]], Iterator[Layer]]:
        """Function that samples layers of one slab of an object."""
        samplers = _samplers(self.stack)
        return partial(self._sampled, samplers, pictures=pictures)

    def _plate(self) -> Callable[[list[int]], Iterator[Layer]]:
        """Function that samples layers of one slab of a plate: each part once, however often it stands."""
        stack = self.stack
        alone = {id(part.stack): Slicer(part.stack, self.work)._alone(None) for part in stack.parts}
        layers = {id(part.stack): len(part.stack.z) for part in stack.parts}

        def sampled(group: list[int]) -> Iterator[Layer]:
            own = {k: make([n for n in group if n < layers[k]]) for k, make in alone.items()}
            for index in group:
                made = {k: next(of) for k, of in own.items() if index < layers[k]}
                parts = [(part, made[id(part.stack)]) for part in stack.parts if id(part.stack) in made]
                one = parts[0][1]
                spent = sum(layer.evaluations for layer in made.values())
                yield PlateLayer(stack, index, spent, one.slab, one.place, parts=parts)

        return sampled

    def _sampled(
        self, samplers: list[Sampler], group: list[int], pictures: Pictures | None
    ) -> Iterator[Layer]:
        """Layers of one slab; each is to be read before the next."""
        if len(samplers) > 1:
            own, others = (self._sampled([sampler], group, None) for sampler in samplers)
            for layer, supports in zip(own, others, strict=True):
                known = {name: getattr(layer, name) for name in ("index", "evaluations", "slab", "place")}
                known["evaluations"] += supports.evaluations
                yield SupportedLayer(self.stack, **known, own=layer, supports=supports, slicer=self)
            return
        (sampler,) = samplers
        first = group[0] // SLAB * SLAB
        slab = sampler.slab(self.stack.z[first : first + SLAB])
        while group:
            self.work.check()
            places = [index - first for index in group]
            sampled: Sequence[tuple[int, Encoded | None]]
            if pictures is None:
                sampled = [(sampler.sample(slab, places[0]), None)]
            else:
                sampled = sampler.pictures(slab, places, pictures)
            for index, (spent, picture) in zip(group, sampled, strict=False):
                yield Layer(self.stack, index, spent, slab, index - first, picture=picture)
            group = group[len(sampled) :]


def _samplers(stack: Stack) -> list[Sampler]:
    """Samplers of an object and of its supports, each by itself."""
    held = [BeamSampler(stack.supports.pillars, *_lattice(stack))] if stack.supports else []
    return [_sampler(stack, stack.object), *held]


def _sampler(stack: Stack, root: Field) -> Sampler:
    """Sampler of a field on the pixels of a stack."""
    return FieldSampler(root.kernel(), root, root.bounds, *_lattice(stack))


def _lattice(stack: Stack) -> tuple[np.ndarray, tuple[int, int]]:
    """Frame and points of a stack's lattice."""
    return stack.frame, (stack.shape[0] + 1, stack.shape[1] + 1)


@dataclass(frozen=True, eq=False)
class MeanSlicer(Slicer):
    """Slicer whose layers have the mean coverage of several sections."""

    sections: int = 1  # sections per layer, one of `SECTIONS`
    penetration: float = math.inf  # depth at which 1/e of the light is left, mm; infinity: all of it

    def map(
        self,
        make: Callable[[Layer], T],
        layers: Sequence[int] | None = None,
        pictures: Pictures | None = None,
    ) -> Iterator[T]:
        """As `Slicer.map`; contours of a layer are those of its highest section. Pictures show all sections,
        so that none is made when one section is sampled.
        """
        n, sums = self.sections, dict[int, tuple[np.ndarray, float]]()
        chosen = range(len(self.stack.z)) if layers is None else layers
        weights = {height: section_weights(height, n, self.penetration) for height in set(self._heights)}

        def section(layer: Layer) -> list[T]:
            index, k = divmod(layer.index, n)
            coverage, area = sums.pop(index, (0, 0.0))
            weight = np.uint32(weights[self._heights[index]][k])
            total = coverage + weight * layer.coverage, area + layer.area
            if k < n - 1:
                sums[index] = total
                return []
            self.areas[index] = total[1] / n
            mean = ((total[0] + WHOLE // 2) // WHOLE).astype(np.uint8)
            return [make(replace(layer, stack=self.stack, index=index, mean=(mean, self.areas[index])))]

        sections = [n * index + k for index in chosen for k in range(n)]
        for made in Slicer(_sections(self.stack, n), self.work).map(section, sections):
            yield from made

    @cached_property
    def _heights(self) -> list[float]:
        """Heights of the layers, mm."""
        return list(np.round(self.stack.heights, 9).tolist())


WHOLE = 1 << 16
"""Sum of the weights of the sections of a layer."""

CLEAR = 1e-6
"""Height of a layer by the penetration depth below which all sections have the same weight."""


def section_weights(height: float, n: int, penetration: float) -> list[int]:
    """Weights of the sections of a layer, from its lower face to the screen, with the sum `WHOLE`.

    The dose falls to 1/e within the penetration depth on its way from the screen (Jacobs 1992), and those of
    all layers above add up. So a face that looks down is cured where it should be, but for the same offset of
    all such faces, if (exp(d / p) - 1) / (exp(h / p) - 1) of a whole dose is for a share d / h of the layer.

    `height`: h, mm; `penetration`: p, mm, or infinity.
    """
    share = np.arange(n + 1) / n
    if height > CLEAR * penetration:
        share = np.expm1(share * height / penetration) / math.expm1(height / penetration)
    return list(np.diff(np.rint(WHOLE * share).astype(int))[::-1].tolist())


def _sections(stack: Stack, n: int) -> Stack:
    """Stack with a layer for each section."""
    shares = (np.arange(n) + 0.5) / n
    heights = np.repeat(stack.heights, n) / n
    bottoms = stack.tops - stack.heights
    within = (bottoms[:, None] + shares * stack.heights[:, None]).ravel()
    z = stack.z[0] + (within - stack.heights[0] / 2) / stack.scale
    parts = {id(part.stack): _sections(part.stack, n) for part in stack.parts}
    standing = tuple(replace(part, stack=parts[id(part.stack)]) for part in stack.parts)
    return replace(stack, z=z, tops=np.cumsum(heights), parts=standing)


SLABS = 6
"""Slabs of a stack whose volume is measured, evenly distributed."""


def layers_amount(slicer: Slicer, work: Work) -> Completeness:
    """Compare the volume of some slabs of a stack with that of its field. Supports, which are exact, are left
    out.
    """
    stack = slicer.stack
    if stack.supports:
        slicer = Slicer(replace(stack, root=stack.object, supports=None), work)
        stack = slicer.stack
    starts = np.arange(0, len(stack.z), SLAB)
    chosen = [s.tolist() for s in np.split(np.arange(len(stack.z)), starts[1:])]
    chosen = [
        chosen[k] for k in sorted(set(np.linspace(0, len(starts) - 1, SLABS).round().astype(int).tolist()))
    ]
    layers = [layer for slab in chosen for layer in slab]
    for _ in slicer.map(lambda layer: layer.area, [k for k in layers if k not in slicer.areas]):
        pass  # the slicer keeps the areas
    areas = np.array([slicer.areas[k] for k in layers])
    (x0, y0, dx, dy), height = stack.frame.tolist(), stack.heights / stack.scale
    low, high = stack.z - height / 2, stack.z + height / 2
    (left, front, _), (right, back, _) = stack.outer.lo, stack.outer.hi
    boxes = [Box((left, front, low[s[0]]), (right, back, high[s[-1]])) for s in chosen]
    least = float(stack.heights.min())

    def sampling(share: float) -> str:
        return f"pixels of {share * min(stack.pixel):.2g} mm and layers of {share * least:.2g} mm"

    grid = (x0, y0, float(stack.z[0])), (dx, dy, least / stack.scale), sampling
    made = dot(areas, stack.heights[layers])
    return compare_volumes(stack.root, boxes, made, stack.scale, grid, len(chosen) == len(starts), work)
