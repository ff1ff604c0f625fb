"""C++ parts of fracslice: the samples around the contours of a few neighbouring layers, and marching squares
on them. Callers use `fracslice.slicing`.

Long calls let other threads run.
"""

from collections.abc import Callable

from numpy import float32, float64, int32, uint8
from numpy.typing import NDArray

class BorderError(ValueError):
    """The solid reaches the rim of the lattice."""

class Field:
    """What is sampled."""

class Compiled(Field):
    """Machine code ``void points(parameters, x, y, z, f, n)`` on float32, by its address, and that of its
    parameters; both must outlive it.
    """

    def __init__(self, code: int, parameters: int) -> None: ...

class Called(Field):
    """A function of x, y, z, float32 [n], that returns values float32 [n]."""

    def __init__(
        self,
        function: Callable[[NDArray[float32], NDArray[float32], NDArray[float32]], NDArray[float32]],
    ) -> None: ...

class Bounds:
    """How far values reach: a block is decided where |f| exceeds a bound times the distance from its middle
    to its farthest sample.

    proven: for blocks over several layers. outside, inside: within a layer, by the sign of the middle.
    stop_outside, stop_inside: blocks of so many pixels are not cut any more. even: inside values are of
    another scale than outside ones, but of one everywhere, so that a part of the crossings tells for all, and
    the bound outside follows the steepness of the field, from `outside` up to `proven`. In a field that is not
    even every crossing is settled on the field, and so are corners within pixels.
    """

    def __init__(
        self,
        proven: float,
        outside: float,
        inside: float,
        stop_outside: int,
        stop_inside: int,
        even: bool,
    ) -> None: ...

class Slab:
    """The samples of layers on a lattice of ny x nx points at (x0 + dx i, y0 + dy j).

    frame: (x0, y0, dx, dy). z: heights of neighbouring layers. All in scene units. layers: numbers of those
    that are sampled, ascending; their samples do not depend on which others are.
    """

    def __init__(
        self, frame: tuple[float, float, float, float], z: list[float], layers: list[int], ny: int, nx: int
    ) -> None: ...
    def sample(self, field: Field, bounds: Bounds) -> None:
        """Finds the samples around all contours, closed: every edge that a contour crosses has two evaluated
        ends. Once. Raises BorderError.
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

    def crossings(self, layer: int) -> tuple[NDArray[int32], NDArray[float64]]:
        """The crossed edges of a layer, row by row of tiles: int32 [n, 4], column, row and direction (0
        right, 1 up) of each and the number of the one that follows on its contour, the inside to the left;
        and the values at both ends, float64 [n, 2].
        """

    def signs(self) -> tuple[NDArray[uint8], NDArray[uint8]]:
        """Which samples are inside, and which were evaluated: 0 or 1, uint8 [layers, rows, columns], rows and
        columns rounded up to whole tiles of 8.
        """
