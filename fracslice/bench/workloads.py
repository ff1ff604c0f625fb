"""Benchmark solids in cubes of known size, some with known volume and area."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..formulas import Box, Node, julia, mandelbulb, menger, sphere, torus
from ..volume import Lattice


@dataclass(frozen=True)
class Workload:
    """Solid in a cube.

    Attributes
    ----------
    root : Node
        The solid.
    half : float
        Half width of the cube, scene units.
    volume, area : float, optional
        Exact values, where a closed form is known; scene units.
    """

    root: Node
    half: float
    volume: float | None = None
    area: float | None = None

    def voxel(self, resolution: int) -> float:
        """Return the voxel size at a resolution.

        Parameters
        ----------
        resolution : int
            Voxels along the cube.

        Returns
        -------
        float
            Voxel size, scene units.
        """
        return 2 * self.half / resolution

    def lattice(self, resolution: int) -> Lattice:
        """Return the grid of the cube.

        Parameters
        ----------
        resolution : int
            Voxels along the cube.
        """
        return Lattice.around(Box.centred(self.half), self.voxel(resolution))


def _menger(level: int) -> Workload:
    return Workload(
        menger(level=level),
        1.2,
        8 * (20 / 27) ** level,
        8 * (20 / 9) ** level + 16 * (8 / 9) ** level,
    )


WORKLOADS = {
    "sphere": Workload(sphere(), 1.2, 4 / 3 * math.pi, 4 * math.pi),
    "torus": Workload(torus(radius=1, tube=0.3), 1.4, 2 * math.pi**2 * 0.09, 4 * math.pi**2 * 0.3),
    "menger3": _menger(3),
    "menger4": _menger(4),
    "mandelbulb": Workload(mandelbulb(power=8, iterations=10), 1.2),
    "julia": Workload(julia(c=(-0.2, 0.8, 0, 0), iterations=12), 1.5),
}
"""No measured voxel size divides the cubes of the Menger sponges, so the sponges are as hard as any other
solid."""
