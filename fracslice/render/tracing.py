"""A scene's second function: which material a point of the surface has, and how near its orbit came to the
origin.

The field's tree once more, with every function returning (f, paint, tone): paint is the number of a material,
0 for none; tone the smallest |w| of the orbit (Pickover's and Carlson's orbit traps; Carlson 1999). It is
called once per hit.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..formulas.registry import Fixed, Node
from ..kernel.linker import Linker, is_mark, specialised

TRACE = "trace"


@dataclass
class Tracer:
    """Writes the traced functions of a tree into a linker. materials: the paint of every material node, from
    1."""

    linker: Linker
    materials: dict[int, int]

    def node(self, node: Node) -> str:
        """Writes a node and all below it; returns its function's name."""
        if node.formula.name == "material":
            return self.painted(node)
        if node.is_identity:
            return self.node(node.children[0])
        children = [self.node(child) for child in node.children]
        fixed = {k: v.value for k, v in node.arguments.items() if isinstance(v, Fixed)}
        passed = [self.linker.argument(v) for v in node.arguments.values() if not isinstance(v, Fixed)]
        if node.formula.kind == "shape":
            return self.shape(node.function, fixed, passed)
        if node.formula.kind == "blend":
            return self.blend(node.function, fixed, passed, children)
        return self.warp(node.function, fixed, passed, children[0])

    def write(self, lines: list[str]) -> str:
        name = f"{TRACE}{len(self.linker.functions)}"
        self.linker.functions.append("\n    ".join([f"def {name}(x, y, z, P):", *lines]))
        return name

    def painted(self, node: Node) -> str:
        child, paint = self.node(node.children[0]), self.materials[id(node)]
        return self.write(
            [f"f, paint, tone = {child}(x, y, z, P)", f"return f, where(paint > 0.5, paint, {paint}.0), tone"]
        )

    def shape(self, function: Callable[..., Any], fixed: dict[str, Any], passed: list[str]) -> str:
        tree = specialised(function, fixed)
        tree.name = f"{TRACE}{len(self.linker.functions)}_{tree.name}"
        tree = _KeepsNearest().visit(tree)
        tree.body.insert(0, ast.parse("nearest = 0.0 * x + 1e30").body[0])
        self.linker.helpers(tree, function)
        self.linker.functions.append(ast.unparse(ast.fix_missing_locations(tree)))
        called = f"{tree.name}({', '.join(['x', 'y', 'z', *passed])})"
        return self.write([f"f, nearest = {called}", "return f, 0.0 * x, sqrt(minimum(nearest, 1.0))"])

    def blend(
        self, function: Callable[..., Any], fixed: dict[str, Any], passed: list[str], children: list[str]
    ) -> str:
        called = self.linker.share(function, fixed)
        lines = [f"f, paint, tone = {children[0]}(x, y, z, P)"]
        if len(children) == 1:
            lines.append(f"f = {called}({', '.join(['f', *passed])})")
        for child in children[1:]:
            lines += [
                f"g, p, t = {child}(x, y, z, P)",
                f"a, f = f, {called}({', '.join(['f', 'g', *passed])})",
                "mine = absolute(absolute(f) - absolute(a)) <= absolute(absolute(f) - absolute(g))",
                "paint, tone = where(mine, paint, p), where(mine, tone, t)",
            ]
        return self.write([*lines, "return f, paint, tone"])

    def warp(self, function: Callable[..., Any], fixed: dict[str, Any], passed: list[str], child: str) -> str:
        tree = specialised(function, fixed)
        arguments = [a.arg for a in tree.args.args][4:]
        tree.name = f"{TRACE}{len(self.linker.functions)}"
        tree.args.args = [ast.arg(a) for a in ("x", "y", "z", "P")]
        tree = _KeepsChild(child).visit(tree)
        start = [f"{a} = {p}" for a, p in zip(arguments, passed, strict=True)]
        start += ["lowest = 0.0 * x + 1e30", "paint = 0.0 * x", "tone = 0.0 * x"]
        tree.body = [*(ast.parse(line).body[0] for line in start), *tree.body]
        self.linker.helpers(tree, function)
        self.linker.functions.append(ast.unparse(ast.fix_missing_locations(tree)))
        return str(tree.name)


class _KeepsNearest(ast.NodeTransformer):
    """Marks of the orbit become the least r2 so far, which is returned beside the value."""

    def visit_Expr(self, node: ast.Expr) -> Any:
        if not is_mark(node):
            return node
        assert isinstance(node.value, ast.Call)
        r2, alive = map(ast.unparse, node.value.args)
        return ast.parse(f"nearest = where({alive}, minimum(nearest, {r2}), nearest)").body[0]

    def visit_Return(self, node: ast.Return) -> Any:
        assert node.value is not None
        return ast.parse(f"return {ast.unparse(node.value)}, nearest").body[0]


class _KeepsChild(ast.NodeTransformer):
    """Before every statement that looks at the child, its triple is taken; the child with the lowest value
    stays."""

    def __init__(self, name: str) -> None:
        self.name = name

    def visit_Assign(self, node: ast.Assign) -> Any:
        return self.taken(node)

    def visit_Return(self, node: ast.Return) -> Any:
        lines = self.taken(node)
        value = ast.unparse(lines[-1].value)
        return [*lines[:-1], ast.parse(f"return {value}, paint, tone").body[0]]

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
            f"inner, p, t = {self.name}({point}, P)",
            "paint, tone = where(inner < lowest, p, paint), where(inner < lowest, t, tone)",
            "lowest = minimum(lowest, inner)",
        ]
        return [statement for line in [*lines, text] for statement in self.parsed(line)]

    @staticmethod
    def parsed(line: str) -> list[Any]:
        # A return outside a function is no error to the parser.
        return ast.parse(line).body
