"""C++ parts of fracslice: samples around the contours of neighbouring layers, marching squares on them, and
images. Call `fracslice.slicing` instead.

Long calls release the GIL.
"""

from collections.abc import Callable, Sequence
from enum import Enum

from numpy import bool_, float32, float64, int32, int64, uint8
from numpy.typing import NDArray

from .expr.runtime import CompiledFunction
from .slicing.feature_graph import Runs

class BorderError(ValueError):
    """The solid reaches the border of the lattice."""

class ProbeBounds:
    """Bounds for block probing.

    A block is decided if |f| at its centre exceeds a bound times the distance to its farthest sample.

    Parameters
    ----------
    proven : float
        Bound for blocks over all layers.
    outside, inside : float
        Bounds for smaller blocks, by the sign at the centre.
    escape_time_only : bool
        True for a field of escape-time fractals alone. Its inside values differ from outside ones by one
        scale factor, so that a sample of the crossings represents all; the bound outside follows the slope of
        the field, from `outside` up to `proven`. In other fields every crossing is projected to the surface,
        and so are corners within pixels.
    """

    def __init__(
        self,
        proven: float,
        outside: float,
        inside: float,
        escape_time_only: bool,
    ) -> None: ...

class Encoding(Enum):
    """Encodings of a picture.

    PNG: rows, each after a byte 0, as a zlib stream. The others are run lengths of all pixels, row after row.
    GOO: levels of 8 bits, as in .goo V3.0. RLE7: 7 bits, as in .ctb. RLE4: 4 bits, as in .pwmx. RLE1: one
    bit, as in .cbddlp.
    """

    PNG = ...
    GOO = ...
    RLE7 = ...
    RLE4 = ...
    RLE1 = ...

class Memory:
    """Memory of finished slabs, reused by later ones."""

class Slab:
    """Neighbouring layers, one layer at a time: of a `FieldSlab` or a `BeamSlab`.

    The lattice has ny x nx points at (x0 + dx i, y0 + dy j).

    A layer must be read before the next one is sampled; otherwise ValueError is raised.
    """

    def sample(self, layer: int) -> None:
        """Sample a layer around its contours; every edge that a contour crosses has two evaluated ends.

        The samples do not depend on the layers sampled before. Raises BorderError.
        """

    @property
    def evaluations(self) -> int:
        """Evaluations of the field so far."""

    def paint(self, layer: int, image: NDArray[uint8]) -> tuple[float, int]:
        """Write the coverage of a layer's pixels to an image.

        Parameters
        ----------
        layer : int
            The sampled layer.
        image : ndarray of uint8, shape (rows, columns)
            Zeroed image of any strides; 255 is completely inside, row 0 is the lowest.

        Returns
        -------
        area : float
            Inside area before rounding, pixels.
        cut : int
            Pixels that the contour crosses.
        """

    def runs(self, layer: int, shape: tuple[int, int]) -> tuple[NDArray[int32], NDArray[int32], float, int]:
        """Runs of a layer's solid pixels, those at least half inside, in time linear in its tiles.

        Parameters
        ----------
        layer : int
            The sampled layer.
        shape : tuple of int
            Rows and columns of the layer.

        Returns
        -------
        rows : ndarray of int32, shape (ny + 1,)
            Row y has the runs ``rows[y]:rows[y + 1]``.
        runs : ndarray of int32, shape (n, 2)
            First pixel of each run, and the pixel after its last.
        area, cut
            As from `paint`.
        """

    def picture(
        self,
        layer: int,
        pixels: tuple[int, int],
        transposed: bool,
        backwards: bool,
        at: tuple[int, int],
        shape: tuple[int, int],
        levels: bytes,
        encoding: Encoding,
        others: Sequence[Slab] = (),
    ) -> tuple[bytes, float, int]:
        """Coverage of a layer as shown on a screen, encoded; see `fracslice.slicing.layers.ScreenView`.

        Parameters
        ----------
        layer : int
            The sampled layer.
        pixels : tuple of int
            Rows and columns of the screen.
        transposed, backwards, at, levels
            As in `ScreenView`.
        shape : tuple of int
            Rows and columns of the layer.
        encoding : Encoding
            Encoding of the picture.
        others : sequence of Slab
            Slabs of the same lattice whose layer is shown, too: of each pixel the greatest part.

        Returns
        -------
        data : bytes
            Encoded picture.
        area, cut
            As from `paint`.
        """

    def pictures(
        self,
        layers: Sequence[int],
        pixels: tuple[int, int],
        transposed: bool,
        backwards: bool,
        at: tuple[int, int],
        shape: tuple[int, int],
        levels: bytes,
        encoding: Encoding,
    ) -> list[tuple[int, tuple[bytes, float, int]]]:
        """Sample layers and encode their pictures, without the interpreter between them.

        Parameters
        ----------
        layers : sequence of int
            Layers of the slab.
        pixels, transposed, backwards, at, shape, levels, encoding
            As for `picture`.

        Returns
        -------
        list of tuple
            Evaluations of the field for a layer, and what `picture` returns, of the first layers: as many as
            take 20 ms, at least one. Raises BorderError.
        """

    def crossings(self, layer: int) -> tuple[NDArray[int32], NDArray[float64]]:
        """Crossed lattice edges of a layer, by rows of tiles.

        Returns
        -------
        edges : ndarray of int32, shape (n, 4)
            Column, row and direction (0 right, 1 up) of each edge, and the index of the next edge on its
            contour, with the inside to the left.
        values : ndarray of float64, shape (n, 2)
            Values at both ends.
        """

    def signs(self) -> tuple[NDArray[uint8], NDArray[uint8]]:
        """Inside samples and evaluated samples: 0 or 1, uint8 [rows, columns], both rounded up to whole tiles
        of 8.
        """

class FieldSlab(Slab):
    """Samples of a field.

    Parameters
    ----------
    memory : Memory
        Memory shared by the slabs of one job.
    entry : tuple or callable
        Float32 kernel of the field (`Kernel.entry`).
    bounds : ProbeBounds
        Bounds for block probing.
    frame : tuple of float
        (x0, y0, dx, dy), scene units.
    z : list of float
        Heights of the layers, scene units.
    ny, nx : int
        Lattice points.
    """

    def __init__(
        self,
        memory: Memory,
        entry: tuple[CompiledFunction, NDArray[float32]]
        | Callable[[NDArray[float32], NDArray[float32]], None],
        bounds: ProbeBounds,
        frame: tuple[float, float, float, float],
        z: list[float],
        ny: int,
        nx: int,
    ) -> None: ...

class Beams:
    """Round cones that a floor cuts off, and a convex plate below it.

    Parameters
    ----------
    balls : ndarray of float64, shape (n, 2, 4)
        Centre and radius of both ends, scene units.
    floor : float
        Height of the floor.
    planes : ndarray of float64, shape (k, 4)
        a, b, c, d of the half spaces a x + b y + c z <= d that the plate is in; none for no plate.
    """

    def __init__(self, balls: NDArray[float64], floor: float, planes: NDArray[float64]) -> None: ...

class BeamSlab(Slab):
    """Layers of beams, cut exactly.

    Parameters
    ----------
    memory, frame, z, ny, nx
        As of a `FieldSlab`.
    beams : Beams
        The beams.
    """

    def __init__(
        self,
        memory: Memory,
        beams: Beams,
        frame: tuple[float, float, float, float],
        z: list[float],
        ny: int,
        nx: int,
    ) -> None: ...

def encoded(image: NDArray[uint8], encoding: Encoding) -> bytes:
    """Encode an image of any strides."""

def plate_picture(
    pieces: Sequence[
        tuple[Sequence[Slab], int, bool, bool, tuple[int, int], bool, Sequence[tuple[int, int]]]
    ],
    pixels: tuple[int, int],
    levels: bytes,
    encoding: Encoding,
) -> tuple[bytes, float, int]:
    """Layers of several objects in one picture, encoded; at most two of them may overlap in a place.

    Parameters
    ----------
    pieces : sequence of tuple
        For each object its slabs and the sampled layer, `transposed` and `backwards` as for `Slab.picture`,
        rows and columns of the layer, whether its rows are shown in the other order, and the row and column
        of the picture of its first pixel, for each time it is shown.
    pixels, levels, encoding
        As for `Slab.picture`.

    Returns
    -------
    data : bytes
        Encoded picture.
    area, cut
        As from `Slab.paint`, of all that is shown.
    """

def filtered(rows: NDArray[uint8], pixel: int) -> bytes:
    """Filter rows of bytes, each by the PNG filter with the smallest sum of absolute differences.

    Parameters
    ----------
    rows : uint8 [n + 1, width]
        The row above the first one, and n rows.
    pixel : int
        Bytes of a pixel.

    Returns
    -------
    bytes
        n rows of 1 + `width` bytes: the number of the filter, and the filtered row.
    """

def gaps(runs: Runs) -> tuple[NDArray[int32], NDArray[int32], NDArray[int32]]:
    """Rows, begin and end of the runs between runs."""

def components(
    runs: Runs, reach: int
) -> tuple[NDArray[int64], NDArray[int64], NDArray[float64], NDArray[bool_]]:
    """Connected component of each run, of those that overlap or, at `reach` 1, touch at a corner; and area,
    centroid and openness of each component: see `fracslice.slicing.feature_graph.Nodes`.
    """

def overlaps(
    below: Runs, labels_below: NDArray[int64], above: Runs, labels_above: NDArray[int64]
) -> NDArray[int64]:
    """Pairs of components of two layers that share a pixel, in ascending order, int64 [n, 2]."""

def unsupported(
    below: Runs, above: Runs, reach: float
) -> tuple[NDArray[int32], NDArray[int32], NDArray[int32]]:
    """Rows, begin and end of the runs of a layer farther than `reach` pixels from the layer below."""

def count_pixels(runs: Runs, times: int) -> NDArray[int32]:
    """Pixels of runs in each coarse pixel, which is `times` pixels across."""

def narrow_pixels(runs: Runs, gaps: bool, times: int, longest: tuple[int, int]) -> NDArray[bool_]:
    """Coarse pixels with a row or a column that is solid, or empty, for at most `longest` (x, y) pixels."""

def painted(runs: Runs, at: tuple[int, int], shape: tuple[int, int]) -> NDArray[bool_]:
    """Picture of a part of a layer, from row and column `at` on, which may lie beyond it."""

def distances(region: NDArray[bool_], pixel: tuple[float, float]) -> NDArray[float64]:
    """Distance of each pixel's centre to the nearest one outside the region; infinite if none is.

    `pixel`: width and height. Exact, in time linear in the pixels (Maurer, Qi and Raghavan 2003).
    """

def dilated(image: NDArray[uint8], cone: NDArray[float64]) -> NDArray[uint8]:
    """Grey dilation of an image with a cone, float64 [2 r + 1, 2 r + 1]."""

def closed_nodes(
    edges: NDArray[int64], later: NDArray[int64], layer: NDArray[int64], free: NDArray[bool_]
) -> NDArray[bool_]:
    """Nodes that are not connected to a free one once the edges up to their layer are added.

    `edges`: int64 [e, 2]; `later`: layer of each edge, ascending.
    """

def held_nodes(edges: NDArray[int64], roots: NDArray[int64], count: int) -> NDArray[bool_]:
    """Nodes that grow from some nodes. `edges`: (below, above) by layers, int64 [e, 2]."""

def weakest_cut(
    area: NDArray[float64],
    firm: NDArray[float64],
    edges: NDArray[int64],
    starts: NDArray[int64],
    foot: float,
    least: float,
) -> tuple[float, float, int, int]:
    """Contact area, carried area, cut and largest node of the weakest cross-section; node -1 if none.

    `area`, `firm`: of nodes, and 0 for islands; `foot`, `least`: carried areas that count on the plate, and
    above it; `edges`: pairs (below, above), those of cut k from `starts[k]` to `starts[k + 1]`.
    """

def spans(solid: NDArray[bool_], held: NDArray[bool_], step: tuple[int, int]) -> NDArray[float32]:
    """Steps between the held pixels on both sides of each pixel along a line of solid ones.

    `step`: dy, dx.
    """

def connected_to(solid: NDArray[bool_], held: NDArray[bool_]) -> NDArray[bool_]:
    """Solid pixels that are connected to held ones, by sides and corners."""
