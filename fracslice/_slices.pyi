"""C++ parts of fracslice: the samples around the contours of a few neighbouring layers, marching squares on
them, and pictures. Callers use `fracslice.slicing`.

Long calls let other threads run.
"""

from collections.abc import Callable

from numpy import float32, float64, int32, uint8
from numpy.typing import NDArray

from .kernel.machine import Function

class BorderError(ValueError):
    """The solid reaches the rim of the lattice."""

class ProbeBounds:
    """How far values reach: a block is decided where |f| exceeds a bound times the distance from its middle
    to its farthest sample.

    proven: for blocks over all layers. outside, inside: for finer ones, by the sign of the middle.
    stop_outside, stop_inside: blocks of so many pixels are not cut any more. escape_time_only: inside values
    are of another scale than outside ones, but of one everywhere, so that a part of the crossings tells for
    all, and the bound outside follows the steepness of the field, from `outside` up to `proven`. In other
    fields every crossing is projected to the surface, and so are corners within pixels.
    """

    def __init__(
        self,
        proven: float,
        outside: float,
        inside: float,
        stop_outside: int,
        stop_inside: int,
        escape_time_only: bool,
    ) -> None: ...

class Memory:
    """Of slabs that are gone, for those to come."""

class Slab:
    """The samples of one layer after the other, on a lattice of ny x nx points at (x0 + dx i, y0 + dy j).

    memory: shared by slabs of one job. entry: of the field's float32 kernel (`Kernel.entry`). frame: (x0,
    y0, dx, dy). z: heights of neighbouring layers. All in scene units. What is read of a layer is read before
    the next one is sampled; a ValueError else.
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
        """Finds the samples around the contours of a layer, closed: every edge that a contour crosses has two
        evaluated ends. They do not depend on which layers were sampled before. Raises BorderError.
        """

    @property
    def evaluations(self) -> int:
        """Of the field, so far."""

    def paint(self, layer: int, image: NDArray[uint8]) -> tuple[float, int]:
        """Writes the coverage of a layer's pixels to a zeroed image of any strides, 255 wholly inside, row 0
        lowest.

        Returns the inside area in pixels, before it is rounded, and the number of pixels that the contour
        cuts.
        """

    def runs(self, layer: int, shape: tuple[int, int]) -> tuple[NDArray[int32], NDArray[int32], float, int]:
        """A layer's solid pixels, those of which at least half is inside, in time linear in its tiles.

        Row y has the runs ``rows[y]:rows[y + 1]``, rows int32 [ny + 1]; each is its first pixel and the one
        after its last, int32 [n, 2]. And what `paint` returns.
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
    ) -> tuple[bytes, float, int]:
        """A layer's coverage as a screen shows it, see `fracslice.slicing.layers.View`: the rows of pixels,
        each after a byte 0, as a zlib stream; and what `paint` returns.

        pixels: rows and columns of the screen. shape: of the layer.
        """

    def crossings(self, layer: int) -> tuple[NDArray[int32], NDArray[float64]]:
        """The crossed edges of a layer, row by row of tiles: int32 [n, 4], column, row and direction (0
        right, 1 up) of each and the number of the one that follows on its contour, the inside to the left;
        and the values at both ends, float64 [n, 2].
        """

    def signs(self) -> tuple[NDArray[uint8], NDArray[uint8]]:
        """Which samples are inside, and which were evaluated: 0 or 1, uint8 [rows, columns], both rounded up
        to whole tiles of 8.
        """

def deflated(image: NDArray[uint8]) -> bytes:
    """The rows of an image of any strides, each after a byte 0, as a zlib stream."""
