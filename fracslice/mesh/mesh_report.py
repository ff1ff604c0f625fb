"""Defects and measures of a mesh."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ..common.digits import counted


@dataclass(frozen=True)
class MeshReport:
    """Result of `check_mesh`; every field is plain JSON. Counts of defects are zero for a printable solid.

    Attributes
    ----------
    triangles, vertices : int
        Triangles and vertices of the quantised mesh.
    watertight : bool
        True if every edge joins at least two triangles.
    manifold : bool
        True if every edge joins exactly two triangles and the triangles at every vertex form one fan.
    oriented : bool
        True if adjacent triangles have the same orientation and every shell faces out of the material.
    self_intersections : int
        Triangles that cut, touch or cover another one.
    searched_triangles : int
        Triangles searched for self-intersections; at the others they are excluded by construction.
    degenerate_triangles : int
        Triangles without area.
    duplicate_triangles : int
        Triangles with the corners of an earlier one.
    open_edges : int
        Edges of one triangle.
    nonmanifold_edges : int
        Edges of more than two triangles.
    nonmanifold_vertices : int
        Vertices whose triangles form more than one fan.
    misoriented_edges : int
        Edges whose triangles have opposite orientations.
    misplaced_shells : int
        Shells that are inside out or inside another body.
    components : int
        Outer bodies.
    cavities : int
        Sealed shells inside bodies.
    genus : int or None
        Sum over all shells; None if the surface is not a closed 2-manifold.
    volume_mm3 : float
        Signed volume, mm3.
    area_mm2 : float
        Surface area, mm2.
    bbox_mm : tuple
        Low and high corner of the bounding box, mm.
    """

    triangles: int
    vertices: int
    watertight: bool
    manifold: bool
    oriented: bool
    self_intersections: int
    searched_triangles: int
    degenerate_triangles: int
    duplicate_triangles: int
    open_edges: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    misoriented_edges: int
    misplaced_shells: int
    components: int
    cavities: int
    genus: int | None
    volume_mm3: float
    area_mm2: float
    bbox_mm: tuple[tuple[float, float, float], tuple[float, float, float]]

    @property
    def problems(self) -> tuple[str, ...]:
        """Descriptions of the defects, tuple of str; empty for a printable mesh."""
        counts = (
            (self.open_edges, "open edge", "open edges", "(a hole in the surface)"),
            (self.nonmanifold_edges, "edge", "edges", "with more than two triangles"),
            (self.nonmanifold_vertices, "vertex", "vertices", "where the surface touches itself"),
            (self.misoriented_edges, "edge", "edges", "between triangles of opposite orientation"),
            (self.misplaced_shells, "shell", "shells", "inside out or inside another body"),
            (
                self.self_intersections,
                "triangle that cuts or touches",
                "triangles that cut or touch",
                "others",
            ),
            (self.degenerate_triangles, "triangle", "triangles", "without area"),
            (self.duplicate_triangles, "triangle that repeats", "triangles that repeat", "another"),
        )
        problems = tuple(f"{counted(count, one, more)} {what}" for count, one, more, what in counts if count)
        return problems if problems or self.volume_mm3 > 0 else ("it encloses no volume",)

    @property
    def printable(self) -> bool:
        """True if the mesh is a closed, oriented manifold of positive volume without self-intersections."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """Report as plain JSON, with the verdict.

        Returns
        -------
        dict
            All fields, `printable` and `problems`.
        """
        return asdict(self) | {"printable": self.printable, "problems": list(self.problems)}
