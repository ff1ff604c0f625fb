"""Axis-aligned boxes, possibly infinite or empty, that bound the region where a field can be negative."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np

from ..common.arrays import length
from ..common.parameters import Triple as Triple
from ..expr.intervals import ARRAYS, Interval


@dataclass(frozen=True, slots=True)
class Box:
    """The box ``lo <= p <= hi``, empty if ``lo > hi`` on any axis.

    Attributes
    ----------
    lo, hi : (float, float, float)
        Opposite corners, scene units; infinite along an unbounded axis.
    """

    lo: Triple
    hi: Triple

    @classmethod
    def centred(cls, x: float, y: float | None = None, z: float | None = None) -> Box:
        """Box centred at the origin.

        Parameters
        ----------
        x : float
            Half size along x.
        y, z : float, optional
            Half sizes along y and z; x by default.

        Returns
        -------
        Box
        """
        half = (x, x if y is None else y, x if z is None else z)
        return cls((-half[0], -half[1], -half[2]), half)

    @classmethod
    def everywhere(cls) -> Box:
        """Box of all space.

        Returns
        -------
        Box
        """
        return cls.centred(math.inf)

    @classmethod
    def around(cls, points: Iterable[Triple]) -> Box:
        """Bounding box of points.

        Parameters
        ----------
        points : iterable of (float, float, float)
            At least one point.

        Returns
        -------
        Box
        """
        axes = list(zip(*points, strict=True))
        return cls(_triple(min(a) for a in axes), _triple(max(a) for a in axes))

    @classmethod
    def enclosing(cls, boxes: Iterable[Box]) -> Box:
        """Smallest box that encloses some boxes.

        Parameters
        ----------
        boxes : iterable of Box
            At least one box.

        Returns
        -------
        Box
            Empty if all are.
        """
        given = list(boxes)
        held = [box for box in given if not box.empty]
        if not held:
            return given[-1]
        lo, hi = zip(*(box.lo for box in held), strict=True), zip(*(box.hi for box in held), strict=True)
        return cls(_triple(map(min, lo)), _triple(map(max, hi)))

    @property
    def empty(self) -> bool:
        """True if the box holds no points."""
        (a, b, c), (d, e, f) = self.lo, self.hi
        return a > d or b > e or c > f

    @property
    def finite(self) -> bool:
        """True if both corners are finite."""
        return all(map(math.isfinite, self.lo + self.hi))

    @property
    def size(self) -> Triple:
        """Edge lengths along x, y and z."""
        return _triple(b - a for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def centre(self) -> Triple:
        """Centre of the box."""
        return _triple((a + b) / 2 for a, b in zip(self.lo, self.hi, strict=True))

    @property
    def corners(self) -> list[Triple]:
        """The eight corners."""
        return [_triple(corner) for corner in product(*zip(self.lo, self.hi, strict=True))]

    def __or__(self, other: Box) -> Box:
        """Smallest box that encloses both."""
        return Box.enclosing((self, other))

    def __and__(self, other: Box) -> Box:
        """Intersection of both."""
        return Box(_triple(map(max, self.lo, other.lo)), _triple(map(min, self.hi, other.hi)))

    def grown(self, by: float) -> Box:
        """Box with every face moved outwards.

        Parameters
        ----------
        by : float
            Distance, scene units; negative to move the faces inwards.

        Returns
        -------
        Box
        """
        return Box(_triple(a - by for a in self.lo), _triple(b + by for b in self.hi))

    def about(self, middle: Triple) -> Box:
        """Smallest box with the given centre that encloses this box.

        Parameters
        ----------
        middle : (float, float, float)
            The centre.

        Returns
        -------
        Box
        """
        half = [max(m - a, b - m) for m, a, b in zip(middle, self.lo, self.hi, strict=True)]
        lo, hi = (_triple(m + s * h for m, h in zip(middle, half, strict=True)) for s in (-1, 1))
        return Box(lo, hi)

    def radius(self, *axes: int) -> float:
        """Largest distance of a point of the box from the subspace where the given coordinates are zero.

        Parameters
        ----------
        *axes : int
            Coordinates, 0 to 2: two give the distance from a line; none, from the origin.

        Returns
        -------
        float
            0 for an empty box.
        """
        if self.empty:
            return 0.0
        return math.hypot(*(max(abs(self.lo[a]), abs(self.hi[a])) for a in axes or (0, 1, 2)))


def _triple(values: Iterable[float]) -> Triple:
    x, y, z = values
    return x, y, z


Axis = Literal["x", "y", "z"]
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def direction(axis: Any) -> tuple[Any, ...]:
    """Direction of an axis that is given by a letter or by three numbers."""
    if isinstance(axis, str):
        return AXES.get(axis, (axis,))
    return tuple(axis) if hasattr(axis, "__len__") else (axis,)


def three(value: Any) -> Any:
    """One value for each axis."""
    return value if hasattr(value, "__len__") else (value,) * 3


FIRST = 8
"""Cells along the longest side of the box on the first level."""

LEVELS = 12
"""Largest number of levels."""


def possible_cells(
    field: Callable[[np.ndarray], np.ndarray], lipschitz: float, box: Box, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the cells of a box where a field may be negative.

    Cells are split in eight while their number stays at most `most`.

    `field`: function of points [3, n], scene units, returns values [n]; `box` in scene units. Returns
    centres float64 [3, n], scene units; values [n]; step float64 [3], scene units.
    """
    size = np.maximum(np.array(box.size), 1e-6 * max(box.size))
    counts = np.ceil(FIRST * size / size.max()).astype(int)
    step = size / counts
    centres = (np.array(box.lo) + step * (np.indices(counts).reshape(3, -1).T + 0.5)).T
    eighths = np.indices((2, 2, 2)).reshape(3, 1, 8) / 2 - 0.25
    for level in range(LEVELS):
        values = field(centres)
        kept = ~(values > lipschitz * length(step) / 2)
        centres, values = centres[:, kept], values[kept]
        if 8 * centres.shape[1] > most or level == LEVELS - 1:
            break
        centres = (centres[:, :, None] + eighths * step[:, None, None]).reshape(3, -1)
        step = step / 2
    return centres, values, step


BOXES_A_SIDE, BOX_LEVELS, MOST = 16, 8, 1 << 12
"""Cells along each axis of the first level; levels of cells; cells of a level from which none is split."""

Corners = np.ndarray
"""Least or greatest corners of cells, [3, n]."""


def undecided_cells(
    wanted: Callable[[Corners, Corners], np.ndarray],
    proved: Callable[[Corners, Corners], np.ndarray],
    radius: float,
    most: int = MOST,
    levels: int = BOX_LEVELS,
) -> tuple[Corners, Corners]:
    """Split cells of a cube around the origin in eight until they are proved, or many, or small.

    Returns [3, n].
    """
    size, eighths = 2.0 * radius / BOXES_A_SIDE, np.indices((2, 2, 2)).reshape(3, 1, 8)
    places = np.indices((BOXES_A_SIDE,) * 3).reshape(3, -1) - BOXES_A_SIDE // 2
    for level in range(levels):
        places = places[:, wanted(size * places, size * (places + 1))]
        places = places[:, ~proved(size * places, size * (places + 1))]
        if places.shape[1] == 0 or places.shape[1] > most or level == levels - 1:
            break
        places = (2 * places[:, :, None] + eighths).reshape(3, -1)
        size /= 2
    return size * places, size * (places + 1)


def proved_half(field: Callable[..., Any], radius: float, half: Triple) -> Triple:
    """Enlarge a box around the origin until everything outside is proved to be empty.

    Cells that reach out of the box are split until intervals prove them to be empty, or until they are many
    or small: then the box takes them in.
    """
    box = np.array(half)

    def wanted(lo: Corners, hi: Corners) -> np.ndarray:
        outside: np.ndarray = (np.maximum(-lo, hi) > box[:, None]).any(0)
        return outside

    def proved(lo: Corners, hi: Corners) -> np.ndarray:
        low = field(*(Interval(a, b, ARRAYS).outward() for a, b in zip(lo, hi, strict=True))).lo
        positive: np.ndarray = np.broadcast_to(low, lo.shape[1]) > 0
        return positive

    lo, hi = undecided_cells(wanted, proved, radius)
    x, y, z = np.maximum(box, np.maximum(-lo, hi).max(axis=1, initial=0)).tolist()
    return x, y, z
