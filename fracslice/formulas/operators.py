"""Operators and methods of shapes: `Node` inherits them, and each stands for a formula."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, cast

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .registry import Node

Axis = Literal["x", "y", "z"]
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


class Operators:
    """Shapes combined and changed.

    Lengths are scene units, and angles degrees. Every operator makes a new shape.

    Examples
    --------
    >>> from fracslice import box, sphere
    >>> box(size=(1, 1, 1)) - sphere(0.6) | sphere(0.2) + (0, 0, 1)
    union(difference(box(), sphere(radius=0.6)), transform(sphere(radius=0.2), translate=(0.0, 0.0, 1.0)))
    >>> box().scale(2).rotate(45).twist(30)
    twist(transform(transform(box(), scale=(2.0,)), rotate=(0.0, 0.0, 1.0, 45.0)), degrees=30.0)
    """

    __array_ufunc__ = None  # NumPy leaves operators to the shape

    def __or__(self, other: Node) -> Node:
        """All that is in any of the two."""
        return _folded("union", self, other) if isinstance(other, Operators) else NotImplemented

    def __and__(self, other: Node) -> Node:
        """What is in both."""
        return _folded("intersection", self, other) if isinstance(other, Operators) else NotImplemented

    def __sub__(self, other: Node) -> Node:
        """The first without the second."""
        pieces = _elements("difference", self)
        return _made("difference", *pieces, other) if isinstance(other, Operators) else NotImplemented

    def __add__(self, offset: Sequence[float] | NDArray[Any]) -> Node:
        """The shape moved by an offset (x, y, z)."""
        return NotImplemented if isinstance(offset, Operators) else self.translate(offset)

    def union(self, *others: Node, smooth: float = 0.0) -> Node:
        """All that is in any of the shapes.

        Parameters
        ----------
        *others : Node
            The other shapes.
        smooth : float
            Width of the rounded seam.
        """
        return _made("union", self, *others, smooth=smooth)

    def intersection(self, *others: Node, smooth: float = 0.0) -> Node:
        """What is in all of the shapes.

        Parameters
        ----------
        *others : Node
            The other shapes.
        smooth : float
            Width of the rounded seam.
        """
        return _made("intersection", self, *others, smooth=smooth)

    def difference(self, *others: Node, smooth: float = 0.0) -> Node:
        """The shape without the others.

        Parameters
        ----------
        *others : Node
            What is taken away.
        smooth : float
            Width of the rounded seam.
        """
        return _made("difference", self, *others, smooth=smooth)

    def translate(self, offset: Sequence[float] | NDArray[Any]) -> Node:
        """The shape moved by an offset (x, y, z)."""
        return _made("transform", self, translate=offset)

    def scale(self, factor: float | Sequence[float]) -> Node:
        """The shape scaled about the origin, by one factor or by one for each axis."""
        return _made("transform", self, scale=factor)

    def rotate(self, degrees: float, axis: Axis | Sequence[float] = "z") -> Node:
        """The shape rotated about an axis through the origin.

        Parameters
        ----------
        degrees : float
            The angle, counter-clockwise seen against the axis.
        axis : {"x", "y", "z"} or three numbers
            The axis.
        """
        return _made("transform", self, rotate=(*_direction(axis), degrees))

    def mirror(self, axis: Axis) -> Node:
        """The half of the shape on the positive side of an axis, and its mirror image."""
        return _made("mirror", self, axis=axis)

    def repeat(self, period: float | Sequence[float], count: int | Sequence[int] = 0) -> Node:
        """Copies on a lattice centred at the origin.

        Parameters
        ----------
        period : float or three numbers
            Distance between copies along x, y and z.
        count : int or three whole numbers
            Copies along x, y and z; 0: without end.
        """
        return _made("repeat", self, period=_three(period), count=_three(count))

    def twist(self, degrees: float, axis: Axis = "z") -> Node:
        """The shape twisted about an axis by an angle per unit of length."""
        return _made("twist", self, degrees=degrees, axis=axis)

    def bend(self, degrees: float, axis: Axis = "z") -> Node:
        """The shape bent about an axis by an angle per unit of length."""
        return _made("bend", self, degrees=degrees, axis=axis)

    def offset(self, distance: float) -> Node:
        """The shape grown by a distance, or shrunk by a negative one."""
        return _made("offset", self, distance=distance)

    def shell(self, thickness: float) -> Node:
        """The shape hollowed out, leaving a wall."""
        return _made("shell", self, thickness=thickness)

    def material(self, **appearance: Any) -> Node:
        """The shape with an appearance in pictures, such as ``colour=(1, 0, 0)``.

        Parameters
        ----------
        **appearance
            As of the formula `material`.
        """
        return _made("material", self, **appearance)

    def distance(self, points: ArrayLike) -> NDArray[np.floating]:
        """The signed distance field of the shape at points, negative inside.

        It is exact for primitives. For the rest it is a bound: no surface is nearer than the value divided
        by the Lipschitz bound, outside.

        Parameters
        ----------
        points : array of float32 or float64, [..., 3]
            Coordinates in scene units: those of the shape itself, before a mesh is brought to its size in mm.

        Returns
        -------
        ndarray [...]
            In the precision of the points; float64 for other numbers.

        Raises
        ------
        SceneError
            If the last axis of the points is not x, y, z, or the depth of an endless fractal is open.

        Examples
        --------
        >>> from fracslice import sphere
        >>> sphere(0.5).distance([[0, 0, 0], [2, 0, 0]])
        array([-0.5,  1.5])
        """
        from ..api.distances import distance  # a method stands for the function of a layer above

        return distance(cast("Node", self), points)


def _made(name: str, *elements: Operators, **values: Any) -> Node:
    """The node of a formula."""
    from .registry import get

    node: Node = get(name)(*cast("tuple[Node, ...]", elements), **values)
    return node


def _folded(name: str, first: Operators, second: Operators) -> Node:
    """One operator over the elements of both: ``a | b | c`` is ``union(a, b, c)``, however many there are."""
    return _made(name, *_elements(name, first), *_elements(name, second))


def _elements(name: str, shape: Operators) -> tuple[Node, ...]:
    """The elements of a sharp combination made in Python, or the shape itself."""
    node = cast("Node", shape)
    same = node.formula.name == name and node["smooth"] == 0 and node.place is None
    return node.children if same else (node,)


def _direction(axis: Any) -> tuple[Any, ...]:
    """The axis of a letter, or that of three numbers."""
    if isinstance(axis, str):
        return AXES.get(axis, (axis,))
    return tuple(axis) if hasattr(axis, "__len__") else (axis,)


def _three(value: Any) -> Any:
    """The value for each axis."""
    return value if hasattr(value, "__len__") else (value,) * 3
