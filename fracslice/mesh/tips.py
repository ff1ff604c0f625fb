"""Sharp tips of a solid beyond its last samples, where the sampled mesh is blunt."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..volume import Plan
from ..volume.climbing import SLANTS, climb
from ..volume.evaluation import values_at
from ..work import Work
from .caps import Cap, Rings, best, capped, disjoint, spans
from .contouring import Piece
from .fit import Fit
from .model import Mesh
from .pieces import Pieces
from .pointed_vertices import POINTED
from .quantisation import quantise, used
from .self_intersections import self_intersecting_triangles

MOST_TIPS = 64
"""Maximum number of tips that are added."""

ABOVE, STEP = 0.002, 0.25
"""Height of a start point above its triangle, and first step of the climb, voxels."""

ASIDE = np.array([(*way, -POINTED) for way in product((-1, 0, 1), repeat=2) if any(way)]).T
"""Sideways and downward steps from a tip. At a tip all of them leave the solid; along the rim of a disk, or a
ridge, some do not.
"""

ROUGHLY, EXACT = 0.03, 1e-7
"""Last step of the first climbs, voxels, and of the last climbs, relative to the size of the object."""

SAME = 0.05
"""Minimum distance of a tip from the mesh, voxels."""

REACH = 8.0
"""Radius around pointed vertices and tips within which triangles are examined, voxels."""


def with_tips(
    planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work
) -> tuple[Pieces, NDArray[np.float64]]:
    """Replace blunt ends of a surface by the tips of the solid.

    If the solid continues above a triangle at a pointed vertex, its farthest point is located. The triangles
    that face this tip are replaced by a fan around it, if the fan is nowhere farther from the surface than
    they are. The surface stays closed and free of self-intersections. A rough surface, for example of a
    fractal, is not changed. The fans are the last triangles of their pieces; pieces that a fan spans are
    joined.

    Parameters
    ----------
    planned : Plan
        Sampled field.
    pieces : Pieces
        Pieces of a closed, oriented 2-manifold with vertices on the zero set of the field, scene units.
    points : ndarray of float64, shape (n, 3)
        Its pointed vertices.
    work : Work
        Threads and cancellation.

    Returns
    -------
    Pieces
        The surface with tips.
    ndarray of float64, shape (k, 3)
        The tips, scene units.

    Raises
    ------
    Cancelled
        If the work is cancelled.
    """
    caps = _caps(planned, pieces, points, work) if len(points) else []
    if not caps:
        return pieces, np.empty((0, 3))
    made, near = pieces.anew(), planned.voxel / 2
    for first, last in spans(caps, pieces, near):
        mesh, start = pieces.together(first, last, near), pieces.starts[first]
        own = [Cap(c.old - start, c.fan) for c in caps if 0 <= c.old[0] - start < len(mesh.triangles)]
        fresh = sum(len(cap.fan) for cap in own)
        made.add(Piece(capped(mesh, own) if own else mesh, pieces.ends[last - 1]), fresh)
    return made, np.array([cap.fan[0, 2] for cap in caps])


def _caps(planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work) -> list[Cap]:
    """Caps of all tips; triangle indices count from the first piece on."""
    root, voxel = planned.root, planned.voxel
    tips = _tips_beyond(planned, pieces, points, work)
    if not tips:
        return []
    ends, places = (np.array(rows) for rows in list(zip(*tips, strict=True))[1:])
    mesh, numbers = pieces.near(_between(ends, places, REACH * voxel), REACH * voxel)
    rings, fit = Rings(mesh), Fit(root, STEP * voxel, voxel, work)
    caps_of_tips = [
        best(rings.caps(vertex, tip.place), tip.gain, mesh, fit, voxel)
        for vertex, tip in zip(rings.at(ends), tips, strict=True)
    ]
    caps = disjoint([cap for cap in caps_of_tips if cap], len(mesh.triangles))
    while caps:
        work.check()
        wrong = _crossing(mesh, caps, work)
        if not wrong:
            break
        caps = [cap for number, cap in enumerate(caps) if number not in wrong]
    return [Cap(numbers[cap.old], cap.fan) for cap in caps]


def _crossing(mesh: Mesh, caps: list[Cap], work: Work) -> set[int]:
    """Caps whose fans intersect each other or the mesh after quantisation."""
    made = capped(mesh, caps)
    of_cap = np.repeat(np.arange(len(caps)), [len(cap.fan) for cap in caps])
    of_cap = np.concatenate([np.full(len(made.triangles) - len(of_cap), -1), of_cap])
    as_written = quantise(made, used(made), threads=work.threads).mesh
    crossing = self_intersecting_triangles(as_written, threads=work.threads, among=of_cap >= 0)
    return set(of_cap[crossing].tolist()) - {-1}


class Tip(NamedTuple):
    """A tip beyond the mesh.

    Attributes
    ----------
    gain : float
        Height of the tip above the nearest vertex.
    end : ndarray of float64, shape (3,)
        Nearest vertex.
    place : ndarray of float64, shape (3,)
        Position of the tip.
    """

    gain: float
    end: NDArray[np.float64]
    place: NDArray[np.float64]


def _tips_beyond(planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work) -> list[Tip]:
    """Tips beyond pointed vertices, the highest one first."""
    kernel, voxel = planned.root.kernel("cpu", "float64"), planned.voxel
    exact = EXACT * max(planned.box.size)

    def inside(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        inside: NDArray[np.bool_] = values_at(kernel, np.ascontiguousarray(points), work) < 0
        return inside

    def climbed(starts: NDArray[np.float64], ups: NDArray[np.float64], last: float) -> NDArray[np.float64]:
        steps = np.einsum("nij,jw->inw", _frames(_unit(ups)), SLANTS)
        return climb(kernel, starts.T[..., None], steps, STEP * voxel, last, work)[..., 0].T

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
    """A corner, a point just above the triangle and its unit normal, [n, 3] each, for each triangle at some
    vertices.
    """
    mesh, _ = pieces.near(points, REACH * voxel)
    rings = Rings(mesh)
    seats = mesh.corners[rings.around(rings.at(points))]
    ups = _unit(np.cross(seats[:, 1] - seats[:, 0], seats[:, 2] - seats[:, 0]))
    return seats[:, 0], seats.mean(axis=1) + ABOVE * voxel * ups, ups


def _nearest(
    pieces: Pieces, ends: NDArray[np.float64], tips: NDArray[np.float64], voxel: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Vertices near tips, reached from `ends` along edges, each once, with the highest of its tips and the
    upward direction.
    """
    mesh, _ = pieces.near(_between(ends, tips, REACH * voxel), REACH * voxel)
    rings = Rings(mesh)
    nearest = rings.nearest(rings.at(ends), tips)
    once, tips, ups = _highest(nearest, tips, tips - rings.middles(nearest))
    return mesh.vertices[once], tips, ups


def _between(starts: NDArray[np.float64], ends: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Points on the segments between start and end points, at most a step apart."""
    count = 2 + int(np.linalg.norm(ends - starts, axis=1).max() / step)
    return np.linspace(starts, ends, count).reshape(-1, 3)


def _highest(
    ends: NDArray[np.int64], tips: NDArray[np.float64], ups: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Distinct ends, the highest tip of each, and the upward direction there."""
    once, which = np.unique(ends, return_inverse=True)
    up = np.zeros((len(once), 3))
    np.add.at(up, which, ups)
    up = _unit(up)
    order = np.lexsort([-(tips * up[which]).sum(axis=1), which])
    first = order[np.searchsorted(which[order], np.arange(len(once)))]
    return once, tips[first], up


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalised vectors."""
    unit: NDArray[np.float64] = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]
    return unit


def _frames(ups: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations from the z axis to unit vectors, [n, 3, 3]."""
    aside = np.eye(3)[np.abs(ups).argmin(axis=1)]
    first = _unit(np.cross(aside, ups))
    return np.stack([first, np.cross(ups, first), ups], axis=2)
