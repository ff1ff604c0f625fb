"""Lattices without end: struts, and walls along triply periodic minimal surfaces; put `bounds` around them.

Level sets: von Schnering and Nesper 1991, "Nodal surfaces of Fourier series". Every field of a wall is
divided by a bound of its gradient, so L = 1 without a grade; walls are thicker where the gradient is smaller.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..common.parameters import Choice, Number, Vector
from ..expr.vocabulary import absolute, cos, floor, maximum, minimum, sin, sqrt
from ..fields.box import Box
from ..fields.registry import Fixed, Node, shape
from ..fields.varying import Variable, Varying, as_argument, slope_of

FRACTION = Number(
    None,
    "share of space that is solid, within 0.2 % of it; the thickness follows, or the period of a thickness",
    above=0,
    below=1,
)
WALL: dict[str, Any] = {
    "period": Number(1.0, "length after which the surface repeats", above=0),
    "thickness": Variable(0.1, "of the wall at its thinnest, at the origin, or at each point", above=0),
    "grade": Vector((0.0, 0.0, 0.0), "growth of the thickness per length along x, y and z", least=-4, most=4),
    "volume_fraction": FRACTION,
}


STEEPEST = {"neovius": 0.7423075, "iwp": 0.942809, "lidinoid": 0.9798, "frd": 0.786}
"""Largest gradient on the surface, where walls are thinnest, relative to the bound; 1 where it is reached."""


def graded(x, y, z, half, grade):  # type: ignore[no-untyped-def]
    """Half the thickness of the wall at a point."""
    gx, gy, gz = grade
    return half + gx * x + gy * y + gz * z


@shape(**WALL)
def gyroid(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the gyroid (Schoen 1970, "Infinite periodic minimal surfaces without
    self-intersections"). The gradient of its level function is at most sqrt(3): L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = k * x, k * y, k * z
    return absolute(sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x)) / (1.7320509 * k) - half


@shape(**WALL)
def schwarz_p(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface P of Schwarz 1890. The gradient of its level function is at most
    sqrt(3): L = 1.
    """
    half = graded(x, y, z, half, grade)
    return absolute(cos(k * x) + cos(k * y) + cos(k * z)) / (1.7320509 * k) - half


@shape(**WALL)
def schwarz_d(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface D of Schwarz 1890. The gradient of its level function is at most
    sqrt(3): L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = k * x, k * y, k * z
    f = sin(x) * sin(y) * sin(z) + sin(x) * cos(y) * cos(z) + cos(x) * sin(y) * cos(z)
    return absolute(f + cos(x) * cos(y) * sin(z)) / (1.7320509 * k) - half


@shape(**WALL)
def neovius(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface of Neovius 1883. The gradient of its level function is at most 7: L = 1."""
    half = graded(x, y, z, half, grade)
    x, y, z = cos(k * x), cos(k * y), cos(k * z)
    return absolute(3.0 * (x + y + z) + 4.0 * x * y * z) / (7.0 * k) - half


@shape(**WALL)
def iwp(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface I-WP of Schoen 1970. The gradient of its level function is at most
    3 sqrt(3): L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = cos(k * x), cos(k * y), cos(k * z)
    squares = 2.0 * (x * x + y * y + z * z) - 3.0
    return absolute(2.0 * (x * y + y * z + z * x) - squares) / (5.1961525 * k) - half


@shape(**WALL)
def lidinoid(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the lidinoid (Lidin and Larsson 1990). The gradient of its level function is at most
    1.5 sqrt(3): L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = k * x, k * y, k * z
    a, b, c = sin(2.0 * x), sin(2.0 * y), sin(2.0 * z)
    p, q, r = cos(2.0 * x), cos(2.0 * y), cos(2.0 * z)
    twisted = a * cos(y) * sin(z) + b * cos(z) * sin(x) + c * cos(x) * sin(y)
    return absolute(0.5 * (twisted - p * q - q * r - r * p) + 0.15) / (2.5980763 * k) - half


@shape(**WALL)
def frd(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface F-RD of Schoen 1970. The gradient of its level function is at most 7.041:
    L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = cos(k * x), cos(k * y), cos(k * z)
    p, q, r = 2.0 * x * x - 1.0, 2.0 * y * y - 1.0, 2.0 * z * z - 1.0
    return absolute(4.0 * x * y * z - (p * q + q * r + r * p)) / (7.041 * k) - half


@shape(**WALL)
def fischer_koch_s(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface S of Fischer and Koch 1987. The gradient of its level function is at most
    2.444: L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = k * x, k * y, k * z
    p, q, r = cos(x), cos(y), cos(z)
    f = (2.0 * p * p - 1.0) * sin(y) * r + p * (2.0 * q * q - 1.0) * sin(z)
    return absolute(f + sin(x) * q * (2.0 * r * r - 1.0)) / (2.444 * k) - half


@shape(**WALL)
def split_p(x, y, z, k, half, grade):  # type: ignore[no-untyped-def]
    """A wall along the surface Split P of Lord and Mackay 2003. The gradient of its level function is at most
    3.6201: L = 1.
    """
    half = graded(x, y, z, half, grade)
    x, y, z = k * x, k * y, k * z
    a, b, c = sin(x), sin(y), sin(z)
    p, q, r = cos(x), cos(y), cos(z)
    u, v, w = 2.0 * p * p - 1.0, 2.0 * q * q - 1.0, 2.0 * r * r - 1.0
    f = 2.2 * (a * p * c * q + b * q * a * r + c * r * b * p)
    return absolute(f - 0.2 * (u * v + v * w + w * u) - 0.4 * (u + v + w)) / (3.6201 * k) - half


SIDE = 160
"""Cubes along each side of a cell, each with a sample, by which a thickness is found."""


def wall_half(node: Node) -> float | Varying:
    """Half the thickness of a wall at the origin, in units of its field."""
    if node["volume_fraction"] is not None:
        return wall_period(node) * unit_half(node)
    thickness, steepest = node["thickness"], STEEPEST.get(node.formula.name, 1.0)
    return thickness.times(steepest / 2) if isinstance(thickness, Varying) else steepest * thickness / 2


def unit_half(node: Node) -> float:
    """Half the thickness of a wall of period 1 that is a share of space, in units of its field."""
    k, flat = 2 * math.pi, (0.0, 0.0, 0.0)
    return float(quantile(node.formula.function, node["volume_fraction"], k, 0.0, flat))


def wall_period(node: Node) -> float:
    """Period as given, or as it follows from a thickness and a share of space."""
    if not period_follows(node):
        return float(node["period"])
    return float(STEEPEST.get(node.formula.name, 1.0) * node["thickness"] / 2 / unit_half(node))


@lru_cache(maxsize=256)
def quantile(function: Callable[..., Any], fraction: float, *arguments: Any) -> float:
    """Value that a share of a cell's points, [0, 1]^3, is below, by a sample at random in each small cube."""
    rng, side = np.random.default_rng(0), np.arange(SIDE)
    y, z = np.meshgrid(side, side)
    slabs = ((np.stack([x + 0 * y, y, z]) + rng.random((3, SIDE, SIDE))) / SIDE for x in side)
    return float(np.quantile([function(*slab, *arguments) for slab in slabs], fraction))


def period_follows(node: Node) -> bool:
    """True if a share of space and a thickness are given."""
    thickness = node.formula.parameters["thickness"].default
    return node["volume_fraction"] is not None and node["thickness"] != thickness


def lattice_check(node: Node) -> None:
    if not period_follows(node):
        return
    if node["period"] != node.formula.parameters["period"].default:
        raise node.fail("period, thickness and volume_fraction: expected two of them, as the third follows")
    if isinstance(node["thickness"], Varying):
        raise node.fail("thickness and volume_fraction: expected one number with the other")


def wall_arguments(node: Node) -> dict[str, object]:
    steepest = STEEPEST.get(node.formula.name, 1.0)
    return {
        "k": 2 * math.pi / wall_period(node),
        "half": as_argument(wall_half(node)),
        "grade": tuple(steepest * g / 2 for g in node["grade"]),
    }


def wall_bounds(node: Node) -> Box:
    return Box.everywhere()


def wall_slope(node: Node) -> float:
    return 1.0 + math.hypot(*node["grade"]) / 2 + slope_of(node["thickness"]) / 2


for _surface in (gyroid, schwarz_p, schwarz_d, neovius, iwp, lidinoid, frd, fischer_koch_s, split_p):
    _surface.arguments(wall_arguments)
    _surface.bounds(wall_bounds)
    _surface.slope(wall_slope)
    _surface.check(lattice_check)


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
    thickness=Variable(0.1, "diameter of the struts", above=0),
    volume_fraction=FRACTION,
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
    segments, thickness, period = STRUTS[node["kind"]], node["thickness"], float(node["period"])
    radius = thickness.times(0.5) if isinstance(thickness, Varying) else thickness / 2
    if (fraction := node["volume_fraction"]) is not None:
        of_one = quantile(struts.function, fraction, 1.0, 1.0, 0.0, segments)
        if period_follows(node):
            period = thickness / 2 / of_one
        radius = period * of_one
    return {
        "over": 1.0 / period,
        "period": period,
        "radius": as_argument(radius),
        "segments": Fixed(segments),
    }


@struts.slope
def struts_slope(node: Node) -> float:
    return 1.0 + slope_of(node["thickness"]) / 2


struts.check(lattice_check)


@struts.bounds
def struts_bounds(node: Node) -> Box:
    return Box.everywhere()
