"""Colours of a mesh for printers with several filaments: as many colours as there are filaments, triangles
that are painted with them, and a body for each.

Colours are compared in OKLab (B. Ottosson, "A perceptual color space for image processing", 2020), and chosen
by k-means (S. Lloyd, "Least squares quantization in PCM", 1982).

Painted triangles are stored as PrusaSlicer's TriangleSelector and the slicers that follow it store them: a
triangle is of one filament, or split into four at the middles of its sides, and each of those likewise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, permutations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import NO_TRIANGLES, Filaments, Triangles, from_linear, inverse, product, to_linear
from ..records import MOST_FILAMENTS
from ..work import Work
from .model import Mesh, to_manifold

if TYPE_CHECKING:
    from manifold3d import Manifold

Colours = NDArray[np.uint8]
"""sRGB, [n, 3]."""

ColoursAt = Callable[[NDArray[np.float64]], Colours]
"""Colours at points, mm."""

_TO_LMS = np.array(
    [
        (0.4122214708, 0.5363325363, 0.0514459929),
        (0.2119034982, 0.6806995451, 0.1073969566),
        (0.0883024619, 0.2817188376, 0.6299787005),
    ]
)
_TO_LAB = np.array(
    [
        (0.2104542553, 0.7936177850, -0.0040720468),
        (1.9779984951, -2.4285922050, 0.4505937099),
        (0.0259040371, 0.7827717662, -0.8086757660),
    ]
)

ROUNDS = 64
"""Most rounds of k-means."""


def oklab(colours: Colours) -> NDArray[np.float64]:
    """Lightness and two opponent colours, float64 [n, 3]."""
    return product(np.cbrt(product(to_linear(colours / 255), _TO_LMS.T)), _TO_LAB.T)


def _from_oklab(lab: NDArray[np.float64]) -> Colours:
    """Nearest sRGB colours."""
    light = product(product(lab, inverse(_TO_LAB).T) ** 3, inverse(_TO_LMS).T)
    colours: Colours = np.rint(255 * from_linear(light.clip(0.0, 1.0))).astype(np.uint8)
    return colours


def chosen_colours(colours: Colours, weights: NDArray[np.float64], count: int) -> Colours:
    """At most `count` colours that are nearest to weighted ones, those of more weight first.

    The first is the one of most weight; each further one starts where most weight is far from the others.
    """
    known, index = _known(colours)
    mass = np.bincount(index, weights, len(known))
    if len(known) <= count:
        return known[np.argsort(-mass, kind="stable")]
    points, seeds = oklab(known), [int(mass.argmax())]
    while len(seeds) < count:
        far = _squares(points, points[seeds]).min(1)
        seeds.append(int((mass * far).argmax()))
    middles, of = points[seeds], np.full(len(points), -1)
    for _ in range(ROUNDS):
        before, of = of, _squares(points, middles).argmin(1)
        if (before == of).all():
            break
        total = np.maximum(np.bincount(of, mass, count), 1e-300)
        middles = np.stack([np.bincount(of, mass * axis, count) / total for axis in points.T], 1)
    share = np.bincount(of, mass, count)
    order = [k for k in np.argsort(-share, kind="stable").tolist() if share[k] > 0]
    return _distinct(_from_oklab(middles[order]))


def _distinct(colours: Colours) -> Colours:
    """Colours without repetitions, in their order."""
    _, first = np.unique(colours, axis=0, return_index=True)
    return colours[np.sort(first)]


def _squares(points: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared distances, float64 [n, k]."""
    return np.stack([((points - other) ** 2).sum(1) for other in others], 1)


def nearest_filament(colours: Colours, filaments: Colours) -> NDArray[np.uint8]:
    """Number of the filament of the most similar colour, uint8 [n]."""
    known, index = _known(colours)
    nearest: NDArray[np.uint8] = _squares(oklab(known), oklab(filaments)).argmin(1).astype(np.uint8)
    return nearest[index]


def _known(colours: Colours) -> tuple[Colours, NDArray[np.intp]]:
    """Distinct colours, and the number of each among them."""
    red, green, blue = colours.T.astype(np.uint32)
    known, index = np.unique(red << 16 | green << 8 | blue, return_inverse=True)
    return np.stack([known >> 16, known >> 8 & 255, known & 255], 1).astype(np.uint8), index.reshape(-1)


def parse_colours(texts: Sequence[str]) -> Colours:
    """Colours of texts such as #e33399."""
    return np.array([[int(text[k : k + 2], 16) for k in (1, 3, 5)] for text in texts], np.uint8)


SAMPLES = 1 << 16
"""Points of the surface whose colours count."""
PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of a sequence that fills the unit square evenly (M. Roberts 2018, after the plastic number)."""


def spread_points(mesh: Mesh, count: int) -> NDArray[np.float64]:
    """Points that are spread evenly over the triangles, the same on any machine, float64 [count, 3]."""
    upto = np.cumsum(np.linalg.norm(mesh.normals, axis=1))
    number = np.arange(count)
    triangle = np.searchsorted(upto, (number + 0.5) / count * upto[-1])
    u, v = ((number[:, None] + 1) * PLASTIC % 1.0).T
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    a, b, c = np.moveaxis(mesh.corners[np.minimum(triangle, len(upto) - 1)], 1, 0)
    points: NDArray[np.float64] = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return points


def chosen_filaments(mesh: Mesh, wanted: int | Sequence[str], colours_at: ColoursAt) -> Colours:
    """Colours of filaments for the surface of a mesh: as many as are wanted, or these, such as #e33399."""
    if not isinstance(wanted, int):
        return parse_colours(wanted)
    return chosen_colours(colours_at(spread_points(mesh, SAMPLES)), np.ones(SAMPLES), wanted)


def with_filaments(mesh: Mesh, filaments: Colours, colours_at: ColoursAt, bodies: bool, work: Work) -> Mesh:
    """A coloured mesh whose vertices and triangles have the colours of filaments, with a body for each where
    these are wanted.
    """
    assert mesh.colours is not None
    numbers = nearest_filament(mesh.colours, filaments)

    def numbers_at(points: NDArray[np.float64]) -> NDArray[np.uint8]:
        return nearest_filament(colours_at(points), filaments)

    made = Filaments(filaments, *paint_triangles(mesh, numbers, numbers_at, work))
    if bodies:
        made = replace(made, bodies=cut_bodies(mesh, len(filaments), numbers_at, work))
    return replace(mesh, colours=filaments[numbers], filaments=made)


FINEST, COARSEST = 0.2, 0.8
"""Sides of painted triangles, mm: where colours meet, half of the width of a line; elsewhere."""
LEVELS = 12
"""Most times that a triangle is halved."""

NumbersAt = Callable[[NDArray[np.float64]], NDArray[np.uint8]]
"""Numbers of the filaments at points, mm."""


class _Level(NamedTuple):
    """Triangles of one size: those of the mesh, or quarters of those of the level before."""

    numbers: NDArray[np.uint8]  # filament of each, of the largest part
    split: NDArray[np.intp]  # those that are split, in the order of their quarters in the next level


def paint_triangles(
    mesh: Mesh, numbers: NDArray[np.uint8], numbers_at: NumbersAt, work: Work
) -> tuple[NDArray[np.uint8], tuple[str, ...], NDArray[np.int32]]:
    """Filament of the largest part of each triangle; texts of triangles, and the number of each one's text.

    `numbers`: filaments of the vertices.
    """
    corners, own, levels = mesh.corners, numbers[mesh.triangles], list[_Level]()
    while True:
        work.check()
        sides = corners - np.roll(corners, 1, axis=1)
        longest = np.sqrt((sides * sides).sum(2).max(1, initial=0.0))
        mixed = (own != own[:, :1]).any(1)
        splits = (longest > np.where(mixed, FINEST, COARSEST)) & (len(levels) < LEVELS)
        split = np.flatnonzero(splits)
        levels.append(_Level(_most_common(own, corners, mixed & ~splits, numbers_at), split))
        if not len(split):
            break
        corners, own = _quarters(corners[split], own[split], numbers_at)
    return _encoded(levels)


def _most_common(
    own: NDArray[np.uint8], corners: NDArray[np.float64], mixed: NDArray[np.bool_], numbers_at: NumbersAt
) -> NDArray[np.uint8]:
    """Filament of two corners or more; where all differ, that in the middle."""
    a, b, c = own.T
    result: NDArray[np.uint8] = np.where(b == c, b, a)
    differ = np.flatnonzero(mixed & (a != b) & (b != c) & (c != a))
    if len(differ):
        result[differ] = numbers_at(corners[differ].mean(1))
    return result


def _quarters(
    corners: NDArray[np.float64], own: NDArray[np.uint8], numbers_at: NumbersAt
) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Quarters of triangles, with the filaments at their corners: one at each corner, then the middle one."""
    middles = (corners + np.roll(corners, -1, axis=1)) / 2  # of the sides from each corner on
    numbers = numbers_at(middles.reshape(-1, 3)).reshape(-1, 3)
    at, of = np.concatenate([corners, middles], 1), np.concatenate([own, numbers], 1)
    quarters = np.array([(0, 3, 5), (3, 1, 4), (4, 2, 5), (3, 4, 5)])
    return at[:, quarters].reshape(-1, 3, 3), of[:, quarters].reshape(-1, 3)


def _encoded(levels: list[_Level]) -> tuple[NDArray[np.uint8], tuple[str, ...], NDArray[np.int32]]:
    """Filaments and texts of the triangles of the first level, from the last level on."""
    plain = [filament_text(k) for k in range(MOST_FILAMENTS)]
    each = np.eye(1 + max(int(numbers.max(initial=0)) for numbers, _ in levels), dtype=np.float32)
    inner, shares = np.empty(0, object), each[:0]
    for numbers, split in reversed(levels):
        texts, own = np.array(plain, object)[numbers], each[numbers]
        if len(split):
            parts = inner.reshape(-1, 4)
            a, b, c, d = parts.T
            whole = (parts == parts[:, :1]).all(1) & np.isin(a, plain)
            # Slicers read the text from its end: that it is split, then the quarters, the middle one first.
            texts[split] = np.where(whole, a, a + b + c + d + "3")
            own[split] = shares.reshape(-1, 4, len(each)).mean(1)
        inner, shares = texts, own
    distinct, index = np.unique(inner.astype(str), return_inverse=True)
    return shares.argmax(1).astype(np.uint8), tuple(distinct.tolist()), index.reshape(-1).astype(np.int32)


def filament_text(number: int) -> str:
    """Text of a triangle of one filament. The first is that of the object, which is not painted."""
    if not number:
        return "0"
    state = number + 1
    return f"{state - 3:X}C" if state > 2 else f"{state << 2:X}"


def painted_mesh(mesh: Mesh) -> Mesh:
    """The parts of painted triangles in the colours of their filaments, as a mesh for pictures."""
    assert mesh.filaments is not None
    texts, number = mesh.filaments.texts, mesh.filaments.text
    single = {filament_text(k): k for k in range(MOST_FILAMENTS)}
    known = np.array([single.get(text, -1) for text in texts])[number]
    corners, own = [mesh.corners[known >= 0]], [known[known >= 0]]
    for index in np.flatnonzero(known < 0).tolist():
        parts = list(_parts(texts[number[index]], mesh.corners[index]))
        corners.append(np.array([part for part, _ in parts]))
        own.append(np.array([filament for _, filament in parts]))
    points, filaments = np.concatenate(corners).reshape(-1, 3), np.repeat(np.concatenate(own), 3)
    rows, corner = np.unique(np.column_stack([points, filaments]), axis=0, return_inverse=True)
    colours = mesh.filaments.colours[rows[:, 3].astype(np.intp)]
    return Mesh(rows[:, :3].copy(), corner.reshape(-1, 3).astype(np.int32), colours)


def _parts(text: str, corners: NDArray[np.float64]) -> Iterator[tuple[NDArray[np.float64], int]]:
    """Parts of a painted triangle with their filaments."""
    left, at = [corners], len(text)
    while left:
        a, b, c = triangle = left.pop()
        at -= 1
        if text[at] == "3":
            ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
            left += [np.array(part) for part in ((a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca))]
        elif text[at] == "C":
            at -= 1
            yield triangle, int(text[at], 16) + 2
        else:
            yield triangle, max(int(text[at], 16) // 4 - 1, 0)


CELLS = 64
"""Cells along the longest side in which bodies are told apart."""
SMOOTH = 0.02
"""Tolerance within which borders have fewer triangles, cells."""
FLAKE = 1e-9
"""Volume of what is left between surfaces that meet, by that of a body."""
STEPS = 12
"""Halvings of the side of a cell, to where the colour changes."""
INSET = 1 / 16
"""Least distance of a border from the ends of a side, by its length."""


def cut_bodies(mesh: Mesh, count: int, numbers_at: NumbersAt, work: Work) -> tuple[Triangles, ...]:
    """A body for each filament: the solid of a mesh, cut where the colour inside changes.

    A body is cut off from what the others left, so that they meet exactly and their volumes add up.
    """
    cells = _cells(mesh, numbers_at, work)
    rest, bodies = to_manifold(mesh), list["Manifold"]()
    for number in range(1, count):
        work.check()
        border = cells.border(number)
        if len(border.triangles):
            own, rest = rest.split(_simplified(border, SMOOTH * cells.side))
            own, rest = _without_crumbs(own, rest, cells.side**3)
            own, rest = _without_crumbs(rest, own, cells.side**3)[::-1]
            bodies.append(own)
        else:
            bodies.append(type(rest)())
    return _triangles(rest), *map(_triangles, bodies)


def _simplified(border: Mesh, tolerance: float) -> Manifold:
    """Solid of a surface with fewer triangles, which bodies are cut by in full precision."""
    made = to_manifold(border).simplify(tolerance).to_mesh64()
    return to_manifold(Mesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts, np.int32)))


def _without_crumbs(body: Manifold, other: Manifold, least: float) -> tuple[Manifold, Manifold]:
    """Two bodies, after those parts of the first that are smaller than a volume and touch the other are its.

    Where a border meets a crease of the surface, slivers are cut off on its wrong side.
    """
    import manifold3d

    parts = body.decompose()
    crumbs = [part for part in parts if part.volume() < least]
    if not crumbs or len(crumbs) == len(parts):
        return body, other
    kept = [part for part in parts if part.volume() >= least]
    return body.compose(kept), body.batch_boolean([other, *crumbs], manifold3d.OpType.Add)


def _triangles(solid: Manifold) -> Triangles:
    """Triangles of a solid, none of nothing."""
    parts = solid.decompose()
    if not parts:
        return NO_TRIANGLES
    least = FLAKE * solid.volume()
    made = solid.compose([part for part in parts if part.volume() > least]).to_mesh64()
    vertices = np.asarray(made.vert_properties, np.float64)[:, :3]
    return Triangles(vertices.copy(), np.asarray(made.tri_verts).astype(np.int32))


class _Cells(NamedTuple):
    """Tetrahedra whose corners have several filaments, and points in their sides, in their faces and inside.

    Six tetrahedra fill a cell (H. W. Kuhn, 1960). Each corner owns the part that is nearest to it in
    barycentric terms: its border lies on the points of the sides where the filament changes. The parts of one
    filament are so bounded by a manifold, and no two of them overlap.
    """

    owners: NDArray[np.uint8]  # filaments of the corners, (n, 4)
    points: NDArray[np.float64]  # all points, mm
    sides: NDArray[np.int64]  # points of the sides between two corners, (n, 4, 4)
    faces: NDArray[np.int64]  # points of the faces without a corner, (n, 4)
    middles: NDArray[np.int64]  # points inside, (n,)
    side: float  # side of a cell, mm

    def border(self, number: int) -> Mesh:
        """Surface of the region of a filament."""
        found = []
        for i, j, k, m in _EVEN:
            at = np.flatnonzero((self.owners[:, i] == number) & (self.owners[:, j] != number))
            side, middle = self.sides[at, i, j], self.middles[at]
            found += [np.stack([side, self.faces[at, m], middle], 1)]
            found += [np.stack([side, middle, self.faces[at, k]], 1)]
        return Mesh(self.points, np.concatenate(found).astype(np.int32)).compact()


_EVEN = [p for p in permutations(range(4)) if sum(a > b for a, b in combinations(p, 2)) % 2 == 0]
_SIDES = list(combinations(range(4), 2))


def _cells(mesh: Mesh, numbers_at: NumbersAt, work: Work) -> _Cells:
    """Tetrahedra around the borders of filaments in a mesh; far outside, it is the first filament."""
    low, high = mesh.bounds
    cell = float((high - low).max() / CELLS)
    shape = np.ceil((high - low) / cell).astype(int) + 4
    lattice = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1)
    at = low + cell * (lattice - OFF)
    inside = ((lattice > 0) & (lattice < shape - 1)).all(-1)
    own = np.zeros(shape, np.uint8)
    own[inside] = numbers_at(at[inside])
    work.check()
    corners = _tetrahedra(own)
    nodes, index = np.unique(corners, return_inverse=True)
    points, owners = at.reshape(-1, 3)[nodes], own.reshape(-1)[nodes]
    index = index.reshape(-1, 4)
    return _with_points(points, owners, index, cell, numbers_at, work)


OFF = 1.37
"""Cells around a mesh. The planes of cells so avoid those in which objects are symmetric."""


def _tetrahedra(own: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Corners of the tetrahedra with several filaments, positive, numbered in the lattice, int64 [n, 4]."""
    number = np.arange(own.size).reshape(own.shape)
    steps = number[1, 0, 0], number[0, 1, 0], number[0, 0, 1]
    first = number[:-1, :-1, :-1].reshape(-1)
    flat, found = own.reshape(-1), []
    for order in permutations(range(3)):
        a = first + steps[order[0]]
        corners = [first, a, a + steps[order[1]], first + sum(steps)]
        if sum(x > y for x, y in combinations(order, 2)) % 2:
            corners[1:3] = corners[2], corners[1]
        mixed = (flat[corners[0]] != flat[corners[1]]) | (flat[corners[0]] != flat[corners[2]])
        mixed |= flat[corners[0]] != flat[corners[3]]
        found.append(np.stack([one[mixed] for one in corners], 1))
    return np.concatenate(found)


def _with_points(
    points: NDArray[np.float64],
    owners: NDArray[np.uint8],
    corners: NDArray[np.int64],
    side: float,
    numbers_at: NumbersAt,
    work: Work,
) -> _Cells:
    """Tetrahedra with the points at which their borders are."""
    count, tetrahedra = len(points), len(corners)
    pairs = np.sort(corners[:, _SIDES], axis=2)
    mixed = owners[pairs[..., 0]] != owners[pairs[..., 1]]
    known, crossing = np.unique(pairs[mixed] @ np.array([count, 1]), return_inverse=True)
    crossed = _crossings(points, owners, known // count, known % count, numbers_at, work)
    sides = np.zeros((tetrahedra, 4, 4), np.int64)
    numbers = np.zeros(mixed.shape, np.int64)
    numbers[mixed] = crossing.reshape(-1)
    places = np.where(mixed[..., None], crossed[numbers], 0.0)
    for k, (i, j) in enumerate(_SIDES):
        sides[:, i, j] = sides[:, j, i] = numbers[:, k]
    inner = places.sum(1) / np.maximum(mixed.sum(1), 1)[:, None]
    triples = np.stack([np.sort(np.delete(corners, k, axis=1), axis=1) for k in range(4)], 1)
    of_face = [[k for k, pair in enumerate(_SIDES) if corner not in pair] for corner in range(4)]
    means = np.stack(
        [places[:, some].sum(1) / np.maximum(mixed[:, some].sum(1), 1)[:, None] for some in of_face], 1
    )
    key = triples @ np.array([count * count, count, 1])
    _, one, face = np.unique(key, return_index=True, return_inverse=True)
    start = len(crossed)
    whole = np.concatenate([crossed, means.reshape(-1, 3)[one], inner])
    middles = start + len(one) + np.arange(tetrahedra)
    return _Cells(owners[corners], whole, sides, start + face.reshape(-1, 4), middles, side)


def _crossings(
    points: NDArray[np.float64],
    owners: NDArray[np.uint8],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    numbers_at: NumbersAt,
    work: Work,
) -> NDArray[np.float64]:
    """Points of sides where the filament of the first end is lost, by halving."""
    start, along, own = points[first], points[second] - points[first], owners[first]
    low, high = np.zeros(len(first)), np.ones(len(first))
    for _ in range(STEPS):
        work.check()
        half = (low + high) / 2
        same = numbers_at(start + half[:, None] * along) == own
        low, high = np.where(same, half, low), np.where(same, high, half)
    return start + ((low + high) / 2).clip(INSET, 1 - INSET)[:, None] * along
