"""Surfaces displaced by gradient noise, and foams of random cells, by seed.

Random numbers are permutation polynomials modulo 289 (McEwan, Sheets, Richardson and Gustavson 2012,
"Efficient Computational Noise in GLSL"), which float32 computes without rounding: all targets and both
precisions give the same foam.
"""

from __future__ import annotations

from ..common.parameters import Choice, Count, Number
from ..expr.vocabulary import absolute, floor, maximum, minimum, sqrt, where
from ..fields.box import Box
from ..fields.registry import Fixed, Node, domain_operator, shape
from .confining import beyond, frame

FARTHEST = 1e6
"""Lattice coordinate beyond which noise and foam are constant: float32 has no fraction there."""

PERLIN, SIMPLEX = (0.866025, 2.7923), (0.00928906, 0.0724793)
"""Maxima of the noise and of its gradient, for the worst gradients of unit length, by optimisation."""


def lattice(t):  # type: ignore[no-untyped-def]
    """Lattice coordinate, clipped where float32 has no fraction."""
    return minimum(maximum(t, -FARTHEST), FARTHEST)


def permuted(t):  # type: ignore[no-untyped-def]
    """Next random number, a whole number from 0 to 288."""
    t = t - 289.0 * floor(t / 289.0)
    t = (34.0 * t + 1.0) * t
    return t - 289.0 * floor(t / 289.0)


def hashed(i, j, k, seed):  # type: ignore[no-untyped-def]
    """Random number of a lattice point."""
    return permuted(permuted(permuted(seed + i) + j) + k)


def along(h, x, y, z):  # type: ignore[no-untyped-def]
    """Product of a vector and the random unit vector of a number: one of 289 on an unfolded octahedron."""
    row = floor((h + 0.5) / 17.0)
    u = (2.0 * (h - 17.0 * row) + 1.0) / 17.0 - 1.0
    v = (2.0 * row + 1.0) / 17.0 - 1.0
    w = 1.0 - absolute(u) - absolute(v)
    below = minimum(w, 0.0)
    u, v = u + where(u < 0.0, -below, below), v + where(v < 0.0, -below, below)
    return (u * x + v * y + w * z) / sqrt(u * u + v * v + w * w)


def fade(t):  # type: ignore[no-untyped-def]
    """Weight of the farther lattice point, with two continuous derivatives."""
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


def perlin_noise(x, y, z, seed):  # type: ignore[no-untyped-def]
    """Gradient noise on a cubic lattice."""
    x, y, z = lattice(x), lattice(y), lattice(z)
    i, j, k = floor(x), floor(y), floor(z)
    x, y, z = x - i, y - j, z - k
    total = 0.0 * x
    for a in (0, 1):
        wx = fade(x) if a else 1.0 - fade(x)
        for b in (0, 1):
            wy = fade(y) if b else 1.0 - fade(y)
            for c in (0, 1):
                wz = fade(z) if c else 1.0 - fade(z)
                total = total + wx * wy * wz * along(hashed(i + a, j + b, k + c, seed), x - a, y - b, z - c)
    return total


def simplex_noise(x, y, z, seed):  # type: ignore[no-untyped-def]
    """Gradient noise on a lattice of tetrahedra."""
    x, y, z = lattice(x), lattice(y), lattice(z)
    skew = (x + y + z) / 3.0
    i, j, k = floor(x + skew), floor(y + skew), floor(z + skew)
    back = (i + j + k) / 6.0
    x, y, z = x - i + back, y - j + back, z - k + back
    # Corners of the tetrahedron: the lattice steps along the axes in the order of the coordinates.
    xy, xz, yz = where(x >= y, 1.0, 0.0), where(x >= z, 1.0, 0.0), where(y >= z, 1.0, 0.0)
    rank_x, rank_y, rank_z = xy + xz, 1.0 - xy + yz, 2.0 - xz - yz
    total = 0.0 * x
    for step in (0, 1, 2, 3):
        a = where(rank_x > 2.5 - step, 1.0, 0.0)
        b = where(rank_y > 2.5 - step, 1.0, 0.0)
        c = where(rank_z > 2.5 - step, 1.0, 0.0)
        px, py, pz = x - a + step / 6.0, y - b + step / 6.0, z - c + step / 6.0
        t = maximum(0.5 - px * px - py * py - pz * pz, 0.0)
        t = t * t
        total = total + t * t * along(hashed(i + a, j + b, k + c, seed), px, py, pz)
    return total


@domain_operator(
    kind=Choice("simplex", "the noise", ("perlin", "simplex")),
    amplitude=Number(0.1, "largest displacement by the first octave", above=0),
    period=Number(0.5, "distance between lattice points of the first octave", above=0),
    octaves=Count(1, "layers of noise, each half as large and twice as fine", least=1, most=8),
    seed=Count(0, "another number is another noise", most=288),
)
def noise(child, x, y, z, amplitude, frequency, octaves, seed, simplex, centre, half):  # type: ignore[no-untyped-def]
    """The element with its surface displaced by gradient noise: Perlin 2002, "Improving noise", or simplex
    noise (Gustavson 2005, "Simplex noise demystified").

    The noise of every octave has the same steepest gradient, so L = the element's + 3.225 octaves amplitude /
    period, with simplex noise 7.803. The result is clipped at the element's box grown by all amplitudes.
    """
    f = maximum(child(x, y, z), beyond(x, y, z, centre, half))
    for k in range(octaves):
        shift = 13.7 * k
        u, v, w = frequency * x + shift, frequency * y + shift, frequency * z + shift
        f = f + amplitude * (simplex_noise(u, v, w, seed) if simplex else perlin_noise(u, v, w, seed))
        amplitude, frequency = 0.5 * amplitude, 2.0 * frequency
    return f


@noise.check
def noise_check(node: Node) -> None:
    if node.children[0].bounds.exterior_only:
        raise node.fail(
            "cannot displace an escape-time fractal: its field bounds no distance off its surface"
        )


def _steepest(node: Node) -> tuple[float, float]:
    """Maxima of the noise of a lattice and of its gradient."""
    return SIMPLEX if node["kind"] == "simplex" else PERLIN


@noise.arguments
def noise_arguments(node: Node) -> dict[str, object]:
    box = node.children[0].bounds.box
    return {
        "amplitude": node["amplitude"] / _steepest(node)[0],
        "frequency": 1.0 / node["period"],
        "octaves": node["octaves"],
        "seed": float(node["seed"]),
        "simplex": Fixed(node["kind"] == "simplex"),
        **frame(box),
    }


@noise.slope
def noise_slope(node: Node) -> float:
    highest, steepest = _steepest(node)
    steepness = node["octaves"] * node["amplitude"] / node["period"] * steepest / highest
    return max(1.0, node.children[0].bounds.lipschitz) + float(steepness)


@noise.bounds
def noise_bounds(node: Node) -> Box:
    return node.children[0].bounds.box.grown(node["amplitude"] * (2.0 - 0.5 ** (node["octaves"] - 1)))


@shape(
    kind=Choice("struts", "along the edges of the cells or their faces", ("struts", "walls")),
    period=Number(1.0, "distance between cell centres before they are moved", above=0),
    thickness=Number(0.1, "of struts or walls, at their thinnest", above=0),
    irregularity=Number(0.8, "how far cell centres are moved at random, in periods", least=0, most=1),
    seed=Count(0, "another number is another foam", most=288),
)
def voronoi(x, y, z, over, period, half, irregularity, seed, struts):  # type: ignore[no-untyped-def]
    """A foam of Voronoi cells, without end; put `bounds` around it (Voronoi 1908; cells by Worley 1996,
    "A cellular texture basis function").

    Half the difference of the distances to the nearest and to the second nearest centre, of struts to the
    third: each distance has slope 1, so L = 1. Distances are clipped where a centre out of the 27 nearest
    lattice cells could be nearer.
    """
    x, y, z = lattice(over * x), lattice(over * y), lattice(over * z)
    i, j, k = floor(x), floor(y), floor(z)
    x, y, z = x - i - 0.5, y - j - 0.5, z - k - 0.5
    first, second, third = 1e9 + 0.0 * x, 1e9 + 0.0 * x, 1e9 + 0.0 * x
    for a in range(3):
        for b in range(3):
            for c in range(3):
                h = hashed(i + (a - 1.0), j + (b - 1.0), k + (c - 1.0), seed)
                g = permuted(h + 17.0)
                u = (a - 1.0) + irregularity * ((h + 0.5) / 289.0 - 0.5) - x
                v = (b - 1.0) + irregularity * ((g + 0.5) / 289.0 - 0.5) - y
                w = (c - 1.0) + irregularity * ((permuted(g + 31.0) + 0.5) / 289.0 - 0.5) - z
                d = u * u + v * v + w * w
                third = minimum(third, maximum(second, d))
                second = minimum(second, maximum(first, d))
                first = minimum(first, d)
    clip = 1.5 - 0.5 * irregularity
    near, far = minimum(sqrt(first), clip), minimum(sqrt(third if struts else second), clip)
    return 0.5 * period * (far - near) - half


@voronoi.arguments
def voronoi_arguments(node: Node) -> dict[str, object]:
    return {
        "over": 1.0 / node["period"],
        "period": node["period"],
        "half": node["thickness"] / 2,
        "irregularity": node["irregularity"],
        "seed": float(node["seed"]),
        "struts": Fixed(node["kind"] == "struts"),
    }


@voronoi.bounds
def voronoi_bounds(node: Node) -> Box:
    return Box.everywhere()
