"""Contours of a layer as nested, oriented polygons in mm, projected to the zero set."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .._slices import Slab
from ..common.digits import counted
from ..kernel import Kernel
from .stack import Stack

# Pictures need no contours: what traces them is imported where needed.
if TYPE_CHECKING:
    from .section import CrossSection, Vertices

ROUNDS = 20
"""Maximum number of steps of false position."""

PRECISE = 1e-3
"""Maximum distance between a crossing and the zero set, pixels."""


@dataclass(frozen=True, eq=False)
class Contours:
    """Closed polygons without intersections, outer ones counter-clockwise, holes clockwise.

    Their points are crossings of the pixel lattice and, between these, sharp corners or bends of the outline.

    Attributes
    ----------
    points : float64 [n, 2]
        mm from the middle of the object's box, x to the right and y to the back.
    starts : int32 [m + 1]
        Polygon i has the points ``starts[i]:starts[i + 1]``; the first is not repeated.
    parent : int32 [m]
        The innermost polygon around each, -1 for none. A parent comes before its children.
    """

    points: np.ndarray
    starts: np.ndarray
    parent: np.ndarray

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {counted(len(self), 'polygon')}, {self.area:.6g} mm2>"

    def __len__(self) -> int:
        return len(self.parent)

    def __getitem__(self, i: int) -> np.ndarray:
        return self.points[self.starts[i] : self.starts[i + 1]]

    @property
    def areas(self) -> np.ndarray:
        """Signed areas in mm^2, float64 [m]: positive for outer contours, negative for holes."""
        if not len(self):
            return np.zeros(0)
        following = np.arange(1, len(self.points) + 1)
        following[self.starts[1:] - 1] = self.starts[:-1]
        x, y = self.points.T
        return np.add.reduceat(x * y[following] - y * x[following], self.starts[:-1]) / 2

    @property
    def area(self) -> float:
        """Total inside area, mm^2."""
        return float(self.areas.sum())


def contours(slab: Slab, k: int, z: float, stack: Stack, exact: Kernel) -> Contours:
    """Extract the contours of a layer.

    Parameters
    ----------
    slab : Slab
        Sampled layers.
    k : int
        Layer in the slab.
    z : float
        Its height, scene units.
    stack : Stack
        The planned layers.
    exact : Kernel
        float64 kernel that refines the crossings.

    Returns
    -------
    Contours
        The polygons.
    """
    from .section import CrossSection, Vertices

    edges, ends = slab.crossings(k)
    following, section = edges[:, 3], CrossSection(exact, z, stack.frame)
    order, starts = _cycles(following)
    along = refined(section, edges, ends)
    # Never at an end of the edge: several contours, or branches of one, would meet there.
    along = np.clip(along, PRECISE, 1 - PRECISE)
    points = edges[:, :2] + along[:, None] * np.eye(2)[edges[:, 2]]
    vertices = Vertices(points, np.arange(len(points)), np.zeros(len(points)))
    if len(points) and not stack.root.escape_time_only:
        vertices += _turns(points, edges, section)
    places = (vertices.points - np.array(stack.shape[::-1]) / 2) * stack.pixel
    return _nested(replace(vertices, points=places), order, starts, edges, ends[:, 0] < 0)


def _turns(points: np.ndarray, edges: np.ndarray, section: CrossSection) -> Vertices:
    """Corners and bends between crossings."""
    from .bends import bends
    from .corners import corners

    following, middles = edges[:, 3], edges[:, :2] + 0.5 * np.eye(2)[edges[:, 2]]
    pixels = np.floor((middles + middles[following]) / 2).astype(int)
    sharp = corners(points, following, pixels, section)
    return sharp + bends(points, following, pixels, sharp, section)


def _cycles(following: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cycles of a permutation, each from its lowest number on: order [n], starts [m + 1]."""
    steps, seen, order, starts = following.tolist(), bytearray(len(following)), [], [0]
    for first in range(len(steps)):
        at = first
        while not seen[at]:
            seen[at] = 1
            order.append(at)
            at = steps[at]
        if len(order) > starts[-1]:
            starts.append(len(order))
    return np.array(order, np.int32), np.array(starts, np.int32)


def refined(section: CrossSection, edges: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Refine the crossings of edges to `PRECISE`.

    False position with the Illinois rule (Dowell and Jarratt 1971), on all edges at once; converged ones are
    left out.

    Parameters
    ----------
    section : CrossSection
        The field in the plane of the layer.
    edges : int32 [n, 4]
        Column, row, direction and next edge, as of `Slab.crossings`.
    ends : float64 [n, 2]
        Values at both ends.

    Returns
    -------
    float64 [n]
        Position on the edge, 0 to 1.
    """
    base, step = edges[:, :2].astype(float), np.eye(2)[edges[:, 2]]
    lo, hi = np.zeros(len(edges)), np.ones(len(edges))
    f_lo, f_hi = ends[:, 0].copy(), ends[:, 1].copy()
    best = f_lo / (f_lo - f_hi)
    moved = np.zeros(len(edges), np.int8)
    todo = np.arange(len(edges))
    for _ in range(ROUNDS):
        if not len(todo):
            break
        t = best[todo]
        f = section(base[todo] + t[:, None] * step[todo])
        left = (f < 0) == (f_lo[todo] < 0)
        a = np.where(left, f, np.where(moved[todo] == 2, f_lo[todo] / 2, f_lo[todo]))
        b = np.where(left, np.where(moved[todo] == 1, f_hi[todo] / 2, f_hi[todo]), f)
        lo[todo], hi[todo] = np.where(left, t, lo[todo]), np.where(left, hi[todo], t)
        f_lo[todo], f_hi[todo], moved[todo] = a, b, np.where(left, 1, 2)
        new = lo[todo] + (hi[todo] - lo[todo]) * a / np.where(a == b, 1.0, a - b)
        best[todo] = new
        todo = todo[(np.abs(new - t) > PRECISE / 2) & (f != 0)]
    return np.asarray(best)


def _nested(
    vertices: Vertices, order: np.ndarray, starts: np.ndarray, edges: np.ndarray, leaves: np.ndarray
) -> Contours:
    """Contours in the order of their lowest, leftmost crossing of a row of samples, each with its parent.

    The crossing to the left of that one in its row is on the parent or on a sibling, depending on whether the
    solid begins or ends there (as in Suzuki and Abe 1985, "Topological structural analysis of digitized
    binary images").
    """
    count = len(starts) - 1
    loop = np.empty(len(order), np.int32)
    loop[order] = np.repeat(np.arange(count), np.diff(starts))
    rows = np.flatnonzero(edges[:, 2] == 0)
    rows = rows[np.lexsort((edges[rows, 0], edges[rows, 1]))]
    loops, first = np.unique(loop[rows], return_index=True)
    turn = np.argsort(first)
    new = np.empty(count, np.int32)
    new[loops[turn]] = np.arange(count)
    parent = np.full(count, -1, np.int32)
    is_hole = np.zeros(count, bool)
    for i, at in enumerate(first[turn]):
        is_hole[i] = leaves[rows[at]]
        if at == 0 or edges[rows[at - 1], 1] != edges[rows[at], 1]:
            continue
        beside = new[loop[rows[at - 1]]]
        parent[i] = beside if is_hole[beside] != is_hole[i] else parent[beside]
    pieces = [order[starts[i] : starts[i + 1]] for i in loops[turn]]
    place = np.empty(len(order), np.int64)
    place[np.concatenate([order[:0], *pieces])] = np.arange(len(order))
    before = np.concatenate([[0], np.cumsum(np.bincount(place[vertices.after], minlength=len(order)))])
    ends = np.concatenate([[0], np.cumsum([len(p) for p in pieces])]).astype(int)
    along = np.lexsort([vertices.share, place[vertices.after]])
    return Contours(vertices.points[along], before[ends].astype(np.int32), parent)
