"""Operators and methods of shapes. `Node` inherits them; each makes a node of a formula."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

from ..providers import provider
from .axes import Axis, direction, three
from .catalogue import FORMULAS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from .registry import Node


class Operators:
    """CSG operators and domain operators as methods of shapes.

    Lengths are in scene units, angles in degrees. Every operator makes a new shape.

    Examples
    --------
    >>> from fracslice import box, sphere
    >>> box(size=(1, 1, 1)) - sphere(0.6) | sphere(0.2) + (0, 0, 1)
    union(difference(box(), sphere(radius=0.6)), transform(sphere(radius=0.2), translate=(0.0, 0.0, 1.0)))
    >>> box().scale(2).rotate(45).twist(30)
    twist(transform(transform(box(), scale=(2.0,)), rotate=(0.0, 0.0, 1.0, 45.0)), degrees=30.0)
    """

    __array_ufunc__ = None  # makes NumPy defer to the operators of the shape

    def __or__(self, other: Node) -> Node:
        """Union of two shapes."""
        return _folded("union", self, other) if isinstance(other, Operators) else NotImplemented

    def __and__(self, other: Node) -> Node:
        """Intersection of two shapes."""
        return _folded("intersection", self, other) if isinstance(other, Operators) else NotImplemented

    def __sub__(self, other: Node) -> Node:
        """Difference of two shapes."""
        pieces = _elements("difference", self)
        return _made("difference", *pieces, other) if isinstance(other, Operators) else NotImplemented

    def __add__(self, offset: Sequence[float] | NDArray[Any]) -> Node:
        """Translation by an offset (x, y, z)."""
        return NotImplemented if isinstance(offset, Operators) else self.translate(offset)

    def union(self, *others: Node, smooth: float = 0.0) -> Node:
        """Union of this shape and others.

        Parameters
        ----------
        *others : Node
            The other shapes.
        smooth : float
            Width of the rounded seam; 0: a sharp seam.

        Returns
        -------
        Node
        """
        return _made("union", self, *others, smooth=smooth)

    def intersection(self, *others: Node, smooth: float = 0.0) -> Node:
        """Intersection of this shape and others.

        Parameters
        ----------
        *others : Node
            The other shapes.
        smooth : float
            Width of the rounded seam; 0: a sharp seam.

        Returns
        -------
        Node
        """
        return _made("intersection", self, *others, smooth=smooth)

    def difference(self, *others: Node, smooth: float = 0.0) -> Node:
        """This shape minus others.

        Parameters
        ----------
        *others : Node
            The shapes to subtract.
        smooth : float
            Width of the rounded seam; 0: a sharp seam.

        Returns
        -------
        Node
        """
        return _made("difference", self, *others, smooth=smooth)

    def translate(self, offset: Sequence[float] | NDArray[Any]) -> Node:
        """Translate the shape.

        Parameters
        ----------
        offset : three numbers
            Displacement along x, y and z.

        Returns
        -------
        Node
        """
        return _made("transform", self, translate=offset)

    def scale(self, factor: float | Sequence[float]) -> Node:
        """Scale the shape about the origin.

        Parameters
        ----------
        factor : float or three numbers
            One factor, or one for each axis.

        Returns
        -------
        Node
        """
        return _made("transform", self, scale=factor)

    def rotate(self, degrees: float, axis: Axis | Sequence[float] = "z") -> Node:
        """Rotate the shape about an axis through the origin.

        Parameters
        ----------
        degrees : float
            Angle, counter-clockwise seen against the axis.
        axis : {"x", "y", "z"} or three numbers
            Axis of rotation.

        Returns
        -------
        Node
        """
        return _made("transform", self, rotate=(*direction(axis), degrees))

    def mirror(self, axis: Axis) -> Node:
        """Union of the half of the shape on the positive side of an axis and its mirror image.

        Parameters
        ----------
        axis : {"x", "y", "z"}
            Normal of the mirror plane through the origin.

        Returns
        -------
        Node
        """
        return _made("mirror", self, axis=axis)

    def repeat(self, period: float | Sequence[float], count: int | Sequence[int] = 0) -> Node:
        """Repeat the shape on a lattice centred at the origin.

        Parameters
        ----------
        period : float or three numbers
            Distance between copies along x, y and z.
        count : int or three whole numbers
            Copies along x, y and z; 0: without end.

        Returns
        -------
        Node
        """
        return _made("repeat", self, period=three(period), count=three(count))

    def twist(self, degrees: float, axis: Axis = "z") -> Node:
        """Twist the shape about an axis.

        Parameters
        ----------
        degrees : float
            Angle per unit of length along the axis.
        axis : {"x", "y", "z"}
            Axis of the twist.

        Returns
        -------
        Node
        """
        return _made("twist", self, degrees=degrees, axis=axis)

    def bend(self, degrees: float, axis: Axis = "z") -> Node:
        """Bend the shape.

        Parameters
        ----------
        degrees : float
            Angle per unit of length along the bent axis.
        axis : {"x", "y", "z"}
            The hinge, which stays straight: z bends x towards y, x bends y towards z, y bends z towards x.

        Returns
        -------
        Node
        """
        return _made("bend", self, degrees=degrees, axis=axis)

    def offset(self, distance: float) -> Node:
        """Offset the surface of the shape.

        Parameters
        ----------
        distance : float
            Outward displacement; negative: inward.

        Returns
        -------
        Node
        """
        return _made("offset", self, distance=distance)

    def shell(self, thickness: float) -> Node:
        """Hollow the shape, leaving a wall.

        Parameters
        ----------
        thickness : float
            Thickness of the wall. Its outer face is the surface of the shape.

        Returns
        -------
        Node
        """
        return _made("shell", self, thickness=thickness)

    def material(self, **appearance: Any) -> Node:
        """Set the appearance of the shape in pictures, such as ``colour=(1, 0, 0)``.

        Parameters
        ----------
        **appearance
            Parameters of the formula `material`.

        Returns
        -------
        Node
        """
        return _made("material", self, **appearance)

    def distance(self, points: ArrayLike) -> NDArray[np.floating]:
        """Signed distance field of the shape at points, negative inside.

        The field is exact for primitives. For other shapes it is a bound: outside, the distance to the
        surface is at least the value divided by the Lipschitz bound.

        Parameters
        ----------
        points : array of float32 or float64, [..., 3]
            Coordinates in scene units: those of the shape itself, before a mesh is scaled to its size in mm.

        Returns
        -------
        ndarray [...]
            Values in the precision of the points; float64 for other numeric types.

        Raises
        ------
        SceneError
            If the last axis of the points is not x, y, z, or an unbounded shape contains a fractal with
            automatic iterations.

        Examples
        --------
        >>> from fracslice import sphere
        >>> sphere(0.5).distance([[0, 0, 0], [2, 0, 0]])
        array([-0.5,  1.5])
        """
        values: NDArray[np.floating] = provider("distances").distance(self, points)
        return values


def _made(name: str, *elements: Operators, **values: Any) -> Node:
    """Node of the formula with this name."""
    node: Node = FORMULAS[name](*cast("tuple[Node, ...]", elements), **values)
    return node


def _folded(name: str, first: Operators, second: Operators) -> Node:
    """One operator over the elements of both, so that ``a | b | c`` is ``union(a, b, c)``."""
    return _made(name, *_elements(name, first), *_elements(name, second))


def _elements(name: str, shape: Operators) -> tuple[Node, ...]:
    """Elements of a sharp operator of this name made in Python; otherwise the shape itself."""
    node = cast("Node", shape)
    same = node.formula.name == name and node["smooth"] == 0 and node.place is None
    return node.children if same else (node,)
