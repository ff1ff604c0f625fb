"""Size and orientation of an object: mm per scene unit, compensation of shrinkage, and the direction up."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..errors import SliceError
from ..fields.algebra import length, rotation
from ..fields.box import Box, Triple
from ..fields.field import Field
from ..records import SAME, UP
from ..work import Work
from . import Plan, with_depths
from .extent import extent, reached

if TYPE_CHECKING:
    from ..scene import Scene


@dataclass(frozen=True)
class Sizing:
    """Size of an object."""

    side: float  # longest side before compensation, mm; approximate if `unit` is given
    unit: float | None = None  # mm per scene unit before compensation; None if `side` determines it
    factors: Triple = SAME  # compensation of shrinkage along x, y and z of the print

    @classmethod
    def of(cls, side: float | None, factors: Triple = SAME) -> Sizing:
        """Size of an object whose longest side is given, mm."""
        if side is None:
            raise SliceError("size: expected a length, for an object without a scene")
        return cls(side, None, factors)

    @property
    def longest(self) -> float:
        """Approximate longest side, mm."""
        return self.side * max(self.factors)

    @property
    def stretch(self) -> Triple:
        """Factors of the field along each axis, of which the largest is 1."""
        x, y, z = (factor / max(self.factors) for factor in self.factors)
        return x, y, z

    def scale(self, box: Box) -> float:
        """Scale of the stretched field.

        `box` in scene units. Returns mm per scene unit.
        """
        most = max(self.factors)
        if self.unit is not None:
            return self.unit * most
        return self.side * most / max(s / f for s, f in zip(box.size, self.stretch, strict=True))


def sizing(
    scene: Scene, size_mm: float | None = None, factors: Triple = SAME, work: Work | None = None
) -> Sizing:
    """Size of the object of a scene. A scene with a unit is measured.

    `size_mm` in mm.
    """
    side, unit = size_mm or scene.size_mm, None if size_mm else scene.unit_mm
    if side is None or unit is not None:
        assert unit is not None
        side = unit * max(extent(with_depths(scene.root, work), work).box.size)
    return Sizing(side, unit, factors)


def orient_field(root: Field, up: Triple, stretch: Triple = SAME, work: Work | None = None) -> Field:
    """Rotate a field by the shortest way so that a direction points along z, then stretch it.

    `up`: direction.
    """
    turn = _turn(up)
    if turn[3] == 0 and stretch == SAME:
        return root
    if root.tree is None:
        raise SliceError("up: expected a scene of formulas")
    from ..formulas import transform

    made = with_depths(root.tree, work)
    if turn[3]:
        made = transform(made, rotate=turn)
    return made if stretch == SAME else transform(made, scale=stretch)


def orientation(up: Triple, factors: Triple = SAME) -> NDArray[np.float64]:
    """Linear map of `orient_field`, for points.

    `up`: direction. Returns float64 (3, 3).
    """
    matrix: NDArray[np.float64] = (rotation(_turn(up)) * np.array(factors)[:, None]).T
    return matrix


def _turn(up: Triple) -> tuple[float, float, float, float]:
    """Axis and angle, degrees, of the shortest rotation of a direction to z."""
    direction = np.asarray(up, float) / length(np.asarray(up, float))
    axis = np.cross(direction, UP)
    angle = math.degrees(math.atan2(length(axis), float(direction[2])))
    x, y, z = axis.tolist() if length(axis) > 0 else (1.0, 0.0, 0.0)
    return x, y, z, angle


def box_of_the_rest(planned: Plan, whole: np.ndarray, rest: np.ndarray, tips: np.ndarray, work: Work) -> Box:
    """Return the bounds of the remaining components, from the field: a mesh does not contain all tips.

    `planned`: bounds and voxel size; `whole`, `rest`: [2, 3], scene units; `tips`: [n, 3], scene units.
    Returns `Box` in scene units.
    """
    if (rest == whole).all():
        return planned.box
    result = reached(planned.root, tips.T, planned.voxel, work)
    own = np.array([planned.box.lo, planned.box.hi])
    lo, hi = np.where(rest == whole, own, [result.lo, result.hi]).tolist()
    return Box((lo[0], lo[1], lo[2]), (hi[0], hi[1], hi[2]))
