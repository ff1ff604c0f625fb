"""Compiled loops that label the samples of connected components."""

from __future__ import annotations

from ..common.compiled import compiled
from ..common.disjoint import unite
from ..volume.bricks import INSIDE


@compiled
def tally(labels, values, sizes, inside):  # type: ignore[no-untyped-def]
    """Count the samples of each component, and record its side."""
    for row in range(len(labels)):
        for s in range(512):
            sizes[labels[row, s]] += 1
            inside[labels[row, s]] = values[row, s] < 0


@compiled
def count_crossings(values, index, ijk, labels, crossings):  # type: ignore[no-untyped-def]
    """Count the grid edges between different signs, each for its inside component.

    index: as padded by one outside brick behind all sides.
    """
    for row in range(len(values)):
        x, y, z = ijk[row, 0] >> 3, ijk[row, 1] >> 3, ijk[row, 2] >> 3
        for axis in range(3):
            shift = 6 - 3 * axis
            after = index[x + (axis == 0), y + (axis == 1), z + (axis == 2)]
            for s in range(512):
                if (s >> shift) & 7 < 7:
                    other, t = row, s + (1 << shift)
                elif after >= 0:
                    other, t = after, s - (7 << shift)
                else:
                    continue
                if (values[row, s] < 0) != (values[other, t] < 0):
                    crossings[labels[row, s] if values[row, s] < 0 else labels[other, t]] += 1


@compiled
def unite_samples(values, index, ijk, tile, parent):  # type: ignore[no-untyped-def]
    """Unite each sample with those beside it and with unsampled bricks.

    index, tile: as padded by one outside brick on all sides; element of each unsampled brick.
    """
    for row in range(len(values)):
        x, y, z = (ijk[row, 0] >> 3) + 1, (ijk[row, 1] >> 3) + 1, (ijk[row, 2] >> 3) + 1
        for axis in range(3):
            shift, a, b, c = 6 - 3 * axis, axis == 0, axis == 1, axis == 2
            step = 1 << shift
            before, after = index[x - a, y - b, z - c], index[x + a, y + b, z + c]
            first, last = tile[x - a, y - b, z - c], tile[x + a, y + b, z + c]
            for s in range(512):
                here, element, at = values[row, s] < 0, 1 + 512 * row + s, (s >> shift) & 7
                if at < 7:
                    there, other = values[row, s + step] < 0, element + step
                elif after >= 0:
                    there, other = values[after, s - 7 * step] < 0, 1 + 512 * after + s - 7 * step
                else:
                    there, other = after == INSIDE, last
                if here == there and parent[element] != parent[other]:
                    unite(parent, element, other)
                if at == 0 and before < 0 and here == (before == INSIDE):
                    unite(parent, element, first)
