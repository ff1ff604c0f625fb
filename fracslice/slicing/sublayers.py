"""Layers whose grey levels are shares of their height: the mean of sections at several heights within each.

A section in the middle of a layer gives stairs on a slope. The mean of n sections, by the midpoint rule, is
the share of a pixel's volume in the layer that is inside, to 1/2n.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from .layers import SLAB, Layer, Slicer
from .slab import Pictures
from .stack import Stack

T = TypeVar("T")

COUNTS = tuple(n for n in (1, 2, 4, 8) if SLAB % n == 0)
"""Possible numbers of sections: all of a layer are in one slab."""


@dataclass(frozen=True, eq=False)
class MeanSlicer(Slicer):
    """Slicer whose layers have the mean coverage of several sections.

    Attributes
    ----------
    sections : int
        Sections per layer, one of `COUNTS`.
    """

    sections: int = 1

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

        def section(layer: Layer) -> list[T]:
            index, k = divmod(layer.index, n)
            coverage, area = sums.pop(index, (0, 0.0))
            total = coverage + layer.coverage.astype(np.uint16), area + layer.area
            if k < n - 1:
                sums[index] = total
                return []
            self.areas[index] = total[1] / n
            mean = ((total[0] + n // 2) // n).astype(np.uint8)
            return [make(replace(layer, stack=self.stack, index=index, mean=(mean, self.areas[index])))]

        sections = [n * index + k for index in chosen for k in range(n)]
        for made in Slicer(_sections(self.stack, n), self.work).map(section, sections):
            yield from made


def _sections(stack: Stack, n: int) -> Stack:
    """Stack with a layer for each section."""
    shares = (np.arange(n) + 0.5) / n
    heights = np.repeat(stack.heights, n) / n
    bottoms = stack.tops - stack.heights
    within = (bottoms[:, None] + shares * stack.heights[:, None]).ravel()
    z = stack.z[0] + (within - stack.heights[0] / 2) / stack.scale
    return replace(stack, z=z, tops=np.cumsum(heights))
