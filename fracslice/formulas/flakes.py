"""Flakes of the Platonic solids: smaller copies at every corner, by folding space (Knighty 2010)."""

from __future__ import annotations

import math

from ..common.parameters import Choice, Count
from ..expr.vocabulary import orbit
from ..fields.box import Box
from ..fields.maps import mirror
from ..fields.registry import Fixed, Node, shape

Triple = tuple[float, float, float]

GOLDEN = (1 + math.sqrt(5)) / 2
OCTANT: tuple[Triple, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
TURNED = (-GOLDEN / 2, (GOLDEN - 1) / 2, -0.5)
"""Normal of the mirror of the icosahedral group that is no coordinate plane."""

MIRRORS: dict[str, tuple[Triple, ...]] = {
    "tetrahedron": ((1, 1, 0), (1, 0, 1), (0, 1, 1), (-1, 1, 0), (-1, 0, 1)),
    "octahedron": (*OCTANT, (1, -1, 0), (1, 0, -1)),
    "dodecahedron": (*OCTANT, TURNED, *OCTANT, TURNED, *OCTANT, TURNED, *OCTANT),
    "icosahedron": (*OCTANT, TURNED, *OCTANT, TURNED, *OCTANT, TURNED, *OCTANT),
}
"""Normals of the mirrors that fold space into the part nearest to one corner, in turn."""

CORNERS = {
    "tetrahedron": (1.0, 1.0, 1.0),
    "octahedron": (1.0, 0.0, 0.0),
    "dodecahedron": (1.0, 1.0, 1.0),
    "icosahedron": (0.0, GOLDEN, 1.0),
}
"""A corner of each solid."""

FACES = {
    "tetrahedron": (-1.0, 1.0, 1.0),
    "octahedron": (1.0, 1.0, 1.0),
    "dodecahedron": (0.0, GOLDEN, 1.0),
    "icosahedron": (1.0, 1.0, 1.0),
}
"""A normal of a face of each solid."""

SCALES = {"tetrahedron": 2.0, "octahedron": 2.0, "dodecahedron": 2 + GOLDEN, "icosahedron": 1 + GOLDEN}
"""Ratio of the sizes of a solid and of its copies, which touch."""


def folded(solid: str, point: Triple) -> Triple:
    """Image of a point in the part of space nearest to one corner."""
    for normal in MIRRORS[solid]:
        point, _ = mirror(point, normal)
    return point


def _unit(point: Triple) -> Triple:
    x, y, z = point
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


@shape(
    solid=Choice("icosahedron", "the Platonic solid", tuple(MIRRORS)),
    level=Count(3, "how often each solid is replaced by copies at its corners", most=20),
)
def flake(x, y, z, level, scale, corner, face, height, mirrors):  # type: ignore[no-untyped-def]
    """The flake of a Platonic solid with corners on the unit sphere.

    Sierpinski 1915 has the flat one; folds: Knighty 2010, "Kaleidoscopic (escape time) IFS". Reflections move
    no two points apart, and copies are made smaller, not space larger, so L = 1. Copies touch in points and
    edges.
    """
    vx, vy, vz = corner
    fx, fy, fz = face
    size = 1.0
    for _ in range(level):
        for a, b, c in mirrors:
            (x, y, z), _ = mirror((x, y, z), (a, b, c))
        size = size / scale
        x, y, z = x - size * vx, y - size * vy, z - size * vz
        orbit((x * x + y * y + z * z) / size, x == x, x / size, y / size, z / size)
    for a, b, c in mirrors:
        (x, y, z), _ = mirror((x, y, z), (a, b, c))
    return fx * x + fy * y + fz * z - height * size


@flake.arguments
def flake_arguments(node: Node) -> dict[str, object]:
    solid, scale = node["solid"], SCALES[node["solid"]]
    corner, face = (_unit(folded(solid, point[solid])) for point in (CORNERS, FACES))
    return {
        "level": node["level"],
        "scale": scale,
        "corner": tuple((scale - 1) * v for v in corner),
        "face": face,
        "height": sum(a * b for a, b in zip(face, corner, strict=True)),
        "mirrors": Fixed(MIRRORS[solid]),
    }


@flake.bounds
def flake_bounds(node: Node) -> Box:
    return Box.centred(1.0)


@flake.visible
def flake_visible(node: Node, voxel: float) -> Node:
    """The flake of the deepest level whose solids are wider than two voxels."""
    deepest = max(math.floor(math.log(1.0 / voxel, SCALES[node["solid"]]) + 1e-6), 0)
    return node if node["level"] <= deepest else node.changed(level=deepest)
