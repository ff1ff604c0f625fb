"""Materials in a render kernel: colours, palettes and orbit traps at a surface point.

The field's tree is compiled a second time, with every function returning (f, paint, tone). `paint` is the
material's number, 0 for none. `tone` is the smallest abs(w) of the orbit (Pickover's and Carlson's orbit
traps; Carlson 1999). The result is evaluated once per hit.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..expr import functions
from ..expr.language import parse
from ..fields import source
from ..fields.linker import (
    OF_FORMULAS,
    FieldDialect,
    Linker,
    Run,
    Subroutine,
    fold_lines,
    function,
    leading,
    link_tree,
)
from ..fields.registry import Fixed, Node
from ..fields.source import Arguments, append_numbers, arguments
from ..formulas.material import material, stops
from .environments import load_picture
from .glow import glowing_bodies
from .units import shade
from .units.environment import triplanar
from .units.pixel import linear


class KeepNearest(ast.NodeTransformer):
    """Replace orbit marks by the update of a running value, and return it beside the field's."""

    def __init__(self, update: str) -> None:
        self.update = update

    def visit_Expr(self, node: ast.Expr) -> Any:
        if not source.is_mark(node):
            return node
        assert isinstance(node.value, ast.Call)
        r2, alive, x, y, z = (f"({ast.unparse(argument)})" for argument in node.value.args)
        value = self.update.format(r2=r2, x=x, y=y, z=z)
        return parse(f"nearest = where({alive}, {value}, nearest)").body[0]

    def visit_Return(self, node: ast.Return) -> Any:
        assert node.value is not None
        return parse(f"return {ast.unparse(node.value)}, nearest").body[0]


class KeepChild(ast.NodeTransformer):
    """Evaluate the child's triple before each statement that calls the child.

    The triple of lowest value is kept.
    """

    def __init__(self, child: Run) -> None:
        self.child = child

    def visit_Assign(self, node: ast.Assign) -> Any:
        return self.taken(node)

    def visit_Return(self, node: ast.Return) -> Any:
        lines = self.taken(node)
        value = ast.unparse(lines[-1].value)
        return [*lines[:-1], parse(f"return {value}, paint, tone").body[0]]

    def taken(self, node: Any) -> list[Any]:
        calls = [
            c
            for c in ast.walk(node)
            if isinstance(c, ast.Call) and isinstance(c.func, ast.Name) and c.func.id == "child"
        ]
        if not calls:
            return [node]
        point = ", ".join(map(ast.unparse, calls[0].args))
        text = ast.unparse(node).replace(ast.unparse(calls[0]), "inner")
        lines = [
            f"inner, p, t = {self.child.call(points=point)}",
            "paint, tone = where(inner < lowest, p, paint), where(inner < lowest, t, tone)",
            "lowest = minimum(lowest, inner)",
        ]
        return [statement for line in [*lines, text] for statement in self.parsed(line)]

    @staticmethod
    def parsed(line: str) -> list[Any]:
        # `ast.parse` accepts a return statement outside a function.
        return parse(line).body


def text_of(function: Callable[..., Any], lines: Sequence[str]) -> str:
    """Assemble the source of a function."""
    names = ", ".join(functions.parameters(function))
    return "\n    ".join([f"def {function.__name__}({names}):", *lines])


TRAP, NEAREST = "trap", "point"

_ORBIT = "where(nearest < 1e29, {}, 1.0)"
_SMALLEST = _ORBIT.format("sqrt(nearest)")
_TRAPS = {
    "point": ("1e30", "minimum(nearest, {r2})", _SMALLEST),
    "axes": (
        "1e30",
        "minimum(nearest, minimum({x} * {x} + minimum({y} * {y}, {z} * {z}), {y} * {y} + {z} * {z}))",
        _SMALLEST,
    ),
    "planes": ("1e30", "minimum(nearest, minimum({x} * {x}, minimum({y} * {y}, {z} * {z})))", _SMALLEST),
    "sphere": ("1e30", "minimum(nearest, absolute({r2} - 1.0))", _ORBIT.format("nearest")),
    "steps": ("0.0", "nearest + 0.0625", "nearest"),
    "direction": ("0.5", "0.5 + 0.15915494309189535 * atan2({y}, {x})", "nearest"),
}
"""Start and update of each trap's running value, and its position in the palette: 1 without an orbit."""


def traps(root: Node, trap: str = NEAREST) -> dict[int, str]:
    """Return the orbit traps of the shapes of a tree."""
    trap = root["trap"] if root.formula.name == material.name else trap
    below = (item for child in root.children for item in traps(child, trap).items())
    return dict(below) if root.children else {id(root): trap}


@dataclass
class TraceDialect(FieldDialect):
    """Dialect whose functions return (f, paint, tone)."""

    # paint number of each material node, by the node's `id`
    materials: dict[int, int] = field(default_factory=dict)
    # orbit trap of each shape, by the node's `id`; see `traps`
    traps: dict[int, str] = field(default_factory=dict)
    prefix: str = "T"  # prefix of the function names

    def kept(self, node: Node) -> Node:
        """Skip identity nodes, except materials; see `Dialect.kept`."""
        while node.is_identity and node.formula.name != material.name:
            node = node.children[0]
        return node

    def arguments(self, node: Node) -> Arguments:
        """Return the function and arguments of a node; a material passes its paint number.

        See `Dialect.arguments`.
        """
        if node.formula.name != material.name:
            given = arguments(node, leading(node))
            trap = self.traps.get(id(node), NEAREST)
            return given if trap == NEAREST else replace(given, fixed=(*given.fixed, (TRAP, trap)))
        paint: list[float] = []
        passed = append_numbers(float(self.materials[id(node)]), paint, "P0")
        return Arguments(node.function, (), (passed,), tuple(paint))

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Keep the order of the children: at equal distances the first child's paint is taken.

        See `Dialect.order`.
        """
        return range(len(parts))

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> str:
        """Write the function of a node; see `Dialect.write`."""
        if node.formula.name == material.name:
            return self.painted(name, given, runs[0])
        return super().write(name, node, given, runs)

    def painted(self, name: str, given: Arguments, child: Run) -> str:
        """Write the function of a material: its paint applies where the child has none."""
        return function(
            name,
            [
                f"f, paint, tone = {child.call()}",
                f"return f, where(paint > 0.5, paint, {given.passed[0]}), tone",
            ],
        )

    def shape(self, name: str, given: Arguments, _: Sequence[Run]) -> str:
        """Write the function of a shape: the field value and the orbit trap; see `FieldDialect.shape`."""
        fixed = dict(given.fixed)
        start, update, tone = _TRAPS[fixed.pop(TRAP, NEAREST)]
        tree = KeepNearest(update).visit(source.specialise(given.function, fixed))
        tree.body.insert(0, parse(f"nearest = 0.0 * x + {start}").body[0])
        called = f"{name}_of"
        self.linker.functions[called] = self.linker.named(called, tree, given.function)
        return function(
            name,
            [
                f"f, nearest = {called}({', '.join(['x', 'y', 'z', *given.passed])})",
                f"return f, 0.0 * x, {tone}",
            ],
        )

    def csg_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> str:
        """Write the function of a CSG operator: paint and tone of the child that determines the value.

        See `FieldDialect.csg_operator`.
        """
        called = self.linker.share(given.function, given.fixed, OF_FORMULAS)
        lines = [f"f, paint, tone = {runs[0].call()}"]
        if sum(run.count for run in runs) == 1:
            lines.append(f"f = {called}({', '.join(['f', *given.passed])})")
        taken = [
            "g, p, t = {}",
            f"a, f = f, {called}({', '.join(['f', 'g', *given.passed])})",
            "mine = absolute(absolute(f) - absolute(a)) <= absolute(absolute(f) - absolute(g))",
            "paint, tone = where(mine, paint, p), where(mine, tone, t)",
        ]
        for k, run in enumerate(runs):
            lines += fold_lines(run, k == 0, lambda call: [taken[0].format(call), *taken[1:]])
        return function(name, [*lines, "return f, paint, tone"])

    def domain_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> str:
        """Write the function of a domain operator: paint and tone of the child's lowest evaluation.

        See `FieldDialect.domain_operator`.
        """
        tree = source.specialise(given.function, dict(given.fixed))
        arguments = [a.arg for a in tree.args.args][4:]
        tree.args.args = [ast.arg(a) for a in ("x", "y", "z", "P", "P0")]
        tree = KeepChild(runs[0]).visit(tree)
        start = [f"{a} = {p}" for a, p in zip(arguments, given.passed, strict=True)]
        start += ["lowest = 0.0 * x + 1e30", "paint = 0.0 * x", "tone = 0.0 * x"]
        tree.body = [*(parse(line).body[0] for line in start), *tree.body]
        return self.linker.named(name, tree, given.function)


TEXELS = 1024 * 1024
"""Maximum number of pixels of a texture."""


def opaque_part(node: Node) -> Node | None:
    """Return a scene without the members of its unions that are transparent."""
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


@dataclass
class Look:
    """Materials of a scene, and the kernel lines that load the material at a hit.

    With one material, its numbers are read from P. With several, `paint` selects among them.
    """

    linker: Linker  # linker of the kernel
    root: Node  # root of the formula tree
    paths: bool = False  # true if rays also continue where a surface scatters light

    def __post_init__(self) -> None:
        self.nodes = [n for n in self.root.walk() if n.formula.name == material.name]
        covered = bool(self.nodes) and self.root is self.nodes[0] and len(self.nodes) == 1
        plain = material(self.root)
        self.all = self.nodes if covered else [plain, *self.nodes]
        self.paints = {id(n): self.all.index(n) if covered else k + 1 for k, n in enumerate(self.nodes)}
        self.palettes = any(len(stops(n)) > 3 or n["vary"] for n in self.all)
        self.textured = any(n["texture"] for n in self.all)
        self.varies = any(n["vary"] for n in self.all)
        self.coated = any(n["coat"] for n in self.all)
        self.glows = any(n["glow"] for n in self.all)
        self.bodies = glowing_bodies(self.root) if self.paths else []
        self.inside = any(n["clear"] for n in self.all)
        self.rough = any(n["roughness"] or n["vary"] for n in self.all)
        self.glossy = self.paths or self.coated or self.rough or any(n["metallic"] for n in self.all)
        self.bounces = self.inside or self.glossy or any(n["reflect"] for n in self.all)

    @property
    def facets(self) -> str:
        """Reflectance of microfacets; the colour is left open."""
        return "again{0} * tinted(half, k{0})" if self.rough else "tinted(half, k{0})"

    def lines(self) -> list[str]:
        """Return the lines that set cr, cg, cb, specular, shininess and the other properties in use."""
        lines = []
        if len(self.all) > 1 or self.palettes:
            lines += self.trap()
        lines += self.chosen([self.colour(k, n) for k, n in enumerate(self.all)], ("cr", "cg", "cb"))
        names = ["specular", "shininess"]
        names += ["glow"] * self.glows + ["reflect"] * self.bounces + ["clear", "index"] * self.inside
        names += ["roughness", "metallic"] * self.glossy + ["coat"] * self.coated
        for name in names:
            values = [[self.linker.argument(n[name])] for n in self.all]
            lines += self.chosen([([], v) for v in values], (name,))
        if self.varies:
            lines += self.varied()
        if self.inside:
            fading = [[self.linker.argument(a) for a in n["absorb"]] for n in self.all]
            lines += self.chosen([([], v) for v in fading], ("absorbr", "absorbg", "absorbb"))
        return lines

    def trap(self) -> list[str]:
        """Return the line that sets the material's number and the orbit trap."""
        dialect = TraceDialect(self.linker, materials=self.paints, traps=traps(self.root))
        return [f"_, paint, tone = {link_tree(self.linker, self.root, dialect)}"]

    def transparent(self) -> list[str]:
        """Return the lines of `units.intrinsics.transparent`."""
        part = transparent_part(self.root)
        assert part
        dialect = TraceDialect(self.linker, materials=self.paints, traps=traps(self.root))
        lines = [f"f, paint, tone = {link_tree(self.linker, part, dialect)}", "t = 0.0 * x"]
        values = [(*n["absorb"], n["clear"] * (1 - _head_on(n["index"]))) for n in self.all]
        options: list[tuple[list[str], list[str]]] = [
            ([], [self.linker.argument(v) for v in row]) for row in values
        ]
        return [*lines, *self.chosen(options, ("r", "g", "b", "kept")), "return f, r, g, b, kept"]

    def colour(self, k: int, node: Node) -> tuple[list[str], list[str]]:
        """Return the colour of a material.

        `k`: index of the material.
        """
        colours = linear(stops(node))
        lines, values = [], [f"p{k}{c}" for c in "rgb"]
        if len(colours) == 3:
            values = [self.linker.argument(c) for c in colours]
        else:
            count = Fixed(len(colours) // 3)
            self.linker.bind(f"palette{k}", shade.palette, {"stops": colours, "count": count})
            turns = f"turns{k} = {self.turns(node)}"
            lines = [turns, f"{', '.join(values)} = palette{k}(turns{k} - floor(turns{k}), P)"]
        if not node["texture"]:
            return lines, values
        picture = load_picture(node["texture"], TEXELS, node.fail)
        width, height = picture.size
        given = {"light": picture.light, "width": width, "height": height, "tile": node["tile"]}
        self.linker.bind(f"texture{k}", triplanar, given)
        seen = [f"q{k}{c}" for c in "rgb"]
        lines.append(f"{', '.join(seen)} = texture{k}(x, y, z, nx, ny, nz, P)")
        return lines, [f"{value} * {q}" for value, q in zip(values, seen, strict=True)]

    def turns(self, node: Node) -> str:
        """Expression of the position in a palette, before its whole part is removed."""
        return f"tone * {self.linker.argument(node['repeats'])} + {self.linker.argument(node['shift'])}"

    def varied(self) -> list[str]:
        """Return the lines that change the roughness along the palette."""
        self.linker.share(shade.varied)
        turns: list[tuple[list[str], list[str]]] = [
            ([], [self.turns(n), self.linker.argument(n["vary"])]) for n in self.all
        ]
        return [*self.chosen(turns, ("turn", "vary")), "roughness = varied(roughness, vary, turn)"]

    def chosen(self, options: list[tuple[list[str], list[str]]], names: tuple[str, ...]) -> list[str]:
        """Return the lines that set variables to the values of the material selected by `paint`."""
        lines = [line for before, _ in options for line in before]
        for i, name in enumerate(names):
            lines.append(f"{name} = {options[0][1][i]} + 0.0 * t")
            for k, (_, values) in enumerate(options[1:], 1):
                lines.append(f"{name} = where(paint > {k - 0.5}, {values[i]}, {name})")
        return lines
