"""OpenVDB grids of samples. Call `fracslice.volume.bricks` instead.

Arrays are C-contiguous and laid out as in `fracslice.volume.bricks.Bricks`. Long calls release the GIL.
"""

from numpy import float32, int32
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
        """Read the named float grid of a .vdb file, or the first one. Raises RuntimeError."""

    def write(self, path: str, metadata: dict[str, str]) -> None:
        """Write a .vdb file. Raises RuntimeError if it cannot be written completely."""

    def to_bricks(self) -> tuple[list[float], float, NDArray[int32], NDArray[float32], NDArray[int32]]:
        """Origin, voxel, ijk, values and index. Raises ValueError unless voxels are axis-aligned cubes."""

    def redistance(self) -> Grid:
        """Signed distance field of the same surface, by fast sweeping (Zhao, 2004). Raises ValueError."""

    def offset(self, distance: float) -> Grid:
        """Signed distances of the surface, offset outwards by `distance`, scene units. Raises ValueError."""

    name: str
