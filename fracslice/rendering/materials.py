"""Materials: colours, palettes and orbit traps at a point of a surface, in pictures and on meshes;
bodies that glow.

The field's tree is compiled a second time, with every function returning (f, paint, tone). `paint` is the
material's number, 0 for none. `tone` is the smallest abs(w) of the orbit (Pickover's and Carlson's orbit
traps; Carlson 1999). The result is evaluated once per hit.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import from_linear
from ..expr.frontend import FormulaReader, formula, kernel_function, source_function
from ..expr.graph import ON_ARRAYS, Entry, Evaluator, FlowGraph, Function, Value, Writer, identified
from ..expr.vocabulary import absolute, atan2, minimum, sqrt, where
from ..fields.linker import (
    EMPTY,
    Arguments,
    DomainReader,
    Elements,
    FieldDialect,
    Linker,
    Run,
    Subroutine,
    append_numbers,
    arguments,
    domain_function,
    link_elements,
    link_tree,
    part_function,
)
from ..fields.registry import Fixed, Node
from ..formulas.material import material, stops
from ..work import Work, chunks
from .environments import load_picture
from .setup import Optics
from .units import shade
from .units.camera import linear
from .units.surface import painted


@dataclass
class Drawn:
    """Random numbers of a bounce."""

    count: int = 0  # numbers in use

    def place(self, count: int) -> int:
        """Reserve random numbers; return the place of the first."""
        self.count += count
        return self.count - count


MOST = 16
"""Bodies of their own; more than that are one."""
THINNEST = 1e-3
"""Least side of a box, relative to its largest."""


def glowing_bodies(root: Node) -> list[tuple[float, ...]]:
    """Return the bodies that glow."""
    nodes = {id(n): n for n in root.walk() if n.formula.name == material.name and n["glow"]}
    bodies = [_body(_only(root, node), node) for node in nodes.values()]
    known = [body for body in bodies if body]
    if len(known) <= MOST:
        return known
    low, high = (
        [kind(b[a] + s * b[a + 3] for b in known) for a in range(3)] for kind, s in ((min, -1), (max, 1))
    )
    return [_numbers(low, high, sum(b[-1] for b in known))]


def _only(node: Node, wanted: Node) -> Node | None:
    """The tree without the members of its unions that do not hold a node; None if nothing holds it."""
    if node is wanted:
        return node
    parts = [part for child in node.children if (part := _only(child, wanted))]
    if node.formula.name == "union" or not parts:
        return node.changed(tuple(parts)) if len(parts) > 1 else next(iter(parts), None)
    return node.changed((parts[0],)) if len(node.children) == 1 else node


def _body(part: Node | None, node: Node) -> tuple[float, ...]:
    """Numbers of the body of a material; empty if it has no end."""
    assert part
    box = part.bounds.box
    if not box.finite or min(box.size) <= 0:
        return ()
    x, y, z = box.size
    return _numbers(box.lo, box.hi, node["glow"] * max(linear(stops(node))) * (x * y + y * z + z * x))


def _numbers(low: Sequence[float], high: Sequence[float], power: float) -> tuple[float, ...]:
    """Centre and half sides of a box, and a power."""
    half = [(b - a) / 2 for a, b in zip(low, high, strict=True)]
    least = THINNEST * max(half)
    return (*((a + b) / 2 for a, b in zip(low, high, strict=True)), *(max(h, least) for h in half), power)


def wholly_met(bodies: list[tuple[float, ...]], eye: Sequence[float], seen: Optics) -> float:
    """Part of a pixel's width that is no wider than any body, at most 1: rays pass what is narrower."""
    parts = [max(b[3:6]) / (seen.cone * math.dist(eye, b[:3]) + seen.least) for b in bodies]
    return min([1.0, *parts])


class Bodies(NamedTuple):
    """Units of the bodies that glow: share of rays that are sent to them, a direction, and its density."""

    share: Function
    towards: Function
    density: Function

    @classmethod
    def linked(cls, linker: Linker, bodies: list[tuple[float, ...]]) -> Bodies:
        """Bind the units to the numbers of the bodies."""
        values = {"bodies": tuple(bodies), "count": Fixed(len(bodies))}
        units = shade.sent_share, shade.towards_body, shade.body_density
        return cls(*(linker.bind(unit, values) for unit in units))


@dataclass
class TrapReader(FormulaReader):
    """Reads a shape with the running value of an orbit's trap, which it returns beside the field's."""

    trap: str = field(kw_only=True)

    def read(self) -> FlowGraph:
        start, _, _ = _TRAPS[self.trap]
        self.names["nearest"] = self.add("add", self.add("mul", 0.0, self.names["x"]), start)
        return super().read()

    def expression(self, node: ast.expr) -> None:
        """The mark of a step of the orbit."""
        assert isinstance(node, ast.Call)
        r2, alive, x, y, z = map(self.value, node.args)
        nearest, update = self.names["nearest"], _TRAPS[self.trap][1]
        value = self.call(formula(update), nearest, r2, x, y, z)
        self.names["nearest"] = self.add("where", alive, value, nearest)

    def parts(self, node: ast.For | ast.While) -> tuple[set[str], Callable[[], bool]]:
        """Names that a loop changes: the running value, too."""
        changed, body = super().parts(node)
        return changed | {"nearest"}, body

    def returned(self, value: Value) -> None:
        super().returned(self.add("tuple", value, self.names["nearest"]))


@dataclass
class PaintReader(DomainReader):
    """Reads a domain operator with the paint and the tone of its child's lowest evaluation."""

    def read(self) -> FlowGraph:
        zero = self.add("mul", 0.0, self.names["x"])
        self.names |= {"lowest": self.add("add", zero, 1e30), "paint": zero, "tone": zero}
        return super().read()

    def evaluated_child(self, point: list[Value]) -> Value:
        inner, paint, tone = self.items(super().evaluated_child(point), 3)
        names = self.names
        lower = self.add("lt", inner, names["lowest"])
        names["paint"] = self.add("where", lower, paint, names["paint"])
        names["tone"] = self.add("where", lower, tone, names["tone"])
        names["lowest"] = self.add("minimum", names["lowest"], inner)
        return inner

    def parts(self, node: ast.For | ast.While) -> tuple[set[str], Callable[[], bool]]:
        """Names that a loop changes: those of the child, too."""
        changed, body = super().parts(node)
        return changed | {"lowest", "paint", "tone"}, body

    def returned(self, value: Value) -> None:
        super().returned(self.add("tuple", value, self.names["paint"], self.names["tone"]))


TRAP, NEAREST = "trap", "point"


def _nearest_point(nearest, r2, x, y, z):  # type: ignore[no-untyped-def]
    return minimum(nearest, r2)


def _nearest_axis(nearest, r2, x, y, z):  # type: ignore[no-untyped-def]
    return minimum(nearest, minimum(x * x + minimum(y * y, z * z), y * y + z * z))


def _nearest_plane(nearest, r2, x, y, z):  # type: ignore[no-untyped-def]
    return minimum(nearest, minimum(x * x, minimum(y * y, z * z)))


def _nearest_sphere(nearest, r2, x, y, z):  # type: ignore[no-untyped-def]
    return minimum(nearest, absolute(r2 - 1.0))


def _steps(nearest, r2, x, y, z):  # type: ignore[no-untyped-def]
    return nearest + 0.0625


def _direction(nearest, r2, x, y, z):  # type: ignore[no-untyped-def]
    return 0.5 + 0.15915494309189535 * atan2(y, x)


def _tone(nearest):  # type: ignore[no-untyped-def]
    return nearest


def _distance_tone(nearest):  # type: ignore[no-untyped-def]
    return where(nearest < 1e29, nearest, 1.0)


def _root_tone(nearest):  # type: ignore[no-untyped-def]
    return where(nearest < 1e29, sqrt(nearest), 1.0)


_TRAPS: dict[str, tuple[float, Callable[..., Any], Callable[..., Any]]] = {
    "point": (1e30, _nearest_point, _root_tone),
    "axes": (1e30, _nearest_axis, _root_tone),
    "planes": (1e30, _nearest_plane, _root_tone),
    "sphere": (1e30, _nearest_sphere, _distance_tone),
    "steps": (0.0, _steps, _tone),
    "direction": (0.5, _direction, _tone),
}
"""Start and update of each trap's running value, and its position in the palette: 1 without an orbit."""


def traps(root: Node, trap: str = NEAREST) -> dict[int, str]:
    """Return the orbit traps of the shapes of a tree."""
    trap = root["trap"] if root.formula.name == material.name else trap
    below = (item for child in root.children for item in traps(child, trap).items())
    return dict(below) if root.children else {id(root): trap}


def _of_one(node: Node) -> bool:
    """True for a union, an intersection or a difference of a single element."""
    formula = node.formula
    return formula.kind == "csg" and formula.children[1] is None and len(node.children) == 1


@dataclass
class TraceDialect(FieldDialect):
    """Dialect whose functions return (f, paint, tone)."""

    # paint number of each material node, by the node's `id`
    materials: dict[int, int] = field(default_factory=dict)
    # orbit trap of each shape, by the node's `id`; see `traps`
    traps: dict[int, str] = field(default_factory=dict)
    prefix: str = "T"  # prefix of the function names

    def kept(self, node: Node) -> Node:
        """Skip identity nodes, except materials, and operators of one element; see `Dialect.kept`."""
        while _of_one(node) or (node.is_identity and node.formula.name != material.name):
            node = node.children[0]
        return node

    def arguments(self, node: Node) -> Arguments:
        """Return the function and arguments of a node; a material passes its paint number.

        See `Dialect.arguments`.
        """
        if node.formula.name != material.name:
            given = arguments(node)
            trap = self.traps.get(id(node), NEAREST)
            return given if trap == NEAREST else replace(given, fixed=(*given.fixed, (TRAP, trap)))
        paint: list[float] = []
        structure = append_numbers(float(self.materials[id(node)]), paint)
        return Arguments(node.function, (), (structure,), paint)

    def elements(self, node: Node) -> Elements:
        """Return the elements of a long union, with their paints; see `Dialect.elements`."""
        return link_elements(node, self)

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Keep the order of the children: at equal distances the first child's paint is taken.

        See `Dialect.order`.
        """
        return range(len(parts))

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a node; see `Dialect.write`."""
        if node.formula.name == material.name:
            return self.painted(name, given, runs[0])
        return super().write(name, node, given, runs)

    def painted(self, name: str, given: Arguments, child: Run) -> Function:
        """Return the function of a material: its paint applies where the child has none."""

        def write(writer: Writer) -> Value:
            f, paint, tone = writer.items(child.call(writer), 3)
            (own,) = given.load(writer)
            kept = writer.add("where", writer.add("gt", paint, 0.5), paint, own)
            return writer.add("tuple", f, kept, tone)

        return part_function(name, given, [child], write, "painted")

    def shape(self, name: str, given: Arguments, _: Sequence[Run]) -> Function:
        """Return the function of a shape: the field value and the orbit trap; see `FieldDialect.shape`."""
        known = dict(given.fixed)
        trap = known.pop(TRAP, NEAREST)
        of, tone = trapped(given.function, tuple(known.items()), trap), _TRAPS[trap][2]

        def write(writer: Writer) -> Value:
            x, y, z = (writer.names[a] for a in "xyz")
            f, nearest = writer.items(writer.call(of, x, y, z, *given.load(writer)), 2)
            paint = writer.add("mul", 0.0, x)
            return writer.add("tuple", f, paint, writer.call(formula(tone), nearest))

        return part_function(
            name, replace(given, fixed=tuple(known.items())), (), write, f"trap {of.identity}"
        )

    def csg_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a CSG operator: paint and tone of the child that determines the value.

        See `FieldDialect.csg_operator`.
        """

        def write(writer: Writer) -> Value:
            add = writer.add

            def fold(run: Run, k: Value | None) -> None:
                g, p, t = writer.items(run.call(writer, k=k), 3)
                a, names = writer.names["f"], writer.names
                names["f"] = f = writer.call(given.read, a, g, *given.load(writer))
                apart = (add("absolute", add("sub", add("absolute", f), add("absolute", v))) for v in (a, g))
                mine = add("le", *apart)
                names["paint"] = add("where", mine, names["paint"], p)
                names["tone"] = add("where", mine, names["tone"], t)

            begun, zero = runs[0].begin(writer), writer.constant(0.0)
            first = writer.items(begun, 3) if begun else [writer.constant(EMPTY), zero, zero]
            writer.names.update(zip(("f", "paint", "tone"), first, strict=True))
            if sum(run.count for run in runs) == 1:
                writer.names["f"] = writer.call(given.read, writer.names["f"], *given.load(writer))
            for k, run in enumerate(runs):
                run.each(writer, k == 0 and bool(begun), {"f", "paint", "tone"}, fold)
            return add("tuple", *(writer.names[name] for name in ("f", "paint", "tone")))

        return part_function(name, given, runs, write, "traced csg")

    def domain_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a domain operator: paint and tone of the child's lowest evaluation.

        See `FieldDialect.domain_operator`.
        """
        return domain_function(PaintReader, name, given, runs[0])


def trapped(
    function: Callable[..., Any] | Function, fixed: tuple[tuple[str, Any], ...], trap: str
) -> Function:
    """Return the function of a shape that returns its field and the running value of an orbit's trap."""
    plain = formula(function, fixed)
    about = identified(plain, _TRAPS[trap][0], formula(_TRAPS[trap][1]))
    return source_function(TrapReader, replace(plain.source, identity=about), fixed, trap=trap)


TEXELS = 1024 * 1024
"""Maximum number of pixels of a texture."""


def painted_in(root: Node) -> bool:
    """Return whether a tree has materials."""
    return material in root.formulas


def opaque_part(node: Node) -> Node | None:
    """Return a scene without the members of its unions that are transparent."""
    if not painted_in(node):
        return node
    if node.formula.name == material.name and node["clear"]:
        return None
    parts = tuple(opaque_part(child) for child in node.children)
    if all(part is child for part, child in zip(parts, node.children, strict=True)):
        return node
    if node.formula.name != "union":  # a transparent tool cuts all the same
        return node.changed((parts[0], *node.children[1:])) if parts[0] else None
    left = tuple(part for part in parts if part)
    return node.changed(left) if left else None


def transparent_part(node: Node) -> Node | None:
    """Return a scene with those members of its unions alone that are transparent."""
    if not painted_in(node):
        return None
    if node.formula.name == material.name and node["clear"]:
        return node
    parts = tuple(transparent_part(child) for child in node.children)
    if node.formula.name != "union":
        return node.changed((parts[0], *node.children[1:])) if parts and parts[0] else None
    left = tuple(part for part in parts if part)
    return node.changed(left) if len(left) > 1 else (left or (None,))[0]


def _head_on(index: float) -> float:
    """Reflectance of glass at normal incidence (Fresnel)."""
    return ((index - 1) / (index + 1)) ** 2


class PerMaterial(NamedTuple):
    """What differs between materials: entries of P, or a `Colour`."""

    first: Any
    others: tuple[tuple[float, Any], ...]  # each with the least number of its material


class Colour(NamedTuple):
    """Colour of a material: a plain one or a palette, and a picture that it is multiplied by."""

    plain: tuple[Entry, ...] | None
    palette: Function | None
    turns: tuple[Entry, Entry] | None  # factor and offset of the position in the palette
    texture: Function | None


class Look(NamedTuple):
    """Materials of a scene, as `units.surface` reads them: None stands for what the scene does not use."""

    colours: PerMaterial | None = None
    is_traced: bool = False  # whether the number of the material or the orbit trap is needed
    is_textured: bool = False
    is_path: bool = False  # whether rays also continue where a surface scatters light
    specular: PerMaterial | None = None
    shininess: PerMaterial | None = None
    glow: PerMaterial | None = None
    reflect: PerMaterial | None = None
    clear: PerMaterial | None = None  # and refraction; None if nothing is transparent
    refraction: PerMaterial | None = None
    absorb: PerMaterial | None = None
    passed: PerMaterial | None = None  # part of the light that the surface of glass passes
    roughness: PerMaterial | None = None  # and metallic; None if all reflect like Phong's
    metallic: PerMaterial | None = None
    coat: PerMaterial | None = None
    vary: PerMaterial | None = None  # and the positions in the palette
    turns: PerMaterial | None = None
    lost: Function | None = None  # light that one reflection by microfacets loses; None if all are smooth
    bodies: Bodies | None = None  # those that glow, of paths


@dataclass
class Materials:
    """Materials of a scene, and the links from a kernel to them.

    With one material, its numbers are read from P. With several, `paint` selects among them.
    """

    linker: Linker  # linker of the kernel
    root: Node  # root of the formula tree
    paths: bool = False  # true if rays also continue where a surface scatters light

    def __post_init__(self) -> None:
        self.nodes = [n for n in self.root.walk() if n.formula is material] if painted_in(self.root) else []
        covered = bool(self.nodes) and self.root is self.nodes[0] and len(self.nodes) == 1
        plain = material(self.root)
        self.all = self.nodes if covered else [plain, *self.nodes]
        self.paints = {id(n): self.all.index(n) if covered else k + 1 for k, n in enumerate(self.nodes)}
        self.inside = self.some("clear")
        self.rough = self.some("roughness") or self.some("vary")
        self.glossy = self.paths or self.some("coat") or self.rough or self.some("metallic")
        self.bounces = self.inside or self.glossy or self.some("reflect")

    def some(self, name: str) -> bool:
        """True if a material has a property."""
        return any(n[name] for n in self.all)

    def look(self) -> Look:
        """Link all properties."""
        bodies = glowing_bodies(self.root) if self.paths else []
        used = {"specular": True, "shininess": True, "glow": self.some("glow"), "reflect": self.bounces}
        used |= dict.fromkeys(("clear", "absorb"), self.inside)
        used |= dict.fromkeys(("roughness", "metallic"), self.glossy)
        used |= {"coat": self.some("coat"), "vary": self.some("vary")}
        linked: dict[str, Any] = {name: self.choice(name) for name, is_used in used.items() if is_used}
        if self.some("vary"):
            linked["turns"] = self.chosen(self.turns)
        if self.inside:
            linked["refraction"] = self.choice("index")
            linked["passed"] = self.chosen(
                lambda n: self.linker.argument(n["clear"] * (1 - _head_on(n["index"])))
            )
        if self.rough:
            linked["lost"] = self.linker.bind(shade.lost, {"table": reflected_shares()})
        if bodies:
            linked["bodies"] = Bodies.linked(self.linker, bodies)
        return self.coloured()._replace(is_path=self.paths, **linked)

    def coloured(self) -> Look:
        """Link the colours alone."""
        palettes = any(len(stops(n)) > 3 or n["vary"] for n in self.all)
        is_traced = len(self.all) > 1 or palettes
        return Look(self.chosen(self.colour), is_traced, self.some("texture"))

    def choice(self, name: str) -> PerMaterial:
        """Link a property."""
        return self.chosen(lambda node: self.linker.argument(node[name]))

    def chosen(self, link: Callable[[Node], Any]) -> PerMaterial:
        """Link each material."""
        first, *others = map(link, self.all)
        return PerMaterial(first, tuple((k + 0.5, other) for k, other in enumerate(others)))

    def trace(self, root: Node) -> Function:
        """Return the function of field, material's number and orbit trap of a part of the scene."""
        dialect = TraceDialect(materials=self.paints, traps=traps(self.root))
        return link_tree(self.linker, root, dialect)

    def colour(self, node: Node) -> Colour:
        """Link the colour of a material."""
        colours, texture = linear(stops(node)), self.texture(node) if node["texture"] else None
        if len(colours) == 3:
            return Colour(self.linker.argument(colours), None, None, texture)
        count = Fixed(len(colours) // 3)
        palette = self.linker.bind(shade.palette, {"stops": colours, "count": count})
        return Colour(None, palette, self.turns(node), texture)

    def texture(self, node: Node) -> Function:
        """Bind the unit of a picture on a material."""
        picture = load_picture(node["texture"], TEXELS, node.fail)
        width, height = picture.size
        given = {"light": picture.light, "width": width, "height": height, "tile": node["tile"]}
        return self.linker.bind(shade.triplanar, given)

    def turns(self, node: Node) -> Any:
        """Link factor and offset of the position in a palette."""
        return self.linker.argument((node["repeats"], node["shift"]))


MIDPOINTS = 24
"""Points along each side of the unit square of random numbers."""


@lru_cache(maxsize=1)
def reflected_shares() -> NDArray[np.float64]:
    """Return the table of `shade.lost`, by the midpoint rule over the directions that `shade.glossy` takes.

    It is rounded, so that it is the same on any machine.
    """
    grid = np.linspace(0, 1, int(shade.CELLS) + 1)
    points = (np.arange(MIDPOINTS) + 0.5) / MIDPOINTS
    rough, root, u, v = np.meshgrid(grid, grid, points, points, indexing="ij", sparse=True)
    z = np.maximum(root * root, 1e-4)
    none = 0.0 * z
    ray, normal = (np.sqrt(1 - z * z), none, -z), (none, none, 1 + none)
    *_, weight, _ = shade.glossy(*ray, *normal, rough, u, v)  # type: ignore[no-untyped-call]
    return np.asarray(weight.mean((2, 3)).round(5))


MATERIAL, PALETTE = "material", "viridis"

COUNT = 1 << 14
"""Points that are evaluated at a time."""

_FUNCTION = "colour"


@dataclass(frozen=True)
class Paint:
    """Colours of points."""

    colours: NDArray[np.uint8]  # sRGB
    # property of the orbit, by the name of the trap, or "trap" where materials choose it; and the number of
    # the material, "material", 0 for none
    scalars: Mapping[str, NDArray[np.float32]]


def paint(
    root: Node,
    points: NDArray[np.float64],
    shown: str,
    work: Work,
    palette: str | Sequence[str] | None = None,
) -> Paint:
    """Evaluate the colours of a scene.

    `points`: float64 (n, 3), scene units; `palette`: of a property of the orbit, its name or colours such as
    #e33399.
    """
    if shown != MATERIAL:
        own = palette or PALETTE
        chosen = {"palette": own} if isinstance(own, str) else {"colour": list(chain(*map(_components, own)))}
        root = material(_plain(root), trap=shown, **chosen)
    functions, parameters = _link_painting(root)
    evaluator = Evaluator(ON_ARRAYS, functions)
    values = np.empty((5, len(points)))

    def evaluate(rows: slice) -> None:
        with np.errstate(all="ignore"):
            values[:, rows] = np.broadcast_arrays(
                *evaluator(functions[_FUNCTION], *points[rows].T, parameters)
            )

    work.map(evaluate, chunks(len(points), COUNT))
    tone = {"trap" if shown == MATERIAL else shown: values[4].astype(np.float32)}
    number = {MATERIAL: values[3].astype(np.float32)} if shown == MATERIAL else {}
    return Paint(_encode_srgb(values[:3].T), {**tone, **number})


def _components(colour: str) -> tuple[float, ...]:
    """Red, green and blue of a text such as #e33399, from 0 to 1."""
    return tuple(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))


def _plain(node: Node) -> Node:
    """The tree without its materials."""
    if node.formula is material:
        return _plain(node.children[0])
    return node.changed(tuple(map(_plain, node.children))) if painted_in(node) else node


def _link_painting(root: Node) -> tuple[Mapping[str, Function], NDArray[np.float64]]:
    """Functions and parameters of the function of linear red, green and blue, material number and tone."""
    linker = Linker()
    materials = Materials(linker, root)
    for node in materials.all:
        if node["texture"]:
            raise node.fail("texture: expected none where vertices have colours, but no normals")
    linker.functions["traced"] = materials.trace(root)
    linker.functions[_FUNCTION] = kernel_function(painted, (("look", materials.coloured()),))
    return linker.functions, linker.linked().parameters


def _encode_srgb(light: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Linear light in sRGB."""
    colours: NDArray[np.uint8] = np.rint(255 * from_linear(light.clip(0.0, 1.0))).astype(np.uint8)
    return colours
