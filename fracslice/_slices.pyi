"""C++ parts of fracslice: samples around the contours of neighbouring layers, marching squares on them, and
images. Call `fracslice.slicing` instead.

Long calls release the GIL.
"""

from collections.abc import Callable, Sequence
from enum import Enum

from numpy import float32, float64, int32, uint8
from numpy.typing import NDArray

from .expr.machine import Function

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
    """Samples of neighbouring layers, one layer at a time.

    The lattice has ny x nx points at (x0 + dx i, y0 + dy j).

    A layer must be read before the next one is sampled; otherwise ValueError is raised.

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
        entry: tuple[Function, NDArray[float32]] | Callable[[NDArray[float32], NDArray[float32]], None],
        bounds: ProbeBounds,
        frame: tuple[float, float, float, float],
        z: list[float],
        ny: int,
        nx: int,
    ) -> None: ...
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

def encoded(image: NDArray[uint8], encoding: Encoding) -> bytes:
    """Encode an image of any strides."""

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
