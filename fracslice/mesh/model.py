"""Triangle mesh: measures, selections, edges and fans, components, a small picture, what other libraries
make of it, and spatial queries: distances and exact self-intersections.

Triangles are sorted in Morton order (G. M. Morton, 1966) and split into runs of `LEAF`. A complete binary
tree of boxes over the runs is stored as a heap: node i has the children 2i and 2i + 1.

Candidate pairs come from a tree of boxes; each pair is decided by the signs of exact predicates alone (the
idea of Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates",
2003). Adjacent triangles may meet only in the span of their shared vertices.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import Nearest as _Nearest
from .._native import component_sizes as _component_sizes
from .._native import edge_topology as _edge_topology
from .._native import foremost, surroundings
from .._native import self_intersecting_triangles as _self_intersecting_triangles
from .._native import tree as _tree
from ..common.arrays import Triangles, from_linear, product, to_linear
from ..common.messages import format_count, lacking
from ..common.parameters import AnyLength
from ..errors import MeshError
from ..work import Work, chunks

if TYPE_CHECKING:
    from manifold3d import Manifold


class EdgeTopology(NamedTuple):
    """Counts of edges and vertices of a mesh; all but `edges` are zero for a closed, oriented 2-manifold."""

    edges: int  # edges
    open_edges: int  # edges of one triangle
    non_manifold_edges: int  # edges of more than two triangles
    misoriented_edges: int  # edges of two triangles that traverse them in the same direction
    non_manifold_vertices: int  # vertices that join several fans


def edge_topology(triangles: NDArray[np.int32], vertices: int, threads: int = 0) -> EdgeTopology:
    """Count open, non-manifold and misoriented edges, and non-manifold vertices.

    O(m), or O(m log d) at vertices of degree d.

    `triangles`: int32 (m, 3).
    """
    ends = edge_ends(triangles, np.ones(vertices, dtype=np.bool_), threads)
    edges, opened, non_manifold, misoriented = (n // 2 for n in ends[:4])
    return EdgeTopology(edges, opened, non_manifold, misoriented, ends.non_manifold_vertices)


def edge_ends(triangles: NDArray[np.int32], counted: NDArray[np.bool_], threads: int = 0) -> EdgeTopology:
    """Counts of `edge_topology` at some vertices; edges are counted by their ends.

    An edge with both ends at these vertices counts twice.

    `triangles`: int32 (m, 3); `counted`: bool (n,).
    """
    return EdgeTopology(*_edge_topology(triangles, counted, threads))


class Sizes(NamedTuple):
    """Sizes of connected components."""

    # signed volumes, measured from `outermost[:, 0]`, which keeps the precision of small components
    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]  # areas
    vectors: NDArray[np.float64]  # vector areas; zero for closed components
    outermost: NDArray[np.int32]  # first vertices farthest out along -x, -y, -z, x, y and z
    flat: NDArray[np.int64]  # triangles without area


def component_sizes(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    labels: NDArray[np.int32],
    count: int,
    threads: int = 0,
) -> Sizes:
    """Sizes of connected components.

    `vertices`: float64 (n, 3); `triangles`: int32 (m, 3); `labels`: int32 (n,).
    """
    return Sizes(*_component_sizes(vertices, triangles, labels, count, threads))


@dataclass(frozen=True)
class Removed:
    """Bodies and cavities that `choose` removes."""

    # removed bodies. Those outside the part around the bodies that stay are never meshed, and not counted
    bodies: int = 0
    bodies_mm3: float = 0.0  # their volume, mm3
    cavities: int = 0  # removed cavities
    filled_mm3: float = 0.0  # volume of the filled ones, mm3


@dataclass(frozen=True, eq=False)
class Shells:
    """Shells of a mesh: its connected closed surfaces."""

    volumes: NDArray[np.float64]  # signed volumes, negative for cavities
    # smallest shell around each: a body for a cavity, a cavity for a body, -1 for none
    parent: NDArray[np.int64]

    @property
    def body(self) -> NDArray[np.int64]:
        """Outer shell of each shell, int64 [s]: the shell itself, or for a cavity the body around it."""
        return np.where(self.volumes < 0, self.parent, np.arange(len(self.volumes)))

    @property
    def solid_volumes(self) -> NDArray[np.float64]:
        """Volume of material of each body without its cavities, float64 [s]; zero for cavities."""
        volumes = np.zeros(len(self.volumes))
        np.add.at(volumes, self.body, self.volumes)
        return volumes


def choose(
    shells: Shells, *, keep: int | None = None, dust_mm3: float = 0.0, cavities: str = "keep"
) -> tuple[NDArray[np.bool_], Removed]:
    """Choose bodies and cavities.

    A cavity is removed with its body, and a body inside a cavity with the filling.

    `dust_mm3` in mm3. Returns bool (s,).
    """
    if cavities not in ("keep", "fill"):
        raise ValueError(f"no such choice: cavities={cavities!r}")
    hollow = shells.volumes < 0
    material = shells.volumes if cavities == "fill" else shells.solid_volumes
    stays = ~hollow & (material >= dust_mm3)
    if cavities == "fill":  # the filling absorbs bodies inside cavities
        stays &= shells.parent < 0
    if not stays.any():
        raise MeshError(f"nothing would be left: every body is smaller than {dust_mm3:g} mm3")
    if keep is not None:
        largest = np.argsort(np.where(stays, -material, 0), kind="stable")[:keep]
        stays &= np.isin(np.arange(len(stays)), largest)
    lost = ~hollow & ~stays
    filled = hollow & stays[shells.body] & (cavities == "fill")
    open_cavities = hollow & stays[shells.body] & ~filled
    removed = Removed(
        bodies=int(lost.sum()),
        bodies_mm3=float(shells.solid_volumes[lost].sum()),
        cavities=int((hollow & ~open_cavities).sum()),
        filled_mm3=float(np.abs(shells.volumes[filled]).sum()),
    )
    return stays | open_cavities, removed


CLAY = "#efe3d0"


@dataclass(frozen=True, eq=False, repr=False)
class Mesh(Triangles):
    """Triangle mesh with shared vertices. Both arrays are read-only.

    Attributes
    ----------
    vertices : ndarray of float64, shape (n, 3)
        Positions; mm in print space.
    triangles : ndarray of int32, shape (m, 3)
        Vertex indices, counter-clockwise seen from outside.
    colours : ndarray of uint8, shape (n, 3), optional
        Colours of the vertices, sRGB.
    scalars : mapping of str to ndarray of float32, shape (n,)
        Named numbers of the vertices.
    filaments : Filaments, optional
        Filaments of the triangles: their colours, and of which each triangle is.
    tops : ndarray of float64, optional
        Upper faces of the layers that are advised to slicers, above the lowest point.
    supported : ndarray of bool, shape (m,), optional
        Triangles at which supports are advised to slicers.

    Raises
    ------
    MeshError
        If an array does not hold three numbers in each row.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.vstack([np.zeros(3), np.eye(3)])
    >>> mesh = Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> mesh
    <Mesh of 4 triangles, 4 vertices, 1 x 1 x 1>
    >>> mesh.is_watertight, round(mesh.volume, 6)
    (True, 0.166667)
    """

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float64), ("triangles", np.int32)):
            array = np.asarray(getattr(self, name), kind).view()
            if array.ndim != 2 or array.shape[1] != 3:
                raise MeshError(f"{name}: expected an array [n, 3], found one of shape {list(array.shape)}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        object.__setattr__(self, "scalars", MappingProxyType(dict(self.scalars)))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle and copy the arrays, as mapping proxies and read-only flags are not."""
        return Mesh, self._arrays

    def __repr__(self) -> str:
        x, y, z = self.size
        triangles, vertices = len(self.triangles), len(self.vertices)
        counts = f"{format_count(triangles, 'triangle')}, {format_count(vertices, 'vertex', 'vertices')}"
        return f"<{type(self).__name__} of {counts}, {x:.6g} x {y:.6g} x {z:.6g}>"

    @property
    def faces(self) -> NDArray[np.int32]:
        """Alias of `triangles`, as in trimesh and pyvista."""
        return self.triangles

    @property
    def is_watertight(self) -> bool:
        """True if every edge joins exactly two triangles."""
        topology = edge_topology(self.triangles, len(self.vertices))
        return len(self.triangles) > 0 and not (topology.open_edges or topology.non_manifold_edges)

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corner positions, float64 [m, 3, 3]: triangle, corner, axis."""
        return self.vertices[self.triangles]

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Low and high corner of the bounding box, float64 [2, 3]; zeros for an empty mesh."""
        if not len(self.vertices):
            return np.zeros((2, 3))
        from .._native import bounds

        return np.array(bounds(self.vertices, 1))

    @property
    def size(self) -> NDArray[np.float64]:
        """Extents along x, y and z, float64 [3]."""
        low, high = self.bounds
        size: NDArray[np.float64] = high - low
        return size

    @property
    def normals(self) -> NDArray[np.float64]:
        """Normal of each triangle, of twice its area, float64 [m, 3]."""
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return _cross(b - a, c - a)

    @property
    def area(self) -> float:
        """Surface area."""
        return float(self.sizes(1).areas[0])

    @property
    def volume(self) -> float:
        """Signed volume, by the divergence theorem; positive if the triangles face outwards."""
        return float(self.sizes(1).volumes[0])

    def sizes(self, threads: int) -> Sizes:
        """Sizes of the mesh as one component.

        Parameters
        ----------
        threads : int
            Threads; 0 for all cores.

        Returns
        -------
        Sizes
            Arrays of one element.
        """
        labels = np.zeros(len(self.vertices), np.int32)
        return component_sizes(self.vertices, self.triangles, labels, 1, threads)

    def translated(self, offset: tuple[float, float, float] | NDArray[np.float64]) -> Mesh:
        """Translated copy.

        Parameters
        ----------
        offset : array_like of float64, shape (3,)
            Translation.

        Returns
        -------
        Mesh
            The copy.
        """
        return self._with(self.vertices + np.asarray(offset, dtype=np.float64))

    def scaled(self, factor: float) -> Mesh:
        """Copy scaled about the origin.

        Parameters
        ----------
        factor : float
            Scale factor, positive: a mirror image would be inside out.

        Returns
        -------
        Mesh
            The copy.

        Raises
        ------
        ValueError
            If the factor is not positive.
        """
        if not factor > 0:
            raise ValueError(f"scale factor must be positive, not {factor}")
        return self._with(self.vertices * factor)

    def selected(self, keep: NDArray[np.bool_], threads: int = 1) -> Mesh:
        """Select triangles, and the vertices they use.

        Parameters
        ----------
        keep : ndarray of bool, shape (m,)
            True for each triangle that stays.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        Mesh
            The selection; this mesh if nothing is removed.
        """
        from .._native import selected

        if self.colours is not None or self.scalars:
            used = np.zeros(len(self.vertices), bool)
            used[self.triangles[keep]] = True
            number = np.cumsum(used, dtype=np.int32) - np.int32(1)
            return Mesh(*self._taken(np.flatnonzero(used), number[self.triangles[keep]])._arrays)
        kept = selected(self.vertices, self.triangles, keep, threads)
        return Mesh(*kept) if kept else self

    def in_order(self) -> Mesh:
        """Sort the vertices by their first use, so that the triangles alone determine the arrays.

        Returns
        -------
        Mesh
            The same triangles, in order, without unused vertices.
        """
        return Mesh(*super().in_order()._arrays)

    def compact(self) -> Mesh:
        """Remove unused vertices.

        Returns
        -------
        Mesh
            All triangles; this mesh if there are no such vertices.
        """
        return self.selected(np.ones(len(self.triangles), bool), 0)

    def _with(self, vertices: NDArray[np.float64]) -> Mesh:
        """Copy with other positions."""
        return Mesh(vertices, self.triangles, self.colours, self.scalars)

    def _repr_png_(self) -> bytes | None:
        """Picture in a notebook; None for an empty mesh."""

        return self.thumbnail()

    def thumbnail(self) -> bytes | None:
        """Draw the mesh in its colours, or in clay, on a transparent background.

        Returns
        -------
        bytes or None
            A PNG file of 480 x 360 pixels; None without triangles.
        """
        return thumbnail(self) if len(self.triangles) else None

    @staticmethod
    def load(path: str | Path) -> Mesh:
        """Read a mesh file.

        Parameters
        ----------
        path : str or path
            File; the extension selects the format, one of `fracslice.formats.ENDINGS`.

        Returns
        -------
        Mesh
            Its triangles, mm, with equal vertices joined, nothing repaired.

        Raises
        ------
        MeshError
            For a file that cannot be read.
        """
        from .models import read_mesh

        return read_mesh(path)

    def export(self, path: str | Path, metadata: Mapping[str, str] | None = None) -> Path:
        """Write the mesh to a file atomically.

        Parameters
        ----------
        path : str or Path
            File; the extension selects the format, one of `fracslice.formats.ENDINGS`, or .vdb for distances
            on 256 voxels along the longest side, of a closed mesh (`write_vdb` has others).
        metadata : mapping, optional
            Names and values, as far as the format supports them, for example Title.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ExportError
            For an empty mesh, an unknown extension, or a file that cannot be written.
        MeshError
            If the mesh encloses no solid, which a .vdb file needs.
        """
        if Path(path).suffix.lower() == ".vdb":
            from ..api.calls import write_vdb

            return write_vdb(self, path, metadata=metadata)
        from ..formats import write

        return write(self, path, metadata)

    def simplify(self, tolerance: AnyLength | None = None, *, faces: int | None = None) -> Mesh:
        """Copy with fewer triangles: within a tolerance, or as many as asked for.

        Its vertices are some of this mesh's. It is closed, an oriented manifold, and does not cut itself. The
        surfaces are proved to be within the tolerance of each other; for a number of triangles that is the
        smallest of a series in steps of 25 %. A crumb within the tolerance of a body may end up inside it.

        Parameters
        ----------
        tolerance : float or str, optional
            Maximum distance between the surfaces, mm, or text with a unit.
        faces : int, optional
            Most triangles that are left, in place of a tolerance.

        Returns
        -------
        Mesh
            Without colours and scalars.

        Raises
        ------
        MeshError
            If this mesh is not a closed, oriented manifold, or cannot be simplified so far.

        Examples
        --------
        >>> from fracslice import make_mesh, sphere
        >>> ball = make_mesh(sphere(10), resolution=32)
        >>> len(ball.simplify(faces=500).faces)
        500
        """
        from .simplify import simplify, simplify_to

        if (tolerance is None) == (faces is None):
            raise MeshError("expected a tolerance or a number of faces, and not both")
        return (simplify_to(self, faces) if tolerance is None else simplify(self, tolerance))[0]

    def to_pyvista(self) -> Any:
        """Copy of the mesh as a `pyvista.PolyData`.

        Returns
        -------
        pyvista.PolyData
            The same vertices and triangles; scalars and, as "RGB", colours are point data.

        Raises
        ------
        MeshError
            If pyvista is not installed.
        """
        if reason := lacking("pyvista", "windows need"):
            raise MeshError(reason)
        import pyvista

        surface: Any = pyvista.PolyData
        made = surface.from_regular_faces(self.vertices.copy(), self.triangles)
        for name, values in self.scalars.items():
            made.point_data[name] = values
        if self.colours is not None:
            made.point_data["RGB"] = self.colours
        return made

    def plot(self, **options: Any) -> Any:
        """Show the mesh in a window, or in the output of a notebook cell.

        Parameters
        ----------
        **options
            Options of `pyvista.plot`, for example ``color`` or ``off_screen``.

        Returns
        -------
        object
            Result of `pyvista.plot`.

        Raises
        ------
        MeshError
            If pyvista is not installed.
        """
        usual = {"color": CLAY} if self.colours is None else {"scalars": "RGB", "rgb": True}
        return self.to_pyvista().plot(**{**usual, "split_sharp_edges": True, **options})


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cross products of rows, three times as fast as np.cross."""
    out = np.empty_like(a)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[:, k] = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    return out


_REASONS = {
    "NonFiniteVertex": "a coordinate is not a finite number",
    "NotManifold": "it is not closed, or an edge does not join exactly two triangles of the same sense",
    "VertexOutOfBounds": "a triangle names a vertex that does not exist",
    "ResultTooLarge": "it has too many triangles",
}


def to_manifold(mesh: Mesh) -> Manifold:
    """Convert a mesh to a manifold3d solid, in double precision, without repair."""
    if reason := lacking("manifold3d", "solids need"):
        raise MeshError(reason)
    import manifold3d

    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    corners = np.array(mesh.vertices, np.float64)  # copy: manifold3d needs a writeable array
    solid = manifold3d.Manifold(manifold3d.Mesh64(corners, mesh.triangles.astype(np.uint64)))
    status = solid.status().name
    if status != "NoError":
        raise MeshError(f"the mesh is not a solid: {_REASONS.get(status, status)}")
    return solid


WIDTH, HEIGHT, FINER = 480, 360, 2
"""Pixels of the picture, and samples along each side of a pixel."""

FILLED = 0.92
"""Largest fraction of the picture's sides that the mesh fills."""

COLOUR = (239, 227, 208)
"""Colour of a mesh without colours, sRGB."""

AMBIENT = 0.2
"""Share of the light that comes from everywhere."""

AXES = np.array([[0.876, 0.482, 0.0], [-0.2385, 0.4336, 0.8689], [0.4188, -0.7614, 0.4949]])
"""Directions in space that point to the right, up, and to the viewer."""

BELOW = np.array([[0.876, 0.482, 0.0], [0.2385, -0.4336, 0.8689], [0.4188, -0.7614, -0.4949]])
"""The same for a viewer who looks from below."""

LIGHT = np.array([-0.48, 0.62, 0.62])
"""Direction to the light: right, up, to the viewer."""


def thumbnail(mesh: Mesh, axes: NDArray[np.float64] = AXES) -> bytes:
    """Draw a mesh in its colours, or in clay, on a transparent background.

    `axes`: directions in space that point to the right, up, and to the viewer.
    """
    from PIL import Image

    file = io.BytesIO()
    drawn = Image.fromarray(_render_small(mesh, axes, WIDTH * FINER, HEIGHT * FINER))
    drawn.resize((WIDTH, HEIGHT), Image.Resampling.BOX).save(file, "PNG")
    return file.getvalue()


def _render_small(mesh: Mesh, axes: NDArray[np.float64], width: int, height: int) -> np.ndarray:
    """The picture with one sample per pixel, uint8 [height, width, 4]."""
    seen = product(mesh.vertices, axes.T)
    low, high = seen.min(0), seen.max(0)
    across = np.maximum((high - low)[:2] / (width, height), 1e-30).max() / FILLED
    seen = (seen - (low + high) / 2) / across + (width / 2, height / 2, 0)
    front = foremost(seen, mesh.triangles, (height, width))
    rows, columns = np.nonzero(front >= 0)
    shown = np.zeros((height, width, 4), np.uint8)
    shown[rows, columns] = _shades(mesh, seen, front[rows, columns])
    return shown[::-1]


def _shades(mesh: Mesh, seen: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Colours of some triangles in the light, uint8 [n, 4]."""
    corners = mesh.triangles[which]
    a, b, c = (seen[corners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None]
    lit = np.maximum(sum(normals[:, k] * LIGHT[k] for k in range(3)) * np.sign(normals[:, 2]), 0)
    own = np.array([COLOUR] if mesh.colours is None else mesh.colours[corners].mean(1)) / 255
    light = to_linear(own) * (AMBIENT + (1 - AMBIENT) * lit)[:, None]
    opaque = np.full((len(which), 1), 255, np.uint8)
    return np.hstack([np.uint8(255 * from_linear(np.minimum(light, 1)) + 0.5), opaque])


LEAF = 8
"""Triangles per leaf; equal to the constant in `fracslice/native/mesh/triangles.h`."""


class Tree(NamedTuple):
    """Tree of bounding boxes; node 1 is the root."""

    order: NDArray[np.int64]  # triangles in Morton order
    low: NDArray[np.float64]  # corners of the boxes
    high: NDArray[np.float64]


def build(mesh: Mesh, threads: int = 0, halved: bool = False) -> Tree:
    """Build the tree of a mesh, in O(m); in O(m log m) in halves of boxes, which makes searches faster."""
    return Tree(*_tree(mesh.vertices, mesh.triangles, threads, halved))


CHUNK = 1 << 17
"""Triangles between two checks for cancellation."""

UNKNOWN = np.empty((0, 3), np.int32)


class Nearest:
    """Distance queries to a mesh."""

    def __init__(self, mesh: Mesh, tree: Tree | None = None, closed: bool = False) -> None:
        self._native = _Nearest(mesh.vertices, mesh.triangles, *(tree or build(mesh)), closed)

    def bounds(
        self, mesh: Mesh, tolerance: float, work: Work, hints: NDArray[np.int32] = UNKNOWN
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Proved bounds on the distances of triangles from this mesh.

        The distance to one triangle is a convex function: a piece whose corners are all within a distance of
        the same triangle lies within it as a whole. Other pieces are subdivided (the idea of Tang, Lee and
        Kim, "Interactive Hausdorff distance computation for general polygonal models", 2009).

        `hints`: int32 (m, 3). Returns float64 (m,); int32 (k, 2).
        """
        bounds, beyond = np.empty(len(mesh.triangles)), [UNKNOWN[:, :2]]
        for part in chunks(len(bounds), CHUNK):
            work.check()
            bounds[part], pairs = self._native.bounds(
                mesh.vertices, mesh.triangles[part], hints[part], tolerance, work.threads
            )
            beyond.append(pairs + np.array([part.start, 0], np.int32))
        return bounds, np.concatenate(beyond)

    def points(self, points: NDArray[np.float64], threads: int = 0) -> NDArray[np.float64]:
        """Distances of points from this mesh; fast where consecutive points lie close together.

        `points`: float64 (n, 3). Returns float64 (n,).
        """
        return self._native.points(points, threads)

    def samples(self, mesh: Mesh, spacing: float, work: Work, enough: float = 0.0) -> NDArray[np.float64]:
        """Greatest distance of the samples of each triangle from this mesh.

        Samples are `spacing` apart and include corners and edges: no point is more than spacing / sqrt(3)
        farther. No distance is underestimated; one below `enough` may be overestimated, up to `enough`.

        Returns float64 (m,).
        """
        distances = np.empty(len(mesh.triangles))
        for part in chunks(len(distances), CHUNK):
            work.check()
            distances[part] = self._native.samples(
                mesh.vertices, mesh.triangles[part], spacing, enough, work.threads
            )
        return distances


def self_intersecting_triangles(
    mesh: Mesh,
    tree: Tree | None = None,
    threads: int | None = None,
    among: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Triangles that meet another one in more than their shared vertices and edges.

    Triangles without area are skipped. Vertices are shared by index.

    `among`: bool (m,). Returns bool (m,).
    """
    vertices, triangles, threads = mesh.vertices, mesh.triangles, threads or 0
    if among is None or tree is not None:
        return _self_intersecting_triangles(
            vertices, triangles, *(tree or build(mesh, threads)), threads, among
        )
    result, near = np.zeros(len(triangles), bool), surroundings(vertices, triangles, among, threads)
    if len(near):
        part = Mesh(vertices, triangles[near])
        result[near] = self_intersecting_triangles(part, build(part, threads), threads, among[near])
    return result
