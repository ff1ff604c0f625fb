"""Edge flips towards a Delaunay triangulation, where the field permits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fit import OFF, UPRIGHT, Fitted
from .model import Mesh
from .subdivision import edges_of

ROUNDS = 12
"""Maximum rounds of independent flips."""

FINE = np.cos(np.radians(10))
"""Cosine between the normals of a triangle and of the field down to which a flip may reduce it."""

STEEP, BETTER = np.cos(np.radians(29)), 0.02
"""Triangles with a smaller cosine than `STEEP` are flipped only if the smaller of both cosines grows by more
than `BETTER`.
"""

OBTUSE = 1e-6
"""An edge is flipped if the sine of the sum of its opposite angles is below the negative of this."""


class Flips(NamedTuple):
    """Candidate flips.

    Attributes
    ----------
    old : ndarray of int64, shape (k, 2)
        The two triangles at each edge.
    new : ndarray of int32, shape (k, 2, 3)
        Corners of the triangles that replace them.
    ends : ndarray of int32, shape (k, 2)
        End points of the new edge, ascending.
    """

    old: NDArray[np.int64]
    new: NDArray[np.int32]
    ends: NDArray[np.int32]

    def some(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Flips:
        """Select flips.

        Parameters
        ----------
        which : ndarray of bool, shape (k,), or of int64, shape (j,)
            Mask or indices.
        """
        return Flips(self.old[which], self.new[which], self.ends[which])


def flip(state: Fitted, due: NDArray[np.bool_]) -> tuple[Fitted, NDArray[np.bool_]]:
    """Flip edges whose opposite angles sum up to more than 180 degrees.

    An edge stays if the flip would increase the angle between a triangle's normal and the field's, for
    example at a sharp edge, or the distance from the surface.

    Parameters
    ----------
    state : Fitted
        The mesh with its measures.
    due : ndarray of bool, shape (m,)
        Triangles to start at.

    Returns
    -------
    Fitted
        The mesh with flipped edges.
    ndarray of bool, shape (m,)
        True for each changed triangle.
    """
    triangles, measured = state.mesh.triangles.copy(), state.measured.copy()
    mesh = Mesh(state.mesh.vertices, triangles)
    changed = np.zeros(len(measured), bool)
    for _ in range(ROUNDS):
        flips, worth = _candidates(mesh, due, measured[:, UPRIGHT] < STEEP)
        flips = flips.some(_independent(flips, worth, len(measured)))
        if not len(flips.old):
            break
        before = measured[flips.old]
        after = state.fit.triangles(mesh.vertices[flips.new].reshape(-1, 3, 3)).reshape(
            -1, 2, before.shape[2]
        )
        was, now = before[..., UPRIGHT].min(axis=1), after[..., UPRIGHT].min(axis=1)
        good = np.where(was < STEEP, now > was + BETTER, now >= np.minimum(was, FINE))
        good &= after[..., OFF].max(axis=1) <= np.maximum(before[..., OFF].max(axis=1), state.fit.reach)
        flips = flips.some(good)
        triangles[flips.old], measured[flips.old] = flips.new, after[good]
        due = np.zeros(len(measured), bool)
        changed[flips.old] = due[flips.old] = True
    return Fitted(mesh, state.fit, measured), changed


def _candidates(
    mesh: Mesh, due: NDArray[np.bool_], steep: NDArray[np.bool_]
) -> tuple[Flips, NDArray[np.float64]]:
    """Candidate flips at due triangles and their worth: edges with too large opposite angles, and edges of
    steep triangles. A smaller worth is better.
    """
    near = np.zeros(len(mesh.vertices), bool)
    near[mesh.triangles[due]] = True
    some = np.flatnonzero(near[mesh.triangles].any(axis=1))
    edges = edges_of(mesh.triangles[some])
    order = np.argsort(edges.sides.ravel(), kind="stable")
    at = edges.sides.ravel()[order]
    first = np.flatnonzero(at[1:] == at[:-1])
    half = np.stack([order[first], order[first + 1]], axis=1)
    old = some[half // 3]
    half = half[due[old].any(axis=1)]
    old, side = some[half // 3], half % 3
    a, b, c = (mesh.triangles[old[:, 0], (side[:, 0] + k) % 3] for k in range(3))
    d = mesh.triangles[old[:, 1], (side[:, 1] + 2) % 3]
    worth = _sine_of_sum(mesh.vertices, a, b, c, d)
    new = np.stack([np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)], axis=1)
    ends = np.sort(np.stack([c, d], axis=1), axis=1)
    worth = np.where(steep[old].any(axis=1), worth - 2, worth)
    kept = np.flatnonzero((worth < -OBTUSE) & (c != d))
    kept = kept[~np.isin(ends[kept].astype(np.int64) @ [1 << 32, 1], edges.keys)]
    return Flips(old, new, ends).some(kept), worth[kept]


def _sine_of_sum(p: NDArray[np.float64], a, b, c, d) -> NDArray[np.float64]:  # type: ignore[no-untyped-def]
    """Sine of the sum of the angles at c and d, opposite to the edge (a, b)."""
    parts = []
    for tip in (c, d):
        u, v = p[a] - p[tip], p[b] - p[tip]
        size = np.maximum(np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1), 1e-300)
        parts.append(((u * v).sum(axis=1) / size, np.linalg.norm(np.cross(u, v), axis=1) / size))
    (cos_c, sin_c), (cos_d, sin_d) = parts
    result: NDArray[np.float64] = sin_c * cos_d + cos_c * sin_d
    return result


def _independent(flips: Flips, worth: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Independent flips: the best one of each triangle, with no triangle or new edge in common."""
    order = np.argsort(worth, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    best = np.full(count, len(order), np.int64)
    np.minimum.at(best, flips.old.ravel(), np.repeat(rank, 2))
    own = np.flatnonzero((best[flips.old] == rank[:, None]).all(axis=1))
    _, first = np.unique(flips.ends[own].astype(np.int64) @ [1 << 32, 1], return_index=True)
    return own[np.sort(first)]
