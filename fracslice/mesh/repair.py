"""Repair of triangle models that are no solid, by MeshLab's filters: what is done, and what changed.

Bodies that overlap are united, and triangles that cut each other replaced, by the winding number (Zhou,
Grinspun, Zorin and Jacobson, "Mesh Arrangements for Solid Geometry", 2016).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import connected_components
from ..common.messages import format_count, lacking
from ..errors import MeshError
from .checks import MeshReport, check_mesh
from .cleaning import quantise_mesh
from .model import Mesh, component_sizes
from .shells import nesting

LARGEST = 1 << 20
"""Most edges of a hole that is closed: all there are."""


@dataclass(frozen=True)
class Repaired:
    """A repaired mesh."""

    mesh: Mesh  # its coordinates are float32
    report: MeshReport  # check of the mesh
    changes: tuple[str, ...]  # what was changed, in order


def repair(mesh: Mesh) -> Repaired:
    """Make a solid of a mesh, as far as possible: only faults are touched, one kind after the other.

    `mesh` in mm, as `read_mesh` returns it.
    """
    if reason := lacking("pymeshlab", "repairs need"):
        raise MeshError(reason)
    changes = []
    for step in STEPS:
        mended, change = step(mesh)
        if change:
            mesh = quantise_mesh(mended)
            changes.append(change)
        if not len(mesh.triangles):
            raise MeshError(f"nothing is left of it: {', '.join(changes)}")
    return Repaired(mesh, check_mesh(mesh), tuple(changes))


Step = Callable[[Mesh], tuple[Mesh, str]]


def _without_doubles(mesh: Mesh) -> tuple[Mesh, str]:
    """Remove triangles that have a corner twice, and all but the first of those with the same corners."""
    corners = np.sort(mesh.triangles, axis=1)
    whole = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    first = np.zeros(len(corners), bool)
    first[np.unique(corners, axis=0, return_index=True)[1]] = True
    keep = whole & first
    return mesh.selected(keep), _counted(len(keep) - int(keep.sum()), "repeated or empty triangle", "removed")


def _without_fins(mesh: Mesh) -> tuple[Mesh, str]:
    """Remove triangles that hang on an edge of two others, and then those that hung on them."""
    before = len(mesh.triangles)
    while True:
        edges = _Edges.of(mesh)
        hanging = (edges.uses == 1).any(1) & (edges.uses > 2).any(1)
        if not hanging.any():
            return mesh, _counted(before - len(mesh.triangles), "hanging triangle", "removed")
        mesh = mesh.selected(~hanging)


def _without_branches(mesh: Mesh) -> tuple[Mesh, str]:
    """Remove the smallest triangles at edges of more than two."""
    if not (_Edges.of(mesh).uses > 2).any():
        return mesh, ""
    made = _filtered(mesh, lambda lab: lab.meshing_repair_non_manifold_edges(method="Remove Faces"))
    lost = len(mesh.triangles) - len(made.triangles)
    return made, _counted(lost, "triangle", "removed at edges of more than two")


def _turned_alike(mesh: Mesh) -> tuple[Mesh, str]:
    """Give adjacent triangles the same sense, that of most of them."""
    if not check_mesh(mesh).misoriented_edges:
        return mesh, ""
    made = _filtered(mesh, lambda lab: lab.meshing_re_orient_faces_coherently())
    turned = _senses(made) != _senses(mesh)
    if 2 * turned.sum() > len(turned):
        made, turned = Mesh(made.vertices, made.triangles[:, ::-1]), ~turned
    return made, _counted(int(turned.sum()), "triangle", "turned")


def _closed(mesh: Mesh) -> tuple[Mesh, str]:
    """Close holes; at T-vertices, whose holes have no area, turn edges."""
    holes = _Edges.of(mesh).holes(mesh)
    if not holes:
        return mesh, ""
    made = _filtered(mesh, lambda lab: lab.meshing_close_holes(maxholesize=LARGEST, selfintersection=False))
    more = len(made.triangles) - len(mesh.triangles)
    if not more:
        return mesh, ""
    change = f"{_counted(holes, 'hole', 'closed')} with {format_count(more, 'triangle')}"
    if made.sizes(0).flat[0]:
        made = _filtered(made, lambda lab: lab.meshing_remove_t_vertices(method="Edge Flip"))
        change += ", T-vertices joined"
    return made, change


def _turned_outwards(mesh: Mesh) -> tuple[Mesh, str]:
    """Turn shells inside out that are in no body."""
    labels, count = connected_components(mesh.triangles, len(mesh.vertices), 0)
    volumes = component_sizes(mesh.vertices, mesh.triangles, labels, count).volumes
    wrong = (volumes < 0) & (nesting(mesh, labels, volumes).winding <= 0)
    turned = wrong[labels[mesh.triangles[:, 0]]]
    triangles = np.where(turned[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    return Mesh(mesh.vertices, triangles), _counted(int(wrong.sum()), "shell", "turned outwards")


def _united(mesh: Mesh) -> tuple[Mesh, str]:
    """Replace triangles that cut others by the surface around all that the mesh winds around."""
    report = check_mesh(mesh)
    if not (report.self_intersections or report.misplaced_shells) or report.open_edges:
        return mesh, ""
    made = _filtered(mesh, lambda lab: lab.generate_boolean_union(first_mesh=0, second_mesh=0))
    if report.self_intersections:
        return made, _counted(report.self_intersections, "triangle", "that cut or touched others replaced")
    return made, _counted(report.misplaced_shells, "shell", "within another body removed")


STEPS: tuple[Step, ...] = (
    _without_doubles,
    _without_fins,
    _without_branches,
    _turned_alike,
    _closed,
    _without_doubles,
    _turned_outwards,
    _united,
    _united,  # of coordinates that were rounded
)
"""Each takes a mesh and returns it with what changed; without a change, an empty text."""


def _counted(count: int, thing: str, done: str) -> str:
    """Text on a number of changes; empty without any."""
    return f"{format_count(count, thing)} {done}" if count else ""


def _filtered(mesh: Mesh, use: Callable[[Any], object]) -> Mesh:
    """Mesh after a filter of MeshLab."""
    import pymeshlab

    lab = pymeshlab.MeshSet(verbose=False)
    lab.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.triangles))
    try:
        use(lab)
    except pymeshlab.PyMeshLabException:  # it cannot work on this mesh, which stays as it is
        return mesh
    made = lab.current_mesh()
    return Mesh(np.array(made.vertex_matrix()), np.array(made.face_matrix(), np.int32))


def _senses(mesh: Mesh) -> NDArray[np.bool_]:
    """Whether the corners of each triangle ascend in one sense or in the other."""
    a, b, c = mesh.triangles.T
    senses: NDArray[np.bool_] = (a < b) ^ (b < c) ^ (c < a)
    return senses


class _Edges(NamedTuple):
    """Edges of a mesh."""

    number: NDArray[np.int64]  # edge of each side of the triangles, [m, 3]
    uses: NDArray[np.int64]  # triangles at it

    @classmethod
    def of(cls, mesh: Mesh) -> _Edges:
        sides = np.sort(np.stack([mesh.triangles, np.roll(mesh.triangles, -1, 1)], -1).reshape(-1, 2), 1)
        _, number, counts = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        number = number.reshape(-1, 3)
        return cls(number, counts[number])

    def holes(self, mesh: Mesh) -> int:
        """Number of connected chains of open edges."""
        sides = np.stack([mesh.triangles, np.roll(mesh.triangles, -1, 1)], -1)[self.uses == 1]
        if not len(sides):
            return 0
        used, ends = np.unique(sides, return_inverse=True)
        ends = ends.reshape(-1, 2).astype(np.int32)
        chains = np.concatenate([ends, ends[:, :1]], 1)
        return int(connected_components(np.ascontiguousarray(chains), len(used), 0)[1])
