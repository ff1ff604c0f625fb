"""OpenVDB grids of samples. Call `fracslice.volume.bricks` and `fracslice.volume.level_sets` instead.

Arrays are C-contiguous and laid out as in `fracslice.volume.bricks.Bricks`. Long calls release the GIL.
"""

from numpy import float32, float64, int32
from numpy.typing import NDArray

Point = tuple[float, float, float]

class Grid:
    """Sparse OpenVDB level set."""

    @staticmethod
    def from_bricks(
        ijk: NDArray[int32], values: NDArray[float32], index: NDArray[int32], origin: Point, voxel: float
    ) -> Grid:
        """Grid of samples: active at samples; the background is the largest sample, negative inside."""

    @staticmethod
    def read(path: str, name: str = "") -> Grid:
        """Read the named grid of a .vdb file, or the first one, of numbers or a mask. Raises RuntimeError."""

    @staticmethod
    def from_array(values: NDArray[float32], origin: Point, spacing: Point, beyond: float) -> Grid:
        """Grid of dense samples, [nx, ny, nz], with a value beyond them. Raises ValueError."""

    def write(self, path: str, metadata: dict[str, str]) -> None:
        """Write a .vdb file. Raises RuntimeError if it cannot be written completely."""

    def to_bricks(self) -> tuple[list[float], float, NDArray[int32], NDArray[float32], NDArray[int32]]:
        """Origin, voxel, ijk, values and index. Raises ValueError unless voxels are axis-aligned cubes."""

    def redistance(self) -> Grid:
        """Signed distance field of the same surface, by fast sweeping (Zhao, 2004). Raises ValueError."""

    def offset(self, distance: float) -> Grid:
        """Signed distances of the surface, offset outwards by `distance`, scene units. Raises ValueError."""

    def with_cubes(self) -> Grid:
        """Grid with voxels that are cubes, of the shortest side; itself if they are. Raises ValueError."""

    def less(self, iso: float, turned: bool) -> Grid:
        """Values minus a number, or turned: that number minus values. Raises ValueError for too many."""

    def narrow_band(self) -> Grid:
        """Distances within three voxels of where values are 0, negative inside. Raises ValueError."""

    def fog(self) -> Grid:
        """Densities of a narrow band: 1 inside, 0 outside, and 1/2 at the surface."""

    @property
    def kind(self) -> str:
        """Class of the grid, such as "level set" or "fog volume"."""

    half: bool
    name: str

def grids_of(path: str) -> list[str]:
    """Names of the grids of a .vdb file. Raises RuntimeError."""

def level_set_of(grid: Grid) -> Grid:
    """The grid near its surface if its values are distances, else its narrow band. Raises ValueError."""

class LevelSet:
    """See `fracslice.volume.level_sets.LevelSet`. Raises ValueError for a grid without a surface."""

    def __init__(self, grid: Grid) -> None: ...
    def distances(self, points: NDArray[float64]) -> NDArray[float64]: ...
    @property
    def address(self) -> int: ...
    @property
    def box(self) -> tuple[Point, Point]: ...
    @property
    def tips(self) -> list[Point] | None: ...
    @property
    def steepness(self) -> float: ...
