"""Checks of a mesh: counts of defects, sums over its pieces, distances, what of the surface it lacks, what
hangs in the air, and a verdict; repair of models that are no solid, by MeshLab's filters.

Bodies that overlap are united, and triangles that cut each other replaced, by the winding number (Zhou,
Grinspun, Zorin and Jacobson, "Mesh Arrangements for Solid Geometry", 2016).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import bounds, connected_components, near
from ..common.arrays import dot
from ..common.messages import format_count, lacking
from ..errors import MeshError
from ..printing.walls import MeshSurface, thin_walls
from ..volume import Plan
from ..work import Work
from .cleaning import Finished, quantise_mesh
from .fit import NEAR, surface_error, surface_points
from .model import COLOUR, Mesh, Nearest, build, component_sizes
from .shells import nesting


@dataclass(frozen=True)
class MeshReport:
    """Result of `check_mesh`; every field is plain JSON. Counts of defects are zero for a printable
    solid.
    """

    triangles: int  # triangles and vertices of the quantised mesh
    vertices: int
    watertight: bool  # true if every edge joins at least two triangles
    # true if every edge joins exactly two triangles and the triangles at every vertex form one fan
    manifold: bool
    # true if adjacent triangles have the same orientation and every shell faces out of the material
    oriented: bool
    self_intersections: int  # triangles that cut, touch or cover another one
    # triangles searched for self-intersections; at the others they are excluded by construction
    searched_triangles: int
    degenerate_triangles: int  # triangles without area
    duplicate_triangles: int  # triangles with the corners of an earlier one
    open_edges: int  # edges of one triangle
    nonmanifold_edges: int  # edges of more than two triangles
    nonmanifold_vertices: int  # vertices whose triangles form more than one fan
    misoriented_edges: int  # edges whose triangles have opposite orientations
    misplaced_shells: int  # shells that are inside out or inside another body
    components: int  # outer bodies
    cavities: int  # sealed shells inside bodies
    genus: int | None  # sum over all shells; None if the surface is not a closed 2-manifold
    volume_mm3: float  # signed volume, mm3
    area_mm2: float  # surface area, mm2
    # low and high corner of the bounding box, mm
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
        problems = tuple(
            f"{format_count(count, one, more)} {what}" for count, one, more, what in counts if count
        )
        return problems if problems or self.volume_mm3 > 0 else ("it encloses no volume",)

    @property
    def printable(self) -> bool:
        """True if the mesh is a closed, oriented manifold of positive volume without self-intersections."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """Report as plain JSON, with the verdict."""
        return asdict(self) | {"printable": self.printable, "problems": list(self.problems)}


def check_mesh(mesh: Mesh, *, threads: int | None = None) -> MeshReport:
    """Check a mesh as a slicer reads its file: rounded to float32, equal positions welded, nothing repaired.

    All counts are exact. The search for self-intersections takes most of the time.

    `mesh` in mm.
    """
    from .._native import connected_components
    from .cleaning import Finished
    from .model import component_sizes

    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    threads = threads or 0
    mesh = quantise_mesh(mesh, threads)
    sizes = mesh.sizes(threads)
    area, flat = float(sizes.areas[0]), int(sizes.flat[0])
    whole = mesh
    if flat:
        a, b, c = mesh.triangles.T
        whole = mesh.selected((a != b) & (b != c) & (c != a), threads)
    if not len(whole.triangles):
        raise MeshError("the mesh has only triangles without area")
    tally = Tally(threads)
    tally.add(Finished.whole(whole))
    labels, shells = connected_components(whole.triangles, len(whole.vertices), threads)
    volumes = component_sizes(whole.vertices, whole.triangles, labels, shells, threads).volumes
    closed = not (tally.open_edges or tally.misoriented_edges)
    cavities = int((volumes < 0).sum()) if closed else 0
    misplaced = _misplaced_shells(whole, labels, volumes, threads) if closed else 0
    return replace(
        tally.report(shells - cavities, cavities, misplaced),
        triangles=len(mesh.triangles),
        vertices=len(mesh.vertices),
        degenerate_triangles=flat,
        volume_mm3=float(volumes.sum()),
        area_mm2=area,
        bbox_mm=_box(mesh),
    )


def _misplaced_shells(
    mesh: Mesh, labels: NDArray[np.int32], volumes: NDArray[np.float64], threads: int
) -> int:
    """Shells whose outside is neither empty space nor, for a cavity, the material of one body."""
    from .shells import nesting

    return int((nesting(mesh, labels, volumes, threads=threads).winding != (volumes < 0)).sum())


def _box(mesh: Mesh) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Low and high corner of the bounding box, as tuples."""
    (x0, y0, z0), (x1, y1, z1) = mesh.bounds.tolist()
    return (x0, y0, z0), (x1, y1, z1)


@dataclass
class Tally:
    """Sums over finished pieces; fields as in `MeshReport`, but edges count by their ends, twice each."""

    threads: int = 0
    triangles: int = 0
    vertices: int = 0
    open_edges: int = 0
    nonmanifold_edges: int = 0
    misoriented_edges: int = 0
    nonmanifold_vertices: int = 0
    self_intersections: int = 0
    searched_triangles: int = 0
    degenerate_triangles: int = 0
    duplicate_triangles: int = 0
    volume: float = 0.0
    area: float = 0.0
    low: tuple[float, ...] = (np.inf,) * 3
    high: tuple[float, ...] = (-np.inf,) * 3

    def add(self, piece: Finished) -> None:
        """Add a piece."""
        from .model import edge_ends, self_intersecting_triangles

        mesh, passed = piece.mesh, piece.passed
        ends = edge_ends(mesh.triangles, piece.counted, self.threads)
        crossing = np.empty(0, np.int64)
        if len(piece.suspects):
            among = None
            if len(piece.suspects) < len(mesh.triangles):
                among = np.zeros(len(mesh.triangles), bool)
                among[piece.suspects] = True
            crosses = self_intersecting_triangles(mesh, threads=self.threads, among=among)
            crossing = np.flatnonzero(crosses[: piece.done])
        sizes = passed.sizes(self.threads)
        apex = passed.vertices[sizes.outermost[0, 0]] if len(passed.triangles) else np.zeros(3)
        self.triangles += len(passed.triangles)
        self.vertices += len(piece.points)
        self.open_edges += ends.open_edges
        self.nonmanifold_edges += ends.non_manifold_edges
        self.misoriented_edges += ends.misoriented_edges
        self.nonmanifold_vertices += ends.non_manifold_vertices
        self.self_intersections += len(crossing)
        self.searched_triangles += int(np.searchsorted(piece.suspects, piece.done))
        self.degenerate_triangles += int(sizes.flat[0])
        self.duplicate_triangles += _duplicates(mesh.triangles[crossing])
        self.volume += float(sizes.volumes[0] + dot(apex, sizes.vectors[0]) / 3)  # cones over the origin
        self.area += float(sizes.areas[0])
        if len(piece.points):
            low, high = bounds(piece.points, self.threads)
            self.low = tuple(np.minimum(self.low, low).tolist())
            self.high = tuple(np.maximum(self.high, high).tolist())

    def include(self, other: Tally) -> None:
        """Add the sums over other pieces."""
        for name in (f.name for f in fields(self)):
            if name not in ("threads", "low", "high"):
                setattr(self, name, getattr(self, name) + getattr(other, name))
        self.low = tuple(np.minimum(self.low, other.low).tolist())
        self.high = tuple(np.maximum(self.high, other.high).tolist())

    def report(self, bodies: int, cavities: int, misplaced: int) -> MeshReport:
        """Report on the whole mesh, as `check_mesh` returns it."""
        manifold = not (self.open_edges or self.nonmanifold_edges or self.nonmanifold_vertices)
        shells, euler = bodies + cavities, self.vertices - self.triangles // 2
        (x0, y0, z0), (x1, y1, z1) = self.low, self.high
        return MeshReport(
            triangles=self.triangles,
            vertices=self.vertices,
            watertight=not self.open_edges,
            manifold=manifold,
            oriented=not (self.misoriented_edges or misplaced),
            self_intersections=self.self_intersections,
            searched_triangles=self.searched_triangles,
            degenerate_triangles=self.degenerate_triangles,
            duplicate_triangles=self.duplicate_triangles,
            open_edges=self.open_edges // 2,
            nonmanifold_edges=self.nonmanifold_edges // 2,
            nonmanifold_vertices=self.nonmanifold_vertices,
            misoriented_edges=self.misoriented_edges // 2,
            misplaced_shells=misplaced,
            components=bodies,
            cavities=cavities,
            genus=shells - euler // 2 if manifold and not self.misoriented_edges else None,
            volume_mm3=self.volume,
            area_mm2=self.area,
            bbox_mm=((x0, y0, z0), (x1, y1, z1)),
        )


def _duplicates(triangles: NDArray[np.int32]) -> int:
    """Number of triangles with the three corners of an earlier one, in any order."""
    distinct = np.unique(np.sort(triangles, axis=1), axis=0) if len(triangles) else triangles
    return len(triangles) - len(distinct)


POINTS = 256
"""Random points on the field's surface, besides its extreme points."""

NEARBY, FARTHER = 2.5, 2.0
"""First distance within which triangles are searched, voxels, and its growth."""


def surface_to_mesh(
    planned: Plan, search: Callable[[NDArray[np.float64], float], NDArray[np.float64]], work: Work
) -> NDArray[np.float64]:
    """Distances from the extreme points of a field, and from other points on its surface, to the mesh.

    `search`: distances of points, float64 (n, 3), from the triangles within a reach, as `nearest` returns
    them. All in scene units. Returns float64 (n,).
    """
    points, voxel, reach = surface_samples(planned, work), planned.voxel, NEARBY * planned.voxel
    result = search(points, reach)
    # Triangles lie within a grid cell: any nearer one has its corners in reach.
    while (far := result > reach - np.sqrt(3) * voxel).any():
        reach *= FARTHER
        result[far] = search(points[far], reach)
    return result


def surface_samples(planned: Plan, work: Work) -> NDArray[np.float64]:
    """Extreme points of a field and other points on its surface, found without a mesh.

    Returns float64 (n, 3), scene units.
    """
    tips = planned.tips.T  # only extreme points that are still on the surface
    tips = tips[surface_error(planned.root, tips, planned.voxel, work) < NEAR * planned.voxel]
    samples = surface_points(planned.root, planned.outer, planned.voxel, POINTS, work)
    return np.concatenate([tips, samples])


def nearest(mesh: Mesh, points: NDArray[np.float64], reach: float, work: Work) -> NDArray[np.float64]:
    """Distances from points to the triangles of a mesh with a corner within reach; infinite without any.

    `points`: float64 (n, 3). Returns float64 (n,).
    """
    chosen = near(mesh.vertices, mesh.triangles, points, reach, work.threads)
    if not len(chosen):
        return np.full(len(points), np.inf)
    spots = Mesh(points, np.stack([np.arange(len(points), dtype=np.int32)] * 3, 1))
    return Nearest(Mesh(mesh.vertices, mesh.triangles[chosen])).samples(spots, 1.0, work)


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


STEEP, FLAT = 0.70710678, 0.8660254
"""Least parts of normals that point down: of what needs supports, 45 degrees, and of flat overhangs, 30."""
LARGE = 25.0
"""Area of a flat overhang, mm2."""
PLATE, AROUND = 0.05, 2.0
"""Height up to which a mesh lies on the plate, and how far above a local minimum it is held, mm."""


def overhanging(mesh: Mesh) -> NDArray[np.bool_]:
    """True for triangles that supports have to hold, bool [m]; the mesh stands on its lowest point, mm."""
    normals, height = mesh.normals, mesh.vertices[:, 2] - mesh.vertices[:, 2].min()
    area = np.linalg.norm(normals, axis=1)
    down = -normals[:, 2] / np.maximum(area, 1e-30)
    top = height[mesh.triangles].max(1)
    above = top > PLATE
    flat = above & (down > FLAT)
    patch = _patches(mesh, flat)
    large = np.bincount(patch[flat], area[flat] / 2, patch.max(initial=0) + 1) >= LARGE
    result = flat & large[patch]
    steep = above & (down > STEEP)
    patch = _patches(mesh, steep)
    least = np.full(patch.max(initial=0) + 1, -np.inf)  # of patches without a local minimum: none is held
    minima = _minima(mesh, height) & (height > PLATE)
    starts = minima[mesh.triangles].any(1) & steep
    least[patch[starts]] = np.inf
    np.minimum.at(least, patch[starts], height[mesh.triangles[starts]].min(1))
    held: NDArray[np.bool_] = result | (steep & (top <= least[patch] + AROUND))
    return held


def _minima(mesh: Mesh, height: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True for vertices that are no higher than their neighbours, bool [n]."""
    lowest = height.copy()
    for a in range(3):
        for b in range(3):
            np.minimum.at(lowest, mesh.triangles[:, a], height[mesh.triangles[:, b]])
    result: NDArray[np.bool_] = lowest == height
    return result


def _patches(mesh: Mesh, some: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Number of the patch of each of some triangles that share vertices; 0 for the others, int [m]."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = mesh.triangles[some]
    one, other = corners.reshape(-1), np.roll(corners, 1, axis=1).reshape(-1)
    links = coo_array((np.ones(len(one), bool), (one, other)), shape=(len(mesh.vertices),) * 2)
    labels = connected_components(links, directed=False)[1]
    result = np.zeros(len(mesh.triangles), np.intp)
    result[some] = labels[corners[:, 0]]
    return result


HANGS, IS_THIN = (214, 40, 40), (240, 160, 30)
"""Colours of triangles that hang in the air, and of thin walls, sRGB."""


def marked(mesh: Mesh, wall: float, threads: int = 0) -> Mesh:
    """A mesh for pictures: in red what hangs in the air, in orange walls that are thinner than `wall` mm."""
    from scipy.spatial import cKDTree

    tree = build(mesh, threads, halved=True)
    walls = thin_walls(MeshSurface(mesh.vertices, mesh.triangles, *tree), len(mesh.triangles), wall, threads)
    colours = np.tile(np.array(COLOUR, np.uint8), (len(mesh.triangles), 1))
    if len(walls.width):
        near, _ = cKDTree(walls.middle).query(mesh.corners.mean(1), distance_upper_bound=0.75 * wall)
        colours[np.isfinite(near)] = IS_THIN
    colours[overhanging(mesh)] = HANGS
    corners = np.arange(3 * len(mesh.triangles), dtype=np.int32).reshape(-1, 3)
    return Mesh(mesh.corners.reshape(-1, 3), corners, np.repeat(colours, 3, axis=0))
