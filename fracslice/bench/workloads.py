"""What is measured: solids in known boxes, some with a known volume and area."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..formulas import Box, Node, julia, mandelbulb, menger, sphere, torus
from ..volume import Lattice


@dataclass(frozen=True)
class Workload:
    """A solid in a cube of half-width `half`, both in scene units; volume and area where a closed form is
    known."""

    root: Node
    half: float
    volume: float | None = None
    area: float | None = None

    def voxel(self, resolution: int) -> float:
        """The voxel when the cube is so many of them wide."""
        return 2 * self.half / resolution

    def lattice(self, resolution: int) -> Lattice:
        """The grid on the cube."""
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
"""No voxel size measured divides what the Menger sponges are made of: they are as hard as any."""
