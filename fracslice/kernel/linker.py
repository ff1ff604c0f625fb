"""A whole scene as one self-contained Python module: only what the scene uses, its numbers as arguments.

Every node becomes one function of ``x, y, z, P``. Shapes and blends are called with their arguments taken
from the parameter array P; `Fixed` arguments are written into a copy of the function, where Python drops the
dead branches and loops over fixed tuples are unrolled. A warp's copy calls its child by name. Identities are
left out.

The text is the same for scenes that differ in numbers only, so editing a value compiles nothing.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from types import FunctionType
from typing import Any

import numpy as np

from ..errors import KernelError
from ..formulas import vocabulary
from ..formulas.parameters import AUTO
from ..formulas.registry import Fixed, Node

FIELD = "field"


@dataclass(frozen=True)
class Linked:
    """A scene as source text, with the signed field ``field(x, y, z, P)``, and its parameters P."""

    source: str
    parameters: np.ndarray = field(compare=False)

    @property
    def digest(self) -> str:
        return hashlib.sha256(self.source.encode()).hexdigest()[:20]


def link(root: Node) -> Linked:
    """Links a scene tree. Raises `KernelError` where a depth is still "auto"."""
    linker = Linker()
    top = linker.node(root)
    linker.functions.append(f"def {FIELD}(x, y, z, P):\n    return {top}(x, y, z, P)")
    return Linked(linker.text(), np.array(linker.parameters or [0.0], dtype=np.float64))


@dataclass
class Linker:
    """Writes functions and collects parameters; `given` are names that the text will have from elsewhere."""

    given: frozenset[str] = frozenset()
    parameters: list[float] = field(default_factory=list)
    functions: list[str] = field(default_factory=list)
    shared: dict[str, str] = field(default_factory=dict)

    def node(self, node: Node) -> str:
        """Writes the functions of a node and all below it; returns the name of its own."""
        if AUTO in [v for v in node.values.values() if isinstance(v, str)]:
            raise KernelError(
                f"<{node.formula.name}>: the depth is still auto; resolve it for a voxel size first"
            )
        if node.is_identity:
            return self.node(node.children[0])
        children = [self.node(child) for child in node.children]
        if node.formula.kind != "warp" and len(children) == 1 and node.formula.children[1] is None:
            return children[0]
        fixed = {k: v.value for k, v in node.arguments.items() if isinstance(v, Fixed)}
        passed = [self.argument(v) for v in node.arguments.values() if not isinstance(v, Fixed)]
        name = f"n{len(self.functions)}"
        write = {"shape": self.shape, "blend": self.blend, "warp": self.warp}[node.formula.kind]
        self.functions.append(write(name, node.function, fixed, passed, children))
        return name

    def argument(self, value: Any) -> str:
        """Appends a number or a tuple of numbers to P; returns the expression that reads it back."""
        if isinstance(value, tuple):
            return f"({', '.join(self.argument(v) for v in value)},)"
        self.parameters.append(float(value))
        place = f"P[{len(self.parameters) - 1}]"
        return f"int({place})" if isinstance(value, int) else place

    def shape(
        self, name: str, function: Callable[..., Any], fixed: dict[str, Any], passed: list[str], _: list[str]
    ) -> str:
        called = self.share(function, fixed)
        return f"def {name}(x, y, z, P):\n    return {called}({', '.join(['x', 'y', 'z', *passed])})"

    def blend(
        self,
        name: str,
        function: Callable[..., Any],
        fixed: dict[str, Any],
        passed: list[str],
        children: list[str],
    ) -> str:
        called = self.share(function, fixed)
        lines = [f"def {name}(x, y, z, P):", f"    f = {children[0]}(x, y, z, P)"]
        if len(children) == 1:
            lines.append(f"    f = {called}({', '.join(['f', *passed])})")
        for child in children[1:]:
            lines.append(f"    f = {called}({', '.join(['f', f'{child}(x, y, z, P)', *passed])})")
        return "\n".join([*lines, "    return f"])

    def warp(
        self,
        name: str,
        function: Callable[..., Any],
        fixed: dict[str, Any],
        passed: list[str],
        children: list[str],
    ) -> str:
        tree = specialised(function, fixed)
        arguments = [a.arg for a in tree.args.args][4:]
        tree.name = name
        tree.args.args = [ast.arg(a) for a in ("x", "y", "z", "P")]
        tree = _CallsChild(children[0]).visit(tree)
        taken = [ast.parse(f"{a} = {p}").body[0] for a, p in zip(arguments, passed, strict=True)]
        tree.body = [*taken, *tree.body]
        self.helpers(tree, function)
        return ast.unparse(ast.fix_missing_locations(tree))

    def share(self, function: Callable[..., Any], fixed: dict[str, Any]) -> str:
        """Writes a copy of the function with its fixed arguments filled in, once; returns its name."""
        suffix = "".join(f"_{k}_{v}" for k, v in sorted(fixed.items()))
        name = function.__name__ + "".join(c if c.isalnum() else "_" for c in suffix)
        if name not in self.shared:
            text, needed = _copied(function, tuple(fixed.items()), name, self.given)
            for helper in needed:
                self.share(helper, {})
            self.shared[name] = text
        return name

    def bind(self, name: str, function: Callable[..., Any], values: dict[str, Any]) -> None:
        """Writes ``name(rest..., P)``: the function with `values` taken from P (or fixed), the rest of its
        arguments open.

        A function that has an argument P of its own is passed it.
        """
        fixed = {k: v.value for k, v in values.items() if isinstance(v, Fixed)}
        called = self.share(function, fixed)
        arguments = [a for a in inspect.signature(function).parameters if a not in fixed]
        passed = [self.argument(values[a]) if a in values else a for a in arguments]
        rest = [a for a in arguments if a not in values and a != "P"]
        self.functions.append(
            f"def {name}({', '.join([*rest, 'P'])}):\n    return {called}({', '.join(passed)})"
        )

    def text(self) -> str:
        """All that was written, callees first."""
        return "\n\n\n".join([*self.shared.values(), *self.functions]) + "\n"

    def helpers(self, tree: ast.FunctionDef, function: Callable[..., Any]) -> None:
        """Writes the functions and fills in the numbers that a function takes from its module."""
        for helper in _filled(tree, function, self.given):
            self.share(helper, {})


def _filled(
    tree: ast.FunctionDef, function: Callable[..., Any], given: frozenset[str]
) -> list[Callable[..., Any]]:
    """Fills in the numbers that a function takes from its module; returns the functions it takes from
    there."""
    scope = function.__globals__
    names = [n for n in ast.walk(tree) if isinstance(n, ast.Name)]
    used = {n.id for n in names if isinstance(n.ctx, ast.Load)}
    used -= {n.id for n in names if isinstance(n.ctx, ast.Store)} | vocabulary.NAMES | given
    needed = []
    for name in sorted(used & set(scope)):
        if isinstance(scope[name], FunctionType):
            needed.append(scope[name])
        elif isinstance(scope[name], (int, float)):
            _Substitute({name: scope[name]}).visit(tree)
    return needed


@lru_cache(maxsize=1024)
def _copied(
    function: Callable[..., Any], fixed: tuple[tuple[str, Any], ...], name: str, given: frozenset[str]
) -> tuple[str, list[Callable[..., Any]]]:
    """The text of a function's copy under a name, and the functions it needs. A scene is linked anew for
    every camera, and this is nine tenths of the time."""
    tree = _Forget().visit(specialised(function, dict(fixed)))
    tree.name = name
    needed = _filled(tree, function, given)
    return ast.unparse(ast.fix_missing_locations(tree)), needed


@lru_cache(maxsize=256)
def _text(function: Callable[..., Any]) -> str:
    return textwrap.dedent(inspect.getsource(function))


def specialised(function: Callable[..., Any], fixed: dict[str, Any]) -> ast.FunctionDef:
    """The function's tree without decorators, docstring and hints, its fixed arguments replaced by their
    values.
    """
    tree = ast.parse(_text(function)).body[0]
    assert isinstance(tree, ast.FunctionDef)
    tree.decorator_list, tree.returns = [], None
    if ast.get_docstring(tree) is not None:
        tree.body = tree.body[1:]
    tree.args.args = [ast.arg(a.arg) for a in tree.args.args if a.arg not in fixed]
    pruned: ast.FunctionDef = _Prune().visit(_Substitute(fixed).visit(tree))
    return pruned


class _Substitute(ast.NodeTransformer):
    """Names replaced by constants; loops over a constant tuple unrolled."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.values = values

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if isinstance(node.ctx, ast.Load) and node.id in self.values:
            return ast.Constant(self.values[node.id])
        return node

    def visit_For(self, node: ast.For) -> Any:
        name = node.iter.id if isinstance(node.iter, ast.Name) else None
        values = self.values.get(name) if name else None
        if not isinstance(values, tuple):
            return self.generic_visit(node)
        assert isinstance(node.target, ast.Name)
        unrolled: list[ast.stmt] = []
        for value in values:
            inner = _Substitute({**self.values, node.target.id: value})
            unrolled += [inner.visit(ast.parse(ast.unparse(statement)).body[0]) for statement in node.body]
        return unrolled


class _Prune(ast.NodeTransformer):
    """Branches and choices on a constant reduced to the one that is taken."""

    def visit_If(self, node: ast.If) -> Any:
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node


class _Forget(ast.NodeTransformer):
    """Marks of orbits left out: a field does not look at them."""

    def visit_Expr(self, node: ast.Expr) -> Any:
        return None if is_mark(node) else node


def is_mark(node: ast.AST) -> bool:
    """True of the statement ``orbit(...)``."""
    call = node.value if isinstance(node, ast.Expr) else None
    return isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "orbit"


class _CallsChild(ast.NodeTransformer):
    """``child(a, b, c)`` becomes a call of the child's function, with P."""

    def __init__(self, name: str) -> None:
        self.name = name

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.func, ast.Name) and node.func.id == "child":
            node.func.id = self.name
            node.args.append(ast.Name("P", ast.Load()))
        return node
