"""Lattices of struts, without end; put `bounds` around them."""

from __future__ import annotations

from ..common.parameters import Choice, Number
from .box import Box
from .registry import Fixed, Node, shape
from .vocabulary import absolute, floor, maximum, minimum, sqrt

Segment = tuple[float, float, float, float, float, float]

FACE_DIAGONALS: tuple[Segment, ...] = (
    (0, 0, 0, 0.5, 0.5, 0),
    (0, 0, 0, 0.5, 0, 0.5),
    (0, 0, 0, 0, 0.5, 0.5),
)
OCTAHEDRON: tuple[Segment, ...] = (
    (0.5, 0.5, 0, 0.5, 0, 0.5),
    (0.5, 0, 0.5, 0, 0.5, 0.5),
    (0, 0.5, 0.5, 0.5, 0.5, 0),
)
SQUARES: tuple[Segment, ...] = (
    (0.5, 0.25, 0, 0.5, 0, 0.25),
    (0.25, 0.5, 0, 0, 0.5, 0.25),
    (0.25, 0, 0.5, 0, 0.25, 0.5),
)
HEXAGONS: tuple[Segment, ...] = (
    (0, 0.25, 0.5, 0, 0.5, 0.25),
    (0.25, 0, 0.5, 0.5, 0, 0.25),
    (0.25, 0.5, 0, 0.5, 0.25, 0),
)
STRUTS: dict[str, tuple[Segment, ...]] = {
    "cubic": ((0, 0, 0, 0.5, 0, 0), (0, 0, 0, 0, 0.5, 0), (0, 0, 0, 0, 0, 0.5)),
    "bcc": ((0, 0, 0, 0.5, 0.5, 0.5),),
    "fcc": FACE_DIAGONALS,
    "octet": FACE_DIAGONALS + OCTAHEDRON,
    "kelvin": SQUARES + HEXAGONS,
}
"""Axes of the struts in an eighth of the cell: all lattices are symmetric in its faces and centre planes."""


@shape(
    kind=Choice("octet", "the lattice", tuple(STRUTS)),
    period=Number(1.0, "length of the edges of a cell", above=0),
    thickness=Number(0.1, "diameter of the struts", above=0),
)
def struts(x, y, z, over, period, radius, segments):  # type: ignore[no-untyped-def]
    """Struts along a cubic lattice: its edges, the space diagonals (bcc), the face diagonals (fcc), these and
    an octahedron (octet truss: Fuller 1961; Deshpande, Fleck and Ashby 2001), or the edges of truncated
    octahedra (Kelvin cells: Thomson 1887, "On the division of space with minimum partitional area").

    L = 1: an exact distance. Space is folded into an eighth of a cell, by mirrors of the lattice.
    """
    x, y, z = over * x, over * y, over * z
    x = absolute(x - floor(x + 0.5))
    y = absolute(y - floor(y + 0.5))
    z = absolute(z - floor(z + 0.5))
    nearest = 1e9 + 0.0 * x
    for ax, ay, az, bx, by, bz in segments:
        dx, dy, dz = bx - ax, by - ay, bz - az
        px, py, pz = x - ax, y - ay, z - az
        t = minimum(maximum((px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz), 0.0), 1.0)
        qx, qy, qz = px - t * dx, py - t * dy, pz - t * dz
        nearest = minimum(nearest, qx * qx + qy * qy + qz * qz)
    return period * sqrt(nearest) - radius


@struts.arguments
def struts_arguments(node: Node) -> dict[str, object]:
    return {
        "over": 1.0 / node["period"],
        "period": node["period"],
        "radius": node["thickness"] / 2,
        "segments": Fixed(STRUTS[node["kind"]]),
    }


@struts.bounds
def struts_bounds(node: Node) -> Box:
    return Box.everywhere()
