"""Elements of a scene: nodes, their operators and methods, and the Python signatures of formulas."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from inspect import Parameter, Signature
from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, Protocol, cast, runtime_checkable

from ..common.messages import hint
from ..common.parameters import (
    REQUIRED,
    Choice,
    Count,
    Digest,
    File,
    Label,
    Vector,
    parameter_lines,
    python_name,
)
from ..errors import SceneError
from ..expr.language import InMemory
from .box import Axis, Box, direction, three
from .field import Bounds, Cells, Device, Field, Kernel, Loops, Precision, outermost

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from ..common.arrays import Triangles
    from .linker import Elements, Linked
    from .registry import Formula

FORMULAS: dict[str, Formula] = {}
"""Every registered formula by the name of its element."""


@runtime_checkable
class TriangleMesh(Protocol):
    """Mesh of this or another library."""

    @property
    def vertices(self) -> Any:
        """Positions, [n, 3]."""

    @property
    def faces(self) -> Any:
        """Vertex indices, [m, 3], counter-clockwise seen from outside."""


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

    def __or__(self, other: Node | TriangleMesh) -> Node:
        """Union of two shapes; of a shape and a mesh, too."""
        shape = _shape(other)
        return NotImplemented if shape is None else _fold_operator("union", self, shape)

    def __and__(self, other: Node | TriangleMesh) -> Node:
        """Intersection of two shapes; of a shape and a mesh, too."""
        shape = _shape(other)
        return NotImplemented if shape is None else _fold_operator("intersection", self, shape)

    def __sub__(self, other: Node | TriangleMesh) -> Node:
        """Difference of two shapes; of a shape and a mesh, too."""
        shape = _shape(other)
        return (
            NotImplemented
            if shape is None
            else _make_node("difference", *_elements("difference", self), shape)
        )

    def __ror__(self, mesh: TriangleMesh) -> Node:
        """Union of a mesh and this shape."""
        shape = _shape(mesh)
        return NotImplemented if shape is None else shape | cast("Node", self)

    def __rand__(self, mesh: TriangleMesh) -> Node:
        """Intersection of a mesh and this shape."""
        shape = _shape(mesh)
        return NotImplemented if shape is None else shape & cast("Node", self)

    def __rsub__(self, mesh: TriangleMesh) -> Node:
        """Difference of a mesh and this shape."""
        shape = _shape(mesh)
        return NotImplemented if shape is None else shape - cast("Node", self)

    def __add__(self, offset: Sequence[float] | NDArray[Any]) -> Node:
        """Translation by an offset (x, y, z)."""
        return NotImplemented if isinstance(offset, Operators) else self.translate(offset)

    def union(self, *others: Node, smooth: float | str | Callable[..., Any] = 0.0) -> Node:
        """Union of this shape and others.

        Parameters
        ----------
        *others : Node
            The other shapes.
        smooth : float, str or callable
            Width of the rounded seam; 0: a sharp seam. An expression in x, y and z, or a function of a point,
            gives it at each point.

        Returns
        -------
        Node
        """
        return _make_node("union", self, *others, smooth=smooth)

    def intersection(self, *others: Node, smooth: float | str | Callable[..., Any] = 0.0) -> Node:
        """Intersection of this shape and others.

        Parameters
        ----------
        *others : Node
            The other shapes.
        smooth : float, str or callable
            Width of the rounded seam; 0: a sharp seam. An expression in x, y and z, or a function of a point,
            gives it at each point.

        Returns
        -------
        Node
        """
        return _make_node("intersection", self, *others, smooth=smooth)

    def difference(self, *others: Node, smooth: float | str | Callable[..., Any] = 0.0) -> Node:
        """This shape minus others.

        Parameters
        ----------
        *others : Node
            The shapes to subtract.
        smooth : float, str or callable
            Width of the rounded seam; 0: a sharp seam. An expression in x, y and z, or a function of a point,
            gives it at each point.

        Returns
        -------
        Node
        """
        return _make_node("difference", self, *others, smooth=smooth)

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
        return _make_node("transform", self, translate=offset)

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
        return _make_node("transform", self, scale=factor)

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
        return _make_node("transform", self, rotate=(*direction(axis), degrees))

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
        return _make_node("mirror", self, axis=axis)

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
        return _make_node("repeat", self, period=three(period), count=three(count))

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
        return _make_node("twist", self, degrees=degrees, axis=axis)

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
        return _make_node("bend", self, degrees=degrees, axis=axis)

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
        return _make_node("offset", self, distance=distance)

    def shell(self, thickness: float | str | Callable[..., Any]) -> Node:
        """Hollow the shape, leaving a wall.

        Parameters
        ----------
        thickness : float, str or callable
            Thickness of the wall, or an expression in x, y and z, or a function of a point, that gives it.
            Its outer face is the surface of the shape.

        Returns
        -------
        Node
        """
        return _make_node("shell", self, thickness=thickness)

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
        return _make_node("material", self, **appearance)

    def __call__(self, *points: ArrayLike) -> Any:
        """`distance` of points."""
        return self.distance(*points)

    def distance(self, *points: ArrayLike) -> Any:
        """Signed distance field of the shape at points, negative inside.

        The field is exact for primitives. For other shapes it is a bound: outside, the distance to the
        surface is at least the value divided by the Lipschitz bound.

        Parameters
        ----------
        *points : array of float32 or float64, [..., 3], or three arrays
            Coordinates in scene units: those of the shape itself, before a mesh is scaled to its size in mm.
            Points, or x, y and z, which are broadcast; of NumPy, or of a library with DLPack, on the CPU.

        Returns
        -------
        ndarray [...]
            Values in the precision of the points; float64 for other numeric types. For an array of another
            library, one of that.

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
        >>> sphere(0.5)(0, 0, [1, 2])
        array([0.5, 1.5])
        """
        from ..api.calls import distance

        return distance(cast("Node", self), *points)

    def gradient(self, *points: ArrayLike) -> Any:
        """Gradient of the field at points, by central differences in float64.

        Parameters
        ----------
        *points : array [..., 3], or three arrays
            As for `distance`.

        Returns
        -------
        ndarray [..., 3]
            In the direction in which the field rises most: outwards. Its length is about 1 where the field is
            a distance.

        Raises
        ------
        SceneError
            As `distance`.
        """
        from ..api.calls import gradient

        return gradient(cast("Node", self), *points)

    def normals(self, *points: ArrayLike) -> Any:
        """Outward unit vectors of the field at points: the normals, on the surface.

        Parameters
        ----------
        *points : array [..., 3], or three arrays
            As for `distance`.

        Returns
        -------
        ndarray [..., 3]
            Zero where the field is flat.

        Raises
        ------
        SceneError
            As `distance`.

        Examples
        --------
        >>> from fracslice import sphere
        >>> sphere(0.5).normals([0, 0, 0.5]).round(6) + 0.0
        array([0., 0., 1.])
        """
        from ..api.calls import normals

        return normals(cast("Node", self), *points)

    def show(self) -> Any:
        """Show the shape in a notebook, with sliders for all of its numbers.

        Returns
        -------
        Studio or Node
            `fracslice.Studio` of the shape; the shape itself, which is shown as a picture, where the extra
            `studio` is not installed.
        """
        from ..studio.notebook import show

        return show(cast("Node", self))

    def _repr_html_(self) -> str:
        """Picture and elements, for a notebook."""
        from ..api.calls import page

        return page(cast("Node", self))


def _shape(given: Any) -> Node | None:
    """A shape itself, or the solid of a mesh; None for anything else."""
    if isinstance(given, Operators):
        return cast("Node", given)
    if not isinstance(given, TriangleMesh):
        return None
    from ..mesh.models import from_trimesh

    return from_trimesh(given)


def _make_node(name: str, *elements: Operators, **values: Any) -> Node:
    """Node of the formula with this name."""
    node: Node = FORMULAS[name](*cast("tuple[Node, ...]", elements), **values)
    return node


def _fold_operator(name: str, first: Operators, second: Operators) -> Node:
    """One operator over the elements of both, so that ``a | b | c`` is ``union(a, b, c)``."""
    return _make_node(name, *_elements(name, first), *_elements(name, second))


def _elements(name: str, shape: Operators) -> tuple[Node, ...]:
    """Elements of a sharp operator of this name made in Python; otherwise the shape itself."""
    node = cast("Node", shape)
    same = node.formula.name == name and node["smooth"] == 0 and node.place is None
    return node.children if same else (node,)


def ordered_parameters(formula: Formula) -> dict[str, Any]:
    """Parameters of a formula by name; Python requires parameters without a default to come first."""
    return dict(sorted(formula.parameters.items(), key=lambda item: item[1].default is not REQUIRED))


def bind_arguments(
    formula: Formula, positional: tuple[Any, ...], keywords: Mapping[str, Any]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Bind the arguments of a call to elements and parameters."""
    names = formula.names
    given = {names.get(name, name): value for name, value in keywords.items()}
    for name in given:
        if name not in formula.parameters:
            near = hint(name, names) if names else "it has none"
            raise SceneError(f"<{formula.name}> has no attribute {name!r}; {near}")
    if formula.children[1] != 0:
        return positional, given
    if len(positional) > len(names):
        most = f"at most {len(names)}: {', '.join(names)}" if names else "none"
        raise SceneError(f"<{formula.name}> has {len(positional)} values: expected {most}")
    first = dict(zip(names.values(), positional, strict=False))
    for name in first.keys() & given.keys():
        raise SceneError(f"<{formula.name}> has two values of {name}: expected one")
    return (), first | given


def signature(formula: Formula, node: type) -> Signature:
    """Signature of a formula as a Python function that makes a `node`."""
    alone = formula.children[1] == 0
    kind = Parameter.POSITIONAL_OR_KEYWORD if alone else Parameter.KEYWORD_ONLY
    elements = [] if alone else [Parameter("elements", Parameter.VAR_POSITIONAL, annotation=node)]
    values = [
        Parameter(
            python_name(name),
            kind,
            default=Parameter.empty if parameter.default is REQUIRED else parameter.default,
            annotation=annotation(parameter),
        )
        for name, parameter in ordered_parameters(formula).items()
    ]
    return Signature([*elements, *values], return_annotation=node)


def annotation(parameter: Any) -> Any:
    """Type annotation of a parameter's values."""
    match parameter:
        case Count(words=words):
            type_: Any = int | Literal[*words] if words else int
        case Vector(sizes=sizes, whole=whole):
            several = Sequence[int] if whole else Sequence[float]
            type_ = float | several if 1 in sizes else several
        case Choice(choices=choices):
            type_ = Literal[*choices]
        case File() | Digest() | Label():
            type_ = str
        case _:
            type_ = getattr(parameter, "annotation", float)
    return type_ | None if parameter.default is None else type_


def docstring(formula: Formula) -> str:
    """Docstring of a formula with its parameters, in numpydoc style."""
    lines = [inspect.cleandoc(formula.doc)]
    if formula.children[1] != 0 or formula.parameters:
        lines += ["", "Parameters", "----------"]
    if formula.children[1] != 0:
        lines += ["*elements : Node", f"    {_ELEMENTS[formula.children[1] == 1]}"]
    return "\n".join(
        [*lines, *parameter_lines(ordered_parameters(formula)), "", "Returns", "-------", "Node"]
    )


_ELEMENTS = {True: "What it is applied to; several are a union.", False: "What it is made of."}


@dataclass(frozen=True)
class Node(Operators, Field):
    """A formula with its parameters and children: one element of a scene.

    Attributes
    ----------
    formula : Formula
        The registered formula.
    values : mapping of str to value
        Parameter values by name.
    children : tuple of Node
        The elements inside.
    place : str or None
        "file:line" of the element in its scene file.
    is_conservative : bool
        True for a tree made by `conservative`.
    depth : int
        Levels of nesting, this element included.
    """

    formula: Formula
    values: Mapping[str, Any]
    children: tuple[Node, ...] = ()
    place: str | None = field(default=None, compare=False)
    is_conservative: bool = False
    depth: int = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", 1 + max([child.depth for child in self.children], default=0))

    def __getitem__(self, parameter: str) -> Any:
        """Value of a parameter."""
        return self.values[parameter]

    def __repr__(self) -> str:
        kinds, name = self.formula.parameters, python_name
        changed = [f"{name(k)}={v!r}" for k, v in self.values.items() if v != kinds[k].default]
        return f"{self.formula.name}({', '.join([*map(repr, self.children), *changed])})"

    def __hash__(self) -> int:
        # the first of many children tells trees apart well enough
        return hash((self.formula.name, tuple(self.values.items()), len(self.children), self.children[:1]))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore_node, (
            self.formula,
            dict(self.values),
            self.children,
            self.place,
            self.is_conservative,
        )

    def walk(self) -> Iterator[Node]:
        """Iterate over this node and all below it, parents first.

        Yields
        ------
        Node
        """
        left = [self]
        while left:
            node = left.pop()
            yield node
            left += reversed(node.children)

    @cached_property
    def formulas(self) -> frozenset[Formula]:
        """Formulas of the tree, by which a pass over it knows that there is nothing to do."""
        return _joined(self.formula, frozenset(child.formulas for child in self.children))

    def has_hook(self, name: str) -> bool:
        """Return whether a formula of the tree has a hook.

        Parameters
        ----------
        name : str
            Name of the hook's decorator.

        Returns
        -------
        bool
        """
        return any(name in formula.hooks for formula in self.formulas)

    @property
    def fields(self) -> tuple[Node, ...]:
        """Children whose fields this one is made of; those of a hybrid are steps, not fields."""
        return () if self.formula.kind == "shape" else self.children[self.formula.steps :]

    def solids(self) -> Iterator[Node]:
        """Iterate over this node and all fields below it, parents first.

        Yields
        ------
        Node
        """
        left = [self]
        while left:
            node = left.pop()
            yield node
            left += reversed(node.fields)

    def changed(self, children: tuple[Node, ...] | None = None, **values: Any) -> Node:
        """Copy with other values or children.

        Parameters
        ----------
        children : tuple of Node, optional
            New children; the present ones by default.
        **values
            New parameter values by name.

        Returns
        -------
        Node

        Raises
        ------
        SceneError
            For an invalid value or number of children.
        """
        kept, given = self.children if children is None else children, _given_values(self)
        if values:
            kinds = self.formula.parameters
            given = {name: value for name, value in given.items() if not kinds[name].implied}
        return self.formula(*kept, source=self.place, **{**given, **values})

    def conservative(self) -> Node:
        """Conservative tree, for skipping empty space where the node's own field exceeds its bound.

        The two differ beside the tears of fractional powers, at seams with an escape-time fractal, and for
        hybrids.

        Returns
        -------
        Node
            Its positive values, divided by its own Lipschitz bound, are lower bounds of the distance to this
            node's surface. Other values bound nothing.
        """
        return self._conservative if self.bounds.exterior_only and not self.is_conservative else self

    @cached_property
    def _conservative(self) -> Node:
        fields = tuple(child.conservative() for child in self.fields)
        steps = self.children[: len(self.children) - len(fields)]
        return replace(self, is_conservative=True, children=(*steps, *fields))

    def fail(self, message: str) -> SceneError:
        """Error about this node: file, line and element, then the message.

        Parameters
        ----------
        message : str
            The fault, and the expected value.

        Returns
        -------
        SceneError
        """
        return SceneError(f"{self.place + ': ' if self.place else ''}<{self.formula.name}> {message}")

    @cached_property
    def bounds(self) -> Bounds:
        """Box, Lipschitz bound and kind of this field."""
        formula, below = self.formula, [child.bounds for child in self.fields]
        box = self._hooked("bounds", EVERYWHERE)
        slope = self._hooked("slope", max([formula.lipschitz, *[b.lipschitz for b in below]]))
        steepening = self._hooked("steepening", max([0.0, *[b.steepening for b in below]]))
        exterior_only = formula.exterior_only or True in [b.exterior_only for b in below]
        is_measured = formula.exterior_only and not self._hooked("proves_slope", False)
        boxless = _names([b.boxless for b in below], formula.name, "bounds" not in formula.hooks)
        measured = _names([b.measured for b in below], formula.name, is_measured)
        return Bounds(box, slope, exterior_only, steepening, boxless, measured)

    @cached_property
    def linked(self) -> Linked:
        """Functions and numbers of the tree, whose depths are resolved; see `linker.link`."""
        from .linker import link

        return link(self)

    @cached_property
    def linked_elements(self) -> Elements:
        """Elements of a long union, as all kernels of its field link them; see `regions.is_long`."""
        from .linker import FieldDialect, link_elements

        return link_elements(self, FieldDialect())

    def _hooked(self, name: str, default: Any, *arguments: Any) -> Any:
        """Value of a hook of the formula, or the default of a formula without it."""
        hook = self.formula.hooks.get(name)
        return hook(self, *arguments) if hook else default

    @property
    def tree(self) -> Node:
        return self

    @property
    def tips(self) -> NDArray[np.float64] | None:
        known: NDArray[np.float64] | None = self._hooked("tips", None)
        if known is None and (own := self.triangles()) is not None:
            known = outermost(own.vertices)
        if known is None and self.is_identity and len(self.children) == 1:
            known = self.children[0].tips
        return known

    @property
    def escape_time_only(self) -> bool:
        shapes = (node for node in self.solids() if node.formula.kind == "shape")
        return all(shape._hooked("potential", shape.formula.exterior_only) for shape in shapes)

    @cached_property
    def key(self) -> str:
        # all depths must be resolved, as for kernels and loops
        from .devices import key

        return key(self)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        from .devices import kernel

        return kernel(self, device, precision)

    def cells(self, precision: Precision = "float32") -> Cells | None:
        from .devices import cells

        return cells(self, precision)

    def loops(self, loops: Sequence[Any], precision: Precision, device: Device = "cpu") -> Loops:
        from .devices import linked_loops

        return linked_loops(self, loops, precision, device)

    @property
    def is_in_memory(self) -> bool:
        """True for a field of data in memory: a model, an outline, beams."""
        # a fractal has none, and its depth may be open
        return not self.formula.exterior_only and any(
            isinstance(value, InMemory) for value in self.arguments.values()
        )

    @cached_property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the kernel function by name: numbers, tuples of numbers, or `Fixed`."""
        values: dict[str, Any] = self._hooked("arguments", dict(self.values))
        return values

    @cached_property
    def function(self) -> Callable[..., Any]:
        """Function to compile for this node."""
        function: Callable[..., Any] = self._hooked("select", self.formula.function)
        return function

    def visible(self, voxel: float) -> Node:
        """This node without detail finer than a voxel; its children are unchanged.

        Parameters
        ----------
        voxel : float
            Voxel size in the node's own units.

        Returns
        -------
        Node
        """
        node: Node = self._hooked("visible", self, voxel)
        return node

    def triangles(self) -> Triangles | None:
        """Triangles that are the whole surface, a printable solid; None where it is known as a field alone.

        Returns
        -------
        Triangles or None
            Scene units.
        """
        own: Triangles | None = self._hooked("triangles", None)
        return own

    def signs(self) -> Node:
        """Tree whose field has the sign of this one's and is enclosed more tightly by intervals.

        Returns
        -------
        Node
        """
        if not self.has_hook("sign"):
            return self
        if hooked := self._hooked("sign", None):
            function, values = hooked
            own = {"select": lambda _: function, "arguments": lambda _: values}
            return replace(self, formula=replace(self.formula, hooks={**self.formula.hooks, **own}))
        if self._hooked("keeps_sign", False):
            return replace(self, children=tuple(child.signs() for child in self.children))
        return self

    @property
    def proved_box(self) -> Box:
        return self._boxed().bounds.box

    def _boxed(self) -> Node:
        """Tree with proved boxes."""
        if not self.has_hook("proved_bounds"):
            return self
        if self.formula.kind != "shape":
            return replace(self, children=tuple(child._boxed() for child in self.children))
        hooks = self.formula.hooks
        return replace(self, formula=replace(self.formula, hooks={**hooks, "bounds": hooks["proved_bounds"]}))

    @property
    def is_identity(self) -> bool:
        """True if the node changes nothing and can be left out."""
        return bool(self._hooked("identity", False))

    @property
    def is_unordered(self) -> bool:
        """True if the elements but the first may be folded in any order, to the same bits."""
        return bool(self._hooked("unordered", False))


EVERYWHERE = Box.everywhere()


def _names(below: Sequence[tuple[str, ...]], own: str, is_one: bool) -> tuple[str, ...]:
    """Names of formulas below a node, and its own if it is one of them, each once."""
    names = dict.fromkeys(chain.from_iterable(below))
    return tuple(names | {own: None} if is_one else names)


@lru_cache(maxsize=512)
def _joined(formula: Formula, below: frozenset[frozenset[Formula]]) -> frozenset[Formula]:
    """Formulas of a tree from those of the trees below it: few sets, however many nodes."""
    return frozenset({formula}).union(*below)


def _restore_node(formula: Formula, values: dict[str, Any], *fields: Any) -> Node:
    """Node from its pickled fields."""
    return Node(formula, MappingProxyType(values), *fields)


def _given_values(node: Node) -> dict[str, Any]:
    """Parameter values that are not None."""
    return {name: value for name, value in node.values.items() if value is not None}
