"""Layers in order, computed in parallel, slab by slab, and released once read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from .._slices import Encoding, Slab
from ..kernel import Kernel
from ..work import Work
from .contours import Contours, contours
from .slab import Encoded, Pictures, Sampler, ScreenView
from .stack import Stack

if TYPE_CHECKING:
    from .runs import Runs

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
    exact : Kernel
        float64 kernel of the field.
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
    exact: Kernel
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
        data, area, cut = self.picture or self.slab.picture(self.place, *view, encoding)
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
        from .runs import Runs  # needs Numba, which a job does without

        rows, runs, area, cut = self.slab.runs(self.place, self.stack.shape)
        self._painted = area, cut
        begin, end = np.ascontiguousarray(runs.T)
        return Runs(rows, begin, end, self.stack.shape[1])

    @cached_property
    def _painted(self) -> tuple[float, int]:
        """Inside area in pixels, and number of pixels that the contour cuts."""
        return self.slab.paint(self.place, np.zeros(self.stack.shape, np.uint8))

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
        return contours(self.slab, self.place, float(self.stack.z[self.index]), self.stack, self.exact)


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
        root, shape = self.stack.root, self.stack.shape
        exact = root.kernel("cpu", "float64")
        lattice = shape[0] + 1, shape[1] + 1
        sampler = Sampler(root.kernel(), root, root.bounds, self.stack.frame, lattice)
        chosen = range(len(self.stack.z)) if layers is None else layers

        def slab(group: list[int]) -> list[T]:
            made = []
            for layer in self._sampled(sampler, group, exact, pictures):
                made.append(make(layer))
                if (area := layer.known_area) is not None:
                    self.areas[layer.index] = area
            return made

        groups = [list(g) for _, g in groupby(chosen, lambda index: index // SLAB)]
        for done, made in enumerate(self.work.ordered(slab, groups), 1):
            yield from made
            self.work.progress("slicing", done / len(groups))

    def _sampled(
        self, sampler: Sampler, group: list[int], exact: Kernel, pictures: Pictures | None
    ) -> Iterator[Layer]:
        """Layers of one slab; each is to be read before the next."""
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
                yield Layer(self.stack, index, spent, slab, index - first, exact, picture=picture)
            group = group[len(sampled) :]
