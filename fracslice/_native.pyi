"""C++ parts of fracslice: marching cubes on bricks, questions about triangle meshes, and OpenVDB. Callers use
`fracslice.mesh` and `fracslice.volume.grid`.

Arrays are C-contiguous and as `fracslice.volume.bricks.Bricks` describes them. Long calls let other threads
run.
"""

from collections.abc import Callable
from typing import Any

from numpy import bool_, float32, float64, int32, int64, uint8, uint32
from numpy.typing import NDArray

from .kernel.machine import Function

Point = tuple[float, float, float]
Loop = tuple[Function, NDArray[Any], NDArray[Any]] | Callable[..., None]
"""A compiled loop, its parameters and its frame, in its precision; or a function of the rows that it reads,
[6, n], those that it writes, and where it takes steps their number."""

def marching_cubes(
    ijk: NDArray[int32],
    values: NDArray[float32],
    index: NDArray[int32],
    origin: Point,
    voxel: float,
    minimum_edge_parameter: float,
    threads: int = 0,
) -> tuple[NDArray[float64], NDArray[int32]]:
    """The surface between the samples < 0 and the others: closed, an oriented 2-manifold, free of
    self-crossings.

    minimum_edge_parameter: how near a grid point a vertex may come, as a share of the edge. threads: 0 for
    all cores; the result is the same for any number.

    Returns vertices float64 [n, 3] at origin + voxel * (grid position); triangles int32 [m, 3],
    counter-clockwise seen from outside. Marching cubes after Lorensen and Cline (1987), with a table that
    `make_cases.py` derives.

    Raises ValueError if a sign change leaves the samples or the arrays contradict each other, and for a
    surface of more than 2^31 vertices or triangles.
    """

def signs(values: NDArray[float32], threads: int = 0) -> NDArray[uint8]:
    """Sign bits uint8 [n, 8, 8] of samples float32 [n, 512]: bit z of byte (x, y) set where < 0."""

class RootLoops:
    """The loops of `fracslice.volume.root_loops` that find crossings: `find` in float32 and in float64, and
    `polish`. field: the same float64 field, `CpuKernel.entry` or a function of points [3, n] and of [1, n]
    for their values. Holds all of them. lanes: segments and points come in multiples of it. batch: how many
    segments are worth a call. steps: that all segments are given, and those that then are left. sure: a root
    is exact where it moved less."""

    def __init__(
        self,
        lanes: int,
        batch: int,
        guess: Loop,
        find: Loop,
        polish: Loop,
        field: tuple[Function, NDArray[float64]] | Callable[[NDArray[float64], NDArray[float64]], None],
        steps: tuple[int, int],
        sure: float,
    ) -> None: ...

class Cells:
    """The grid cells that a surface passes, numbered once, to be meshed as a whole or in pieces.

    A piece is the layers of bricks `first` to `last - 1` along x; layers past both ends are allowed: cells of
    the surface may lie beside the samples. Raises ValueError if a sign change leaves the samples, the arrays
    contradict each other or the bricks are not in order, and for more than 2^31 crossings.
    """

    def __init__(
        self, ijk: NDArray[int32], signs: NDArray[uint8], index: NDArray[int32], threads: int = 0
    ) -> None: ...
    def crossings_before(self, layer: int) -> int:
        """How many crossings the bricks before a layer number."""

    def segments(self, begin: int, end: int, origin: Point, voxel: float) -> NDArray[float64]:
        """The grid edges that the surface crosses, numbers `begin` to `end` - 1 in the order of the vertices
        of `marching_cubes`: float64 [6, n], where each starts and from there to its end, scene units. Raises
        ValueError where there are no such crossings."""

    def find_crossings(
        self,
        begin: int,
        end: int,
        origin: Point,
        voxel: float,
        loops: RootLoops,
        t: NDArray[float64],
        normals: NDArray[float32],
    ) -> None:
        """Writes where on these edges, all of their bricks', the surface is, as shares of them, to t, [n];
        and its unit normals there to normals, [3, n], each row contiguous. Raises ValueError as `segments`,
        or for arrays of another length, and whatever Python functions raise."""

class Contouring:
    """The surface of `marching_cubes` in some layers of cells, through exact crossings, its edges and corners
    kept: made layer by layer, from the one before `first` to `last`. Raises ValueError for more than 2^31
    vertices or triangles.
    """

    def __init__(
        self,
        cells: Cells,
        first: int,
        last: int,
        origin: Point,
        voxel: float,
        minimum_edge_parameter: float,
    ) -> None: ...
    def advance(self, end: int, first: int, t: NDArray[float64], normals: NDArray[float32]) -> None:
        """Goes on to the layer before `end`. t: where on its edge the surface crosses each of those numbered
        from `first` on, [n]; normals: unit, outward, [3, n], each row contiguous: all of these layers and of
        the layer `end`, or ValueError is raised."""

    def finish(self) -> tuple[NDArray[float64], NDArray[int32], int, NDArray[uint8], NDArray[float32]]:
        """Vertices and triangles as `marching_cubes`, how many vertices are crossings (the first: those of
        the layers `first` to `last`), and for each of the others, in faces and cells, the case of its cell,
        of the upper one at a face: bit dx + 2 dy + 4 dz set for an inside grid point; and the way from it to
        the mean of the crossings around it, [3] in voxels, zero where the axes' planes meet in it. Raises
        ValueError while layers are left."""

def open_edges(ijk: NDArray[int32], values: NDArray[float32], index: NDArray[int32]) -> int:
    """How many grid edges with a sign change touch a point without a sample: 0 if the surface is closed."""

class Grid:
    """A sparse OpenVDB level set."""

    @staticmethod
    def from_bricks(
        ijk: NDArray[int32], values: NDArray[float32], index: NDArray[int32], origin: Point, voxel: float
    ) -> Grid:
        """Active where sampled; the background is the largest sample, negative inside."""

    @staticmethod
    def read(path: str, name: str = "") -> Grid:
        """The float grid of that name in a .vdb file, or the first one. Raises RuntimeError."""

    def write(self, path: str, metadata: dict[str, str]) -> None:
        """Writes a .vdb file. Raises RuntimeError if not all of it could be written."""

    def to_bricks(self) -> tuple[list[float], float, NDArray[int32], NDArray[float32], NDArray[int32]]:
        """origin, voxel, ijk, values, index. Raises ValueError unless voxels are axis-aligned cubes."""

    def mesh(self, adaptivity: float = 0.0) -> tuple[NDArray[float32], NDArray[uint32], NDArray[uint32]]:
        """OpenVDB's own surface (dual contouring): points [n, 3], triangles [m, 3], quads [k, 4]."""

    def redistance(self) -> Grid:
        """The same surface in a field of distances, by fast sweeping (Zhao, 2004). Raises ValueError."""

    def offset(self, distance: float) -> Grid:
        """The surface of a field of distances moved outwards, in scene units. Raises ValueError."""

    def surfaces(self) -> list[Grid]:
        """One grid for each connected piece of the surface, the largest first."""

    name: str
    @property
    def metadata(self) -> dict[str, str]: ...
    @property
    def background(self) -> float: ...
    @property
    def active_voxels(self) -> int: ...
    @property
    def leaves(self) -> int: ...
    @property
    def memory(self) -> int:
        """Bytes."""

# On triangle meshes: vertices [n, 3], triangles [m, 3]. All raise ValueError for an index out of range and
# for arrays that contradict each other; results are the same for any number of threads.

def edge_topology(
    triangles: NDArray[int32], counted: NDArray[bool_], threads: int = 0
) -> tuple[int, int, int, int, int]:
    """`fracslice.mesh.links.edge_ends`."""

def corners_by_vertex(
    triangles: NDArray[int32], vertices: int, threads: int = 0
) -> tuple[NDArray[int64], NDArray[int64]]: ...
def connected_components(
    triangles: NDArray[int32], vertices: int, threads: int = 0
) -> tuple[NDArray[int32], int]: ...
def component_sizes(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    labels: NDArray[int32],
    count: int,
    threads: int = 0,
) -> tuple[NDArray[float64], NDArray[float64]]:
    """`fracslice.mesh.links.component_sizes`."""

def measures(
    vertices: NDArray[float64], triangles: NDArray[int32], point: Point, threads: int = 0
) -> tuple[float, float, int]:
    """The triangles' area, the signed volume between them and a point, and how many have no area."""

def turned(
    vertices: NDArray[float64], triangles: NDArray[int32], points: NDArray[float64], threads: int = 0
) -> NDArray[int64]:
    """The triangles, ascending, that are flat or turn by a right angle or more when the vertices move to
    `points`."""

def pointed(
    vertices: NDArray[float64], triangles: NDArray[int32], sine: float, threads: int = 0
) -> NDArray[int64]:
    """The vertices, ascending, from which all edges fall off, at an angle of at least that sine."""

def bounds(points: NDArray[float64], threads: int = 0) -> tuple[Point, Point]:
    """Low and high corner of the box around points, float64 [n, 3]. Raises ValueError if there are none."""

def quantise(
    points: NDArray[float64], planes: NDArray[float64], threads: int = 0
) -> tuple[NDArray[float64], NDArray[bool_]]:
    """`fracslice.mesh.rounding.quantise`. Raises ValueError for a coordinate that is not finite."""

def selected(
    vertices: NDArray[float64], triangles: NDArray[int32], keep: NDArray[bool_], threads: int = 0
) -> tuple[NDArray[float64], NDArray[int32]] | None:
    """`fracslice.mesh.model.Mesh.selected`; None if nothing goes."""

def touching(triangles: NDArray[int32], vertices: NDArray[bool_], threads: int = 0) -> NDArray[int64]:
    """The triangles, ascending, with a corner among some vertices, bool [n]."""

def surroundings(
    vertices: NDArray[float64], triangles: NDArray[int32], of: NDArray[bool_], threads: int = 0
) -> NDArray[int64]:
    """The triangles, ascending, that may meet one of some, bool [m], and these."""

def stl(vertices: NDArray[float64], triangles: NDArray[int32], threads: int = 0) -> NDArray[uint8]:
    """The triangles as binary STL holds them, uint8 [m, 50]."""

def weld(points: NDArray[float32]) -> tuple[NDArray[int64], NDArray[int32]]: ...
def tree(
    vertices: NDArray[float64], triangles: NDArray[int32], threads: int = 0
) -> tuple[NDArray[int64], NDArray[float64], NDArray[float64]]:
    """`fracslice.mesh.tree.Tree`."""

def self_intersecting_triangles(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    order: NDArray[int64],
    low: NDArray[float64],
    high: NDArray[float64],
    threads: int = 0,
    among: NDArray[bool_] | None = None,
) -> NDArray[bool_]: ...

class Reduction:
    """`fracslice.mesh.collapse.Collapse`; it looks into these arrays as long as it lives."""

    def __init__(self, vertices: NDArray[float64], triangles: NDArray[int32], tolerance: float) -> None: ...
    def renew(self) -> None:
        """All vertices are looked at by the next sweeps."""

    def sweep(self, first: int, last: int, share: float) -> int:
        """Takes out such of the vertices first to last - 1 as can go with an error of a share of the
        tolerance, and returns how many; a sweep begins with first = 0."""

    def undo(self, faulty: NDArray[bool_]) -> None: ...
    def state(
        self,
    ) -> tuple[NDArray[int32], NDArray[bool_], NDArray[int32], NDArray[bool_], NDArray[int32]]:
        """`fracslice.mesh.collapse.Collapsed`."""

class Nearest:
    """`fracslice.mesh.nearest.Nearest`; it looks into these arrays as long as it lives."""

    def __init__(
        self,
        vertices: NDArray[float64],
        triangles: NDArray[int32],
        order: NDArray[int64],
        low: NDArray[float64],
        high: NDArray[float64],
        closed: bool = False,
    ) -> None: ...
    def bounds(
        self,
        vertices: NDArray[float64],
        triangles: NDArray[int32],
        hints: NDArray[int32],
        tolerance: float,
        threads: int = 0,
    ) -> tuple[NDArray[float64], NDArray[int32]]: ...
    def samples(
        self,
        vertices: NDArray[float64],
        triangles: NDArray[int32],
        spacing: float,
        enough: float,
        threads: int = 0,
    ) -> NDArray[float64]: ...

def nesting(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    labels: NDArray[int32],
    sizes: NDArray[float64],
    first: NDArray[int64],
    threads: int = 0,
) -> tuple[NDArray[int64], NDArray[int64]]:
    """winding, parent."""

def side_of_line(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int: ...
def side_of_plane(a: Point, b: Point, c: Point, d: Point) -> int: ...
