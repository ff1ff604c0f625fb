"""C++ parts of fracslice: marching cubes on bricks, and triangle meshes. Call `fracslice.mesh` instead.

Arrays are C-contiguous and laid out as in `fracslice.volume.bricks.Bricks`. Long calls release the GIL.
"""

from collections.abc import Callable, Sequence
from typing import Any

from numpy import bool_, float32, float64, int8, int16, int32, int64, uint8
from numpy.typing import NDArray

from .expr.runtime import CompiledFunction

Point = tuple[float, float, float]
Loop = tuple[CompiledFunction, NDArray[Any], NDArray[Any]] | Callable[..., None]
"""A compiled loop, its parameters and its frame, in its precision; or a function of the rows it reads,
[6, n], the rows it writes, and for an iterative loop the number of steps.
"""

def marching_cubes(
    ijk: NDArray[int32],
    values: NDArray[float32],
    index: NDArray[int32],
    origin: Point,
    voxel: float,
    minimum_edge_parameter: float,
    threads: int = 0,
) -> tuple[NDArray[float64], NDArray[int32]]:
    """Surface between samples < 0 and the others.

    The surface is a closed, oriented 2-manifold without self-intersections: marching cubes (Lorensen and
    Cline, 1987) with a table derived by `make_cases.py`.

    Parameters
    ----------
    ijk, values, index : ndarray
        Samples, as in `fracslice.volume.bricks.Bricks`.
    origin : tuple of float
        Position of the grid's origin.
    voxel : float
        Spacing of the grid.
    minimum_edge_parameter : float
        Minimum distance of a vertex from a grid point, as a fraction of the edge.
    threads : int, optional
        Threads; 0 for all cores. The result does not depend on it.

    Returns
    -------
    vertices : ndarray of float64, shape (n, 3)
        Positions, origin + voxel * (grid position).
    triangles : ndarray of int32, shape (m, 3)
        Triangles, counter-clockwise seen from outside.

    Raises
    ------
    ValueError
        If the surface leaves the samples, for inconsistent arrays, or for more than 2^31 vertices or
        triangles.
    """

def signs(values: NDArray[float32], threads: int = 0) -> NDArray[uint8]:
    """Sign bits uint8 [n, 8, 8] of samples float32 [n, 512]: bit z of byte (x, y) is set if < 0."""

Entry = tuple[CompiledFunction, NDArray[Any]] | Callable[[NDArray[float64], NDArray[float64]], None]
"""A field: `Kernel.entry`, machine code and its parameters, or a function of points [3, n] and of values
[1, n] to be written.
"""

class Regions:
    """Elements of a long union that matter near a point, for compiled code.

    Parameters
    ----------
    points : CompiledFunction
        Loop `expr.loops.points` in float64 over the field of one element.
    numbers : ndarray of float64, shape (n, size)
        P of each element.
    width : int
        Lanes of the loop.
    smooth : float
        Width of the seams.
    lipschitz : float
        Lipschitz constant of the union.
    centre : tuple of float
        Centre of a cube; points outside see all elements.
    half : float
        Half side of the cube.
    """

    def __init__(
        self,
        points: CompiledFunction,
        numbers: NDArray[float64],
        width: int,
        smooth: float,
        lipschitz: float,
        centre: tuple[float, ...],
        half: float,
    ) -> None: ...
    @property
    def points(self) -> Near:
        """What compiled code asks about points."""
    @property
    def bricks(self) -> Near:
        """What it asks about the points of a brick, of which the corners come first."""

class Near:
    """Functions that compiled code calls."""

    @property
    def address(self) -> int:
        """Where they are."""

class Sides:
    """Six sides of the object within a box, proven by free balls: -x, -y, -z, x, y and z.

    Parameters
    ----------
    sign : Entry
        Field; its signs count.
    conservative : Entry
        Field to skip space by: its values divided by `lipschitz` are radii of free balls.
    lipschitz : float
        Lipschitz bound of `conservative`.
    far : bool
        True if these radii are nearly maximal, from far away too.
    lo, hi : tuple of float
        Box to search.
    threads : int, optional
        Threads; 0 for all cores. The sides do not depend on it.
    """

    def __init__(
        self,
        sign: Entry,
        conservative: Entry,
        lipschitz: float,
        far: bool,
        lo: Point,
        hi: Point,
        threads: int = 0,
    ) -> None: ...
    def learn(self, points: NDArray[float64]) -> None:
        """Add interior points [3, 6, n], n for each side; those that are NaN are ignored."""

    def guess(self, share: float, aim: float, most: int) -> None:
        """Search for tips with a fraction of the Lipschitz bound; `aim` and `most` as for `prove`."""

    def prove(self, aim: float, most: int) -> None:
        """Lower the ceilings of columns to `aim` above the highest interior point; about `most` columns are
        processed at most.
        """

    @property
    def best(self) -> NDArray[float64]:
        """Highest interior points of each side, [3, 6, 4], the highest first; NaN where none is known."""

    @property
    def known(self) -> NDArray[float64]:
        """Height of the highest interior point of each side, outwards, [6]; -inf where none is known."""

    @property
    def above(self) -> NDArray[float64]:
        """Height above which nothing is, of each side, [6]."""

    @property
    def spent(self) -> NDArray[float64]:
        """Columns processed by each side, [6]."""

def climb(
    field: Entry,
    starts: NDArray[float64],
    steps: NDArray[float64],
    gain: NDArray[float64],
    first: float,
    exact: float,
    threads: int = 0,
) -> NDArray[float64]:
    """Extreme points of a solid in given directions; call `fracslice.volume.extent.climb`."""

def surface_error(
    field: Entry,
    points: NDArray[float64],
    scale: float,
    offset: Point,
    steps: NDArray[float64],
    step: float,
    voxel: float,
    threads: int = 0,
) -> NDArray[float64]:
    """Distances of points from a surface; call `fracslice.mesh.fit.surface_error`."""

class ProjectionLoops:
    """Compiled loops that project points to a surface; keeps its arguments alive.

    Parameters
    ----------
    lanes : int
        Segments come in multiples of it.
    lead, guess, find, aim : Loop
        Loops of `fracslice.mesh.root_loops`: `lead` and `find` in float32, `find` and `aim` in float64.
    field : Entry
        The same float64 field.
    """

    def __init__(self, lanes: int, lead: Loop, guess: Loop, find: Loop, aim: Loop, field: Entry) -> None: ...

def project(
    points: NDArray[float64],
    first: int,
    last: int,
    loops: ProjectionLoops,
    trust_regions: Callable[[NDArray[int64], NDArray[bool_]], NDArray[float64]],
    voxel: float,
    threads: int = 0,
) -> None:
    """Project points `first` to `last` - 1, in place; call `fracslice.mesh.contouring.project`."""

class RootLoops:
    """Compiled loops that locate crossings on grid edges; keeps its arguments alive.

    Parameters
    ----------
    lanes : int
        Segments and points come in multiples of it.
    batch : int
        Minimum segments of an efficient call.
    guess, find, polish : Loop
        Loops of `fracslice.volume.root_loops`: `find` in float32, `find` in float64, and `polish`.
    field : Entry
        The same float64 field.
    sure : float
        A root that `polish` moves less than this is exact.
    """

    def __init__(
        self, lanes: int, batch: int, guess: Loop, find: Loop, polish: Loop, field: Entry, sure: float
    ) -> None: ...

class Cells:
    """Numbered grid cells of a surface, to be meshed as a whole or in pieces.

    A piece is the layers of bricks `first` to `last` - 1 along x. Layers beyond both ends are allowed: cells
    of the surface may lie beside the samples.

    Raises
    ------
    ValueError
        If the surface leaves the samples, for inconsistent arrays or unordered bricks, or for more than 2^31
        crossings.
    """

    def __init__(
        self, ijk: NDArray[int32], signs: NDArray[uint8], index: NDArray[int32], threads: int = 0
    ) -> None: ...
    def crossings_before(self, layer: int) -> int:
        """Number of crossings in the bricks before a layer."""

    def edges(self, begin: int, end: int) -> NDArray[int16]:
        """Grid edges that the surface crosses.

        Parameters
        ----------
        begin, end : int
            Crossings `begin` to `end` - 1, in the order of the vertices of `marching_cubes`.

        Returns
        -------
        ndarray of int16, shape (n, 4)
            Lower grid point and axis of each edge.

        Raises
        ------
        ValueError
            For crossings that do not exist.
        """

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
        """Locate the surface on the grid edges of whole bricks.

        Parameters
        ----------
        begin, end : int
            As in `edges`.
        origin : tuple of float
            Position of the grid's origin, scene units.
        voxel : float
            Spacing of the grid, scene units.
        loops : RootLoops
            Compiled loops over the field.
        t : ndarray of float64, shape (n,)
            Written: edge parameters of the crossings.
        normals : ndarray of float32, shape (3, n)
            Written: unit normals at the crossings; each row is contiguous.

        Raises
        ------
        ValueError
            For crossings that do not exist, or arrays of another length. Exceptions of Python functions pass
            through.
        """

def trust_regions(
    features: NDArray[float64],
    cases: NDArray[uint8],
    to_means: NDArray[float32],
    which: NDArray[int64],
    inside: NDArray[bool_],
    origin: Point,
    voxel: float,
    minimum_edge_parameter: float,
) -> NDArray[float64]:
    """Trust regions of features, as `Contouring.finish` returns them, float64 [4, 3, n].

    The interior of the cell or face of each feature, its nearest corner of the other sign, and the mean of
    the crossings around it. Raises ValueError for arrays that do not fit.
    """

class Contouring:
    """Surface of `marching_cubes` through exact crossings, with sharp edges and corners, in layers of cells.

    Layers are added in order, from the one before `first` to `last`. Raises ValueError for more than 2^31
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
        """Add the layers before `end`.

        Parameters
        ----------
        end : int
            First layer that is not added.
        first : int
            Number of the first given crossing.
        t : ndarray of float64, shape (n,)
            Edge parameters of the crossings of these layers and of layer `end`.
        normals : ndarray of float32, shape (3, n)
            Unit outward normals at the crossings; each row is contiguous.

        Raises
        ------
        ValueError
            If crossings are missing.
        """

    def finish(
        self,
    ) -> tuple[NDArray[float64], NDArray[int32], int, NDArray[uint8], NDArray[float32], NDArray[float64]]:
        """Finished surface.

        Returns
        -------
        vertices : ndarray of float64, shape (n, 3)
            Crossings of layers `first` to `last`, then feature vertices in faces and cells.
        triangles : ndarray of int32, shape (m, 3)
            Triangles, counter-clockwise seen from outside.
        count : int
            Number of crossings.
        cases : ndarray of uint8, shape (n - count,)
            Case of the cell of each feature vertex, at a face of the upper cell: bit dx + 2 dy + 4 dz is set
            for an inside grid point.
        to_means : ndarray of float32, shape (n - count, 3)
            Vector from each feature vertex to the mean of the crossings around it, voxels; zero where the
            tangent planes are axis-aligned.
        blunt : ndarray of float64, shape (k, 3)
            Middles of cells that an edge or corner of the surface should be in but is not.

        Raises
        ------
        ValueError
            If layers are missing.
        """

def open_edges(ijk: NDArray[int32], values: NDArray[float32], index: NDArray[int32]) -> int:
    """Number of grid edges with a sign change at a point without a sample: 0 for a closed surface."""

# Triangle meshes: vertices [n, 3], triangles [m, 3]. All functions raise ValueError for an index out of range
# or inconsistent arrays. Results do not depend on the number of threads.

def edge_topology(
    triangles: NDArray[int32], counted: NDArray[bool_], threads: int = 0
) -> tuple[int, int, int, int, int]:
    """See `fracslice.mesh.model.edge_ends`."""

def corners_by_vertex(
    triangles: NDArray[int32], vertices: int, threads: int = 0
) -> tuple[NDArray[int64], NDArray[int64]]:
    """First corner of each vertex, [n + 1]; corners by vertex: corner k of triangle t is 3 t + k."""

def fans(
    triangles: NDArray[int32],
    beyond: NDArray[int64],
    vertices: NDArray[float64],
    normals: NDArray[float64],
    alike: NDArray[float64],
    fixed: NDArray[bool_],
    apexes: NDArray[int32],
    thin: float,
    sharp: float,
    most: int,
    threads: int = 0,
) -> list[tuple[list[int], list[tuple[int, int, int]]] | None]:
    """Disk around each apex, grown until all of it is seen from there, and the fan that replaces it.

    None if there is no such disk, or if it would swallow a fixed vertex. `beyond`: triangle beyond each side,
    or -1; `normals` of the surface at the triangles; `alike`: the same, rounded: of equal ones the first
    counts; `thin`: minimum height of a triangle; `sharp`: minimum cosine between it and one of the normals;
    `most`: maximum triangles of a disk.
    """

def connected_components(
    triangles: NDArray[int32], vertices: int, threads: int = 0
) -> tuple[NDArray[int32], int]:
    """Component of each vertex, numbered by first vertices, -1 if unused; and their number.

    Triangles with a common vertex are connected.
    """

def component_sizes(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    labels: NDArray[int32],
    count: int,
    threads: int = 0,
) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64], NDArray[int32], NDArray[int64]]:
    """See `fracslice.mesh.model.component_sizes`."""

def turned(
    vertices: NDArray[float64], triangles: NDArray[int32], frame: tuple[float, Point, float], threads: int = 0
) -> NDArray[int64]:
    """Triangles, ascending, that degenerate or turn by at least 90 degrees when they are quantised."""

def pointed(
    vertices: NDArray[float64], triangles: NDArray[int32], sine: float, most: int, threads: int = 0
) -> NDArray[int64]:
    """Vertices, ascending, from which all edges descend, at an angle of at least that sine.

    More than `most`, but not all, where there are more.
    """

def bounds(points: NDArray[float64], threads: int = 0) -> tuple[Point, Point]:
    """Low and high corner of the bounding box of points, float64 [n, 3]. Raises ValueError without points."""

def quantise(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    keep: NDArray[bool_],
    displaced: NDArray[bool_],
    rows: NDArray[int64],
    corners: NDArray[int32],
    planes: NDArray[float64],
    frame: tuple[float, Point, float],
    threads: int = 0,
) -> tuple[NDArray[float64], NDArray[int32], NDArray[bool_], NDArray[int64]]:
    """See `fracslice.mesh.cleaning.quantise`. Raises ValueError for a coordinate that is not finite."""

def selected(
    vertices: NDArray[float64], triangles: NDArray[int32], keep: NDArray[bool_], threads: int = 0
) -> tuple[NDArray[float64], NDArray[int32]] | None:
    """See `fracslice.mesh.model.Mesh.selected`; None if nothing is removed."""

def in_order(triangles: NDArray[int32], vertices: int) -> tuple[NDArray[int32], NDArray[int32]]:
    """Vertices by their first use, without unused ones, and the triangles with their new numbers."""

def touching(triangles: NDArray[int32], vertices: NDArray[bool_], threads: int = 0) -> NDArray[int64]:
    """Triangles, ascending, with a corner among some vertices, bool [n]."""

def near(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    points: NDArray[float64],
    reach: float,
    threads: int = 0,
) -> NDArray[int64]:
    """Triangles, ascending, with a corner near some points: within `reach` along each axis, and others."""

def near_bodies(
    points: NDArray[float64],
    labels: NDArray[int32],
    bodies: NDArray[int32],
    count: int,
    largest: int,
    origin: Point,
    edge: float,
    threads: int = 0,
) -> NDArray[int64]:
    """Bodies, ascending, with a point in a cube that holds a point of another one: see `mesh.touching`.

    `bodies` are those of the labels, -1 for none, and below `count`; `largest` is the one of most points.
    """

def surroundings(
    vertices: NDArray[float64], triangles: NDArray[int32], of: NDArray[bool_], threads: int = 0
) -> NDArray[int64]:
    """Triangles, ascending, that may meet one of some triangles, bool [m]; these are included."""

def stl(vertices: NDArray[float64], triangles: NDArray[int32], threads: int = 0) -> NDArray[uint8]:
    """Records of a binary STL, uint8 [m, 50]."""

def text_rows(before: Sequence[str], end: str, values: NDArray[float32] | NDArray[int64]) -> bytes:
    """Text of rows of numbers, [n, k]: each number after one of k texts, and `end` after a row.

    A number has the fewest digits that read back as the same number.
    """

def weld(points: NDArray[float32]) -> tuple[NDArray[int64], NDArray[int32]]:
    """First point of each group of equal points, ascending, and the group of each point.

    Points are float32 [n, 3], finite and without negative zeros.
    """

def tree(
    vertices: NDArray[float64], triangles: NDArray[int32], threads: int = 0, halved: bool = False
) -> tuple[NDArray[int64], NDArray[float64], NDArray[float64]]:
    """See `fracslice.mesh.model.Tree`."""

def self_intersecting_triangles(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    order: NDArray[int64],
    low: NDArray[float64],
    high: NDArray[float64],
    threads: int = 0,
    among: NDArray[bool_] | None = None,
) -> NDArray[bool_]: ...
def thin_walls(
    vertices: NDArray[float64],
    triangles: NDArray[int32],
    order: NDArray[int64],
    low: NDArray[float64],
    high: NDArray[float64],
    count: int,
    limit: float,
    threads: int = 0,
) -> NDArray[float64]: ...

class Reduction:
    """See `fracslice.mesh.simplify.Collapse`. Refers to the arrays during its lifetime."""

    def __init__(self, vertices: NDArray[float64], triangles: NDArray[int32], tolerance: float) -> None: ...
    def renew(self) -> None:
        """Mark all vertices for the next sweeps."""

    def sweep(self, first: int, last: int, share: float) -> int:
        """Remove vertices of `first` to `last` - 1 within a fraction of the tolerance; returns their number.
        A sweep begins with `first` = 0.
        """

    def undo(self, faulty: NDArray[bool_]) -> None: ...
    def state(
        self,
    ) -> tuple[NDArray[int32], NDArray[bool_], NDArray[int32], NDArray[bool_], NDArray[int32]]:
        """See `fracslice.mesh.simplify.Collapsed`."""

class MeshField:
    """See `fracslice.mesh.models.MeshField`. Refers to the arrays during its lifetime."""

    def __init__(
        self,
        vertices: NDArray[float64],
        triangles: NDArray[int32],
        order: NDArray[int64],
        low: NDArray[float64],
        high: NDArray[float64],
    ) -> None: ...
    def points(self, x: NDArray[float64], y: NDArray[float64], z: NDArray[float64]) -> NDArray[float64]: ...
    def bricks(self, corners: NDArray[int32], origin: Point, voxel: float) -> NDArray[float32]: ...

class Nearest:
    """See `fracslice.mesh.model.Nearest`. Refers to the arrays during its lifetime."""

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
    def points(self, points: NDArray[float64], threads: int = 0) -> NDArray[float64]: ...
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
    """Winding numbers and parents; see `fracslice.mesh.shells.nesting`."""

def side_of_line(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int: ...
def side_of_plane(a: Point, b: Point, c: Point, d: Point) -> int: ...
def foremost(vertices: NDArray[float64], triangles: NDArray[int32], shape: tuple[int, int]) -> NDArray[int32]:
    """Foremost triangle at the centre of each pixel, -1 if none, int32 [rows, columns].

    x and y of the vertices are pixels; a larger z is nearer.
    """

class SampledField:
    """Samples of a field, interpolated: see `fracslice.printing.walls.Samples`."""

    def __init__(
        self,
        origin: tuple[float, float, float],
        voxel: float,
        ijk: NDArray[int32],
        values: NDArray[float32],
        index: NDArray[int32],
    ) -> None: ...
    def values(self, x: NDArray[float64], y: NDArray[float64], z: NDArray[float64]) -> NDArray[float64]:
        """Values at points [n]."""

    def capsule_values(
        self, x: NDArray[float64], y: NDArray[float64], z: NDArray[float64], radius: float
    ) -> NDArray[float64]:
        """Values at points [n] of the samples of `fracslice.printing.bridging.Capsules`."""

    def free(
        self, start: NDArray[float64], directions: NDArray[float64], far: NDArray[float64]
    ) -> NDArray[float64]:
        """Distance along rays [n, 3] to the first grid cell with the surface, at most `far`, [n]."""

    def through(
        self, start: NDArray[float64], directions: NDArray[float64], limit: float, towards: float
    ) -> NDArray[float64]:
        """Distance along rays [n, 3] to where `towards` times the value turns positive, or 2 `limit`."""

    def crossings(self, rows: NDArray[int64]) -> tuple[NDArray[float64], NDArray[float64], NDArray[float64]]:
        """See `fracslice.printing.walls.edge_crossings`."""

    def may_be_deep(self, depth: float, lipschitz: float) -> bool:
        """False if no point is deeper inside than `depth` voxels, where values are distances times at most
        `lipschitz`.
        """

def solid_components(
    ijk: NDArray[int32], values: NDArray[float32] | NDArray[int8], index: NDArray[int32]
) -> tuple[NDArray[int32] | NDArray[int64], NDArray[int64], NDArray[bool_]]:
    """Component of the space beyond the samples, which is 0, of each sample, and of each unsampled brick
    in the order of the index; samples of each component; whether it is solid.
    """

def crossings_by_component(
    ijk: NDArray[int32],
    values: NDArray[float32] | NDArray[int8],
    index: NDArray[int32],
    labels: NDArray[int32] | NDArray[int64],
    count: int,
) -> NDArray[int64]:
    """Grid edges between samples of different signs, counted for their inside components, int64 [count]."""

def graph_components(count: int, some: NDArray[int64], others: NDArray[int64]) -> tuple[NDArray[int64], int]:
    """Connected component of each node, numbered by first nodes, int64 [count], and their number.

    `some`, `others`: ends of the edges.
    """

def grow_forest(
    away: NDArray[uint8],
    cost: NDArray[float32],
    origin: tuple[float, float, float],
    cell: tuple[float, float, float],
    floor: float,
    steps: tuple[int, int],
    lengths: tuple[float, float, float],
    tries: int,
    ends: NDArray[float64],
) -> tuple[NDArray[float64], NDArray[int64], NDArray[int64], NDArray[int64]]:
    """Branches from tips down to the plate: see `fracslice.printing.pillars.Forest`. Nodes [n, 3], the next
    one on the way down from each, those that trunks begin at, and the trunk that a branch ends on at each;
    -1 where there is none.

    `away`, `cost`: of the cells of the room, [z, y, x]; `origin`, `cell`: x, y, z, mm; `steps`: from which on
    a way is free, and narrow; `lengths`: of the longest branch, of the least height of a meeting, and of what
    a foot costs, mm; `tries`: meetings that are tried.
    """

def ray_points(
    start: NDArray[float64], directions: NDArray[float64], which: NDArray[int64], s: NDArray[float64]
) -> NDArray[float64]:
    """Points at distances `s` along the rays of these numbers, [3, n]."""

def least(
    some: NDArray[float32], rows: NDArray[int64], more: NDArray[float32], others: NDArray[int64]
) -> NDArray[float32]:
    """Minimum of rows of two arrays, float32 [n, 512]; the other one where a number is negative."""

def bricks_near(points: NDArray[float64], reach: float, shape: tuple[int, int, int]) -> NDArray[bool_]:
    """Bricks within `reach` voxels of points, which are in voxels from the first brick."""

def capsule_squares(
    lines: NDArray[float64],
    points: NDArray[float64],
    of: NDArray[int32],
    reach: float,
    ijk: NDArray[int32],
    index: NDArray[int32],
) -> NDArray[float32]:
    """Squared distances of samples to the nearest axis, at most `reach` squared, voxels, float32 [n, 512].

    `lines`: start, direction vector and inverse squared length, [k, 7]; `points`: points on the axes `of`, at
    most a voxel apart.
    """

def steps_to(ijk: NDArray[int32], index: NDArray[int32], seeds: NDArray[bool_]) -> NDArray[uint8]:
    """Grid steps from each sample to the nearest of the seeds, at most 255, uint8 [n, 512]."""

class Solid:
    """See `fracslice.mesh.models.Solid`. Refers to the arrays during its lifetime."""

    def __init__(
        self,
        vertices: NDArray[float64],
        triangles: NDArray[int32],
        order: NDArray[int64],
        low: NDArray[float64],
        high: NDArray[float64],
    ) -> None: ...
    def distances(self, points: NDArray[float64]) -> NDArray[float64]: ...
    @property
    def address(self) -> int: ...

class Solids:
    """Solids that may overlap: the least of their distances."""

    def __init__(self, solids: list[Solid]) -> None: ...
    def distances(self, points: NDArray[float64]) -> NDArray[float64]: ...
    @property
    def address(self) -> int: ...

class Beams:
    """Signed distances to beams [n, 2, 4], the centre and radius of each end, with seams of a width between
    chains, whose numbers are those of the beams.
    """

    def __init__(self, balls: NDArray[float64], chains: NDArray[int32], seam: float) -> None: ...
    def distances(self, points: NDArray[float64]) -> NDArray[float64]: ...
    @property
    def address(self) -> int: ...

class Outline:
    """Signed distances to closed rings, inside on their left: corners [n, 2], and where each ring ends."""

    def __init__(self, corners: NDArray[float64], ends: NDArray[int64]) -> None: ...
    def distances(self, points: NDArray[float64]) -> NDArray[float64]: ...
    @property
    def address(self) -> int: ...

class Relief:
    """Heights [rows, columns] above a plane, bilinear between samples that are `across` and `up` apart; the
    middle of the grid is the origin, and columns may wrap.
    """

    def __init__(self, heights: NDArray[float64], across: float, up: float, wraps: bool) -> None: ...
    def distances(self, points: NDArray[float64]) -> NDArray[float64]: ...
    @property
    def address(self) -> int: ...
