"""Fewer triangles, within a tolerance that is proved."""

from __future__ import annotations

from dataclasses import dataclass

from fracslice.errors import MeshError
from fracslice.formulas.parameters import Number, validated
from fracslice.mesh.model import Mesh
from fracslice.scene import parse_length
from fracslice.work import Work

ROUNDS, PATIENT = 200, 40
"""How often what is at fault is put back, and how often of these something else may be tried there."""

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
    """The mesh with fewer triangles, nowhere farther than `tolerance` (mm, or such as "0.02mm") from the
    original.

    mesh: a closed, oriented 2-manifold without crossings. The result is one too, of the same topology; its
    vertices are some of the original's, so that they stay on the surface and on sharp edges. What is done is
    checked: a bound on the distance of every original triangle, the distance back at samples half an edge
    apart, crossings, and that no shell is inside out. What fails is put back. Raises `MeshError` for a mesh
    that is not a closed manifold, or if that comes to no end, and `Cancelled`.
    """
    from fracslice.mesh.collapse import FIRST, Collapse
    from fracslice.mesh.examination import Examination
    from fracslice.mesh.topology import edge_topology

    work = work or Work()
    if isinstance(tolerance, str):
        tolerance = parse_length(tolerance, "tolerance")
    tolerance = validated("tolerance", tolerance, Number(None, "a length", above=0), MeshError)
    _, *defects = edge_topology(mesh.triangles, len(mesh.vertices))
    if any(defects) or not len(mesh.triangles):
        raise MeshError("only a closed, oriented manifold can be simplified")
    collapse, examination = Collapse(mesh, AIM * tolerance), Examination(mesh, tolerance, work)
    for number in range(ROUNDS):
        if number < PATIENT:
            collapse.run(work)
        work.progress("simplifying", 1 - (1 - FIRST) * 0.6**number)
        found = collapse.found()
        faulty = examination.faults(found)
        if not faulty.any():
            done = Simplified(tolerance, len(mesh.triangles), *examination.distances(found))
            return Mesh(mesh.vertices, found.triangles).selected(~found.gone), done
        collapse.undo(faulty)
    raise MeshError(f"the mesh cannot be simplified within {tolerance:g} mm without crossing itself")
