"""Fewer triangles, within a tolerance that is proved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh
from fracslice.work import Work

if TYPE_CHECKING:
    from fracslice.mesh.collapse import Collapsed

ROUNDS, PATIENT = 20, 2
"""How often it is tried, and how often of these a fault only lowers what is allowed there: after that the
original is put back around it, farther each time."""

AIM = 0.95
"""The share of the tolerance that vertices may spend; triangles between them need the rest."""


@dataclass(frozen=True)
class Simplified:
    """What a simplification did. from_triangles: how many there were. bound_mm: every point of the original
    is within it of the simplified surface, proved. back_mm: no sample of the simplified surface is farther
    from the original. Both are at most tolerance_mm."""

    tolerance_mm: float
    from_triangles: int
    bound_mm: float
    back_mm: float


def simplify(mesh: Mesh, tolerance: float, work: Work | None = None) -> tuple[Mesh, Simplified]:
    """The mesh with fewer triangles, nowhere farther than `tolerance` (mm) from the original.

    mesh: a closed, oriented 2-manifold without crossings. The result is one too, of the same topology; its
    vertices are some of the original's, so that they stay on the surface and on sharp edges. What is done is
    checked: a bound on the distance of every original triangle, the distance back at samples half an edge
    apart, crossings, and that no shell is inside out. Where that fails less is allowed, at last nothing, and
    all is done again. Raises `MeshError` for a mesh that is not a closed manifold, or if that comes to no
    end, and `Cancelled`.
    """
    from fracslice.mesh.collapse import collapsed
    from fracslice.mesh.links import links

    work = work or Work()
    if not 0 < tolerance < float("inf"):
        raise MeshError(f"tolerance {tolerance:g}: expected a finite number above zero")
    _, *defects = links(mesh.triangles, len(mesh.vertices))
    if any(defects) or not len(mesh.triangles):
        raise MeshError("only a closed, oriented manifold can be simplified")
    allowed = np.full(len(mesh.vertices), AIM * tolerance)
    for patience in range(PATIENT, PATIENT - ROUNDS, -1):
        found = collapsed(mesh, allowed)
        work.check()
        coarse = Mesh(mesh.vertices, found.triangles)
        faulty, bound, back = _examined(mesh, coarse, found, tolerance, work)
        if not faulty.any():
            done = Simplified(tolerance, len(mesh.triangles), bound, back)
            return coarse.selected(np.ones(len(found.triangles), dtype=bool)), done
        fault = faulty[found.owner]
        fault[found.triangles[faulty]] = True
        for _ in range(-patience):
            fault[mesh.triangles[fault[mesh.triangles].any(axis=1)]] = True
        allowed[fault] *= 0.25 if patience > 0 else 0.0
    raise MeshError(f"the mesh cannot be simplified within {tolerance:g} mm without crossing itself")


def _examined(
    mesh: Mesh, coarse: Mesh, found: Collapsed, tolerance: float, work: Work
) -> tuple[NDArray[np.bool_], float, float]:
    """Which triangles of the simplified mesh are at fault, and the distances there and back."""
    from fracslice.mesh.crossings import crossing_triangles
    from fracslice.mesh.nearest import distance_bounds, sampled_distances
    from fracslice.mesh.tree import build

    tree = build(coarse)
    gone = Mesh(mesh.vertices, mesh.triangles[found.changed])
    bounds = distance_bounds(gone, coarse, tolerance, work, tree)
    fresh = Mesh(mesh.vertices, found.triangles[found.fresh])
    back = sampled_distances(fresh, mesh, _edge(mesh) / 2, work)
    faulty = crossing_triangles(coarse, tree, work.threads) | _turned(mesh, coarse)
    faulty[found.fresh] |= back > tolerance
    faulty[found.owner[gone.triangles[np.isinf(bounds)]]] = True
    work.check()
    return faulty, float(bounds.max(initial=0.0)), float(back.max(initial=0.0))


def _turned(mesh: Mesh, coarse: Mesh) -> NDArray[np.bool_]:
    """The triangles of shells that are inside out: a crumb that fewer triangles cannot hold open."""
    from fracslice.mesh.links import parts, shell_volumes

    labels, count = parts(mesh.triangles, len(mesh.vertices))
    shell = np.zeros(len(mesh.vertices), labels.dtype)
    shell[mesh.triangles] = labels[:, None]
    left = shell[coarse.triangles[:, 0]]
    before = shell_volumes(mesh.vertices, mesh.triangles, labels, count)
    after = shell_volumes(mesh.vertices, coarse.triangles, left, count)
    turned: NDArray[np.bool_] = ((before < 0) != (after < 0))[left]
    return turned


def _edge(mesh: Mesh) -> float:
    """The median length of an edge."""
    a, b = mesh.vertices[mesh.triangles[:, 0]], mesh.vertices[mesh.triangles[:, 1]]
    return float(np.median(np.linalg.norm(a - b, axis=1)))
