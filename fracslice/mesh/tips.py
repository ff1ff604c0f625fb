"""The tips that lie beyond the last samples: a mesh of samples is blunt there."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import pointed
from ..volume import Plan
from ..volume.climbing import SLANTS, climb
from ..volume.values import values_at
from ..work import Work
from .caps import Cap, Rings, apart, best, capped
from .extract import Piece
from .fit import Fit
from .model import Mesh
from .pieces import NOTHING, Pieces, joined
from .quantisation import quantise
from .self_intersections import self_intersecting_triangles

POINTED = 0.15
"""The sine of the angle by which all edges at a pointed vertex fall off, at least."""

MANY, MOST_TIPS = 512, 64
"""Pointed vertices at most: else the surface is rough, and has no end of tips. Tips that are looked at."""

ABOVE, STEP = 0.002, 0.25
"""Voxels above a triangle where the solid goes on; the first steps from there outwards."""

ASIDE = np.array([(*way, -POINTED) for way in product((-1, 0, 1), repeat=2) if any(way)]).T
"""From a tip: no way there stays in the solid. Along the rim of a disk, or a ridge, some do."""

ROUGHLY, EXACT = 0.03, 1e-7
"""Voxels: the last step of the first ways outwards; of the mesh's size: that of the last ones."""

SAME = 0.05
"""Voxels: a mesh that ends so near a tip reaches it."""

REACH = 8.0
"""Voxels around pointed vertices and tips: triangles that are looked at."""


class Pointed:
    """The pointed vertices of a surface that comes in pieces."""

    def __init__(self, voxel: float, threads: int = 0) -> None:
        self._voxel, self._threads, self._points = voxel, threads, list[NDArray[np.float64]]()
        self._near, self._seam = NOTHING, -np.inf

    def add(self, piece: Piece) -> None:
        """Take in a piece: vertices near its end are looked at with the next one."""
        mesh, voxel = piece.mesh, self._voxel
        if len(self._near.triangles):
            mesh = joined(self._near, mesh, self._seam, voxel / 2)
        at = mesh.vertices[pointed(mesh.vertices, mesh.triangles, POINTED, self._threads)]
        low, high = self._seam - 2 * voxel, piece.end - 2 * voxel
        self._points.append(at[(low <= at[:, 0]) & (at[:, 0] < high)])
        self._seam = piece.end
        if np.isfinite(piece.end):
            top = mesh.vertices[mesh.triangles, 0].max(axis=1)
            self._near = mesh.selected(top > piece.end - 5 * voxel)

    @property
    def points(self) -> NDArray[np.float64]:
        """Where they are, [n, 3]; none of a rough surface."""
        found = np.concatenate(self._points)
        return found if len(found) <= MANY else found[:0]


def with_tips(
    planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work
) -> tuple[Pieces, NDArray[np.float64]]:
    """The surface with the solid's own tips in place of blunt ends; and these, [k, 3].

    pieces: of a closed, oriented 2-manifold, its vertices on the zero set of the plan's field, a voxel apart.
    points: its pointed vertices. Where the solid goes on above a triangle at one, its farthest point is
    looked for, and what that sees from above is replaced by a fan around it, if the fan is nowhere farther
    from the surface than what it replaces. The surface stays closed, and does not cross itself. A rough
    surface, as of a fractal, stays as it is. The fans are the last triangles of their pieces; pieces that a
    fan spans become one. Raises `Cancelled`.
    """
    caps = _caps(planned, pieces, points, work) if len(points) else []
    if not caps:
        return pieces, np.empty((0, 3))
    made, near = Pieces(pieces.folder), planned.voxel / 2
    for first, last in _spans(caps, pieces, near):
        mesh, start = pieces.together(first, last, near), pieces.starts[first]
        own = [Cap(c.old - start, c.fan) for c in caps if 0 <= c.old[0] - start < len(mesh.triangles)]
        fresh = sum(len(cap.fan) for cap in own)
        made.add(Piece(capped(mesh, own) if own else mesh, pieces.ends[last - 1]), fresh)
    return made, np.array([cap.fan[0, 2] for cap in caps])


def _caps(planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work) -> list[Cap]:
    """What is replaced, by the numbers of triangles from the first piece on."""
    root, voxel = planned.root, planned.voxel
    tips = _found(planned, pieces, points, work)
    if not tips:
        return []
    ends, places = (np.array(rows) for rows in list(zip(*tips, strict=True))[1:])
    mesh, numbers = pieces.near(_between(ends, places, REACH * voxel), REACH * voxel)
    rings, fit = Rings(mesh), Fit(root, STEP * voxel, voxel, work)
    found = [
        best(rings.caps(vertex, tip.place), tip.gain, mesh, fit, voxel)
        for vertex, tip in zip(rings.at(ends), tips, strict=True)
    ]
    caps = apart([cap for cap in found if cap], len(mesh.triangles))
    while caps:
        work.check()
        wrong = _crossing(mesh, caps, work)
        if not wrong:
            break
        caps = [cap for number, cap in enumerate(caps) if number not in wrong]
    return [Cap(numbers[cap.old], cap.fan) for cap in caps]


def _crossing(mesh: Mesh, caps: list[Cap], work: Work) -> set[int]:
    """The caps whose fans cross others or the mesh, as a file holds them."""
    made = capped(mesh, caps)
    of_cap = np.repeat(np.arange(len(caps)), [len(cap.fan) for cap in caps])
    of_cap = np.concatenate([np.full(len(made.triangles) - len(of_cap), -1), of_cap])
    as_written = Mesh(quantise(made, threads=work.threads)[0], made.triangles)
    crossing = self_intersecting_triangles(as_written, threads=work.threads, among=of_cap >= 0)
    return set(of_cap[crossing].tolist()) - {-1}


def _spans(caps: list[Cap], pieces: Pieces, near: float) -> Iterator[tuple[int, int]]:
    """Which pieces, first to last - 1, become one: those that a fan, or what it replaces, spans."""
    x = np.array([(cap.fan[..., 0].min() - near, cap.fan[..., 0].max() + near) for cap in caps])
    old = np.array([(cap.old.min(), cap.old.max()) for cap in caps])
    own = np.searchsorted(pieces.ends, x), np.searchsorted(pieces.starts, old, side="right") - 1
    firsts, lasts = np.minimum(*own)[:, 0], np.maximum(*own)[:, 1]
    begin = 0
    for number in range(1, len(pieces) + 1):
        if not ((firsts < number) & (number <= lasts)).any():
            yield begin, number
            begin = number


class Tip(NamedTuple):
    """A tip beyond the mesh: how far it is from the nearest vertex, that, and where the tip is."""

    gain: float
    end: NDArray[np.float64]
    place: NDArray[np.float64]


def _found(planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work) -> list[Tip]:
    """Tips beyond pointed vertices, the farthest one first."""
    kernel, voxel = planned.root.kernel("cpu", "float64"), planned.voxel
    exact = EXACT * max(planned.box.size)

    def inside(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        found: NDArray[np.bool_] = values_at(kernel, np.ascontiguousarray(points), work) < 0
        return found

    def climbed(starts: NDArray[np.float64], ups: NDArray[np.float64], last: float) -> NDArray[np.float64]:
        ways = np.einsum("nij,jw->inw", _frames(_unit(ups)), SLANTS)
        return climb(inside, starts.T[..., None], ways, STEP * voxel, last)[..., 0].T

    ends, starts, ups = _above(pieces, points, voxel)
    on = inside(starts.T)
    if not on.any():
        return []
    ends, tips = ends[on], climbed(starts[on], ups[on], ROUGHLY * voxel)
    for last in (ROUGHLY * voxel, exact, exact):
        ends, tips, ups = _nearest(pieces, ends, tips, voxel)
        tips = climbed(tips, ups, last)
    ends, tips, ups = _nearest(pieces, ends, tips, voxel)
    gain = ((tips - ends) * ups).sum(axis=1)
    aside = tips.T[..., None] + STEP * voxel * np.einsum("nij,jw->inw", _frames(ups), ASIDE)
    falls = ~inside(aside.reshape(3, -1)).reshape(aside.shape[1:]).any(axis=1)
    order = np.lexsort([*tips.T[::-1], -gain])
    order = order[((gain > SAME * voxel) & falls)[order]][:MOST_TIPS]
    return [Tip(float(gain[k]), ends[k], tips[k]) for k in order]


def _above(
    pieces: Pieces, points: NDArray[np.float64], voxel: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Of the triangles at some vertices, [n, 3] each: a corner, a point just above, and what is upwards."""
    mesh, _ = pieces.near(points, REACH * voxel)
    rings = Rings(mesh)
    seats = mesh.corners[rings.around(rings.at(points))]
    ups = _unit(np.cross(seats[:, 1] - seats[:, 0], seats[:, 2] - seats[:, 0]))
    return seats[:, 0], seats.mean(axis=1) + ABOVE * voxel * ups, ups


def _nearest(
    pieces: Pieces, ends: NDArray[np.float64], tips: NDArray[np.float64], voxel: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The vertices near tips that ways from `ends` lead to, each once, with the highest of its tips; and what
    is upwards there."""
    mesh, _ = pieces.near(_between(ends, tips, REACH * voxel), REACH * voxel)
    rings = Rings(mesh)
    found = rings.nearest(rings.at(ends), tips)
    once, tips, ups = _highest(found, tips, tips - rings.middles(found))
    return mesh.vertices[once], tips, ups


def _between(starts: NDArray[np.float64], ends: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Points on the ways between others, no farther apart than a step."""
    count = 2 + int(np.linalg.norm(ends - starts, axis=1).max() / step)
    return np.linspace(starts, ends, count).reshape(-1, 3)


def _highest(
    ends: NDArray[np.int64], tips: NDArray[np.float64], ups: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Each end once, with the highest of its tips, and what is upwards there."""
    once, which = np.unique(ends, return_inverse=True)
    up = np.zeros((len(once), 3))
    np.add.at(up, which, ups)
    up = _unit(up)
    order = np.lexsort([-(tips * up[which]).sum(axis=1), which])
    first = order[np.searchsorted(which[order], np.arange(len(once)))]
    return once, tips[first], up


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    found: NDArray[np.float64] = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]
    return found


def _frames(ups: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations that turn z to unit vectors, [n, 3, 3]."""
    aside = np.eye(3)[np.abs(ups).argmin(axis=1)]
    first = _unit(np.cross(aside, ups))
    return np.stack([first, np.cross(ups, first), ups], axis=2)
