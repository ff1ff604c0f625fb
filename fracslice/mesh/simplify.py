"""Mesh simplification within a proved tolerance."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import MeshError
from ..formulas.parameters import Number
from ..formulas.records import validated
from ..scene import parse_length
from ..work import Work
from .model import Mesh

ROUNDS, PATIENT = 200, 40
"""Maximum rounds of verification and undo, and number of the first rounds in which new collapses may replace
the undone ones.
"""

AIM = 0.95
"""Fraction of the tolerance for vertices; the triangles between them need the rest."""


@dataclass(frozen=True)
class Simplified:
    """Result of a simplification.

    Attributes
    ----------
    tolerance_mm : float
        Tolerance.
    from_triangles : int
        Triangles of the original mesh.
    bound_mm : float
        Proved bound on the distance of all points of the original surface from the simplified one; at most
        the tolerance.
    back_mm : float
        Greatest distance of the samples of the simplified surface from the original one; at most the
        tolerance.
    """

    tolerance_mm: float
    from_triangles: int
    bound_mm: float
    back_mm: float


def simplify(mesh: Mesh, tolerance: float, work: Work | None = None) -> tuple[Mesh, Simplified]:
    """Simplify a mesh within a tolerance.

    The vertices of the result are vertices of the original, and so stay on the surface and on sharp edges.
    The result is verified: a bound on the distance of every original triangle, the distance back at samples
    half an edge apart, self-intersections, and the orientation of the shells. Collapses that fail are undone.

    Parameters
    ----------
    mesh : Mesh
        Closed, oriented 2-manifold without self-intersections, mm.
    tolerance : float or str
        Maximum distance between both surfaces: mm, or a length with a unit, for example "0.02mm".
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    Mesh
        Simplified mesh: a closed, oriented 2-manifold of the same topology, without self-intersections.
    Simplified
        Distances.

    Raises
    ------
    MeshError
        For an invalid tolerance or a mesh that is not a closed manifold, or if faults remain after all
        rounds.
    Cancelled
        If the work is cancelled.
    """
    from .collapse import FIRST, Collapse
    from .examination import Examination
    from .topology import edge_topology

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
        result = collapse.state()
        faulty = examination.faults(result)
        if not faulty.any():
            done = Simplified(tolerance, len(mesh.triangles), *examination.distances(result))
            return Mesh(mesh.vertices, result.triangles).selected(~result.gone), done
        collapse.undo(faulty)
    raise MeshError(f"the mesh cannot be simplified within {tolerance:g} mm without crossing itself")
