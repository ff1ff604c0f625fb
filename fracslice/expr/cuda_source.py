"""Source text of the CUDA module of a linked scene: one thread per point, numbers of the kernel's float
width. A loop over lanes becomes a kernel whose threads each do the work of one lane.

Numba types a literal as float64 or int64. Arithmetic with float32 then happens in float64, which is up to 64
times slower on a GPU. The text therefore has ``real(2.0)`` where the formula has ``2.0``.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Sequence
from typing import Any

from ..errors import KernelError
from .language import CALLED, Linked, parse
from .loop_linker import link_loops
from .loops import Loop
from .vocabulary import NAMES

INTRINSICS = "fracslice.expr.cuda_intrinsics"
"""Module that the text imports its intrinsics from."""


def module(linked: Linked, bits: int, loops: Sequence[Loop]) -> str:
    """Write the text of a Python module that Numba compiles for CUDA and its simulator runs."""
    names = [
        *sorted(NAMES),
        CALLED,
        "device",
        "divide",
        "gather",
        f"float{bits} as real",
        "int32 as whole",
        "kernel",
        "thread",
        "together",
    ]
    header = f"from {INTRINSICS} import {', '.join(names)}\n"
    over_lanes = {loop.name for loop in loops if loop.arguments}
    trees = [
        _thread_kernel(tree) if name in over_lanes else tree
        for name, tree in ((name, function.tree) for name, function in link_loops(tuple(loops)).items())
    ]
    units = [ast.unparse(tree) for tree in trees if not tree.decorator_list or tree.name in over_lanes]
    by_hand = [ast.unparse(tree) for tree in trees if tree.decorator_list and tree.name not in over_lanes]
    return "\n\n".join([header, typed("\n\n".join([linked.source, *units])), *by_hand]) + "\n"


def _thread_kernel(tree: ast.FunctionDef) -> ast.FunctionDef:
    """Kernel of a loop over lanes: its body once, for the lane of the thread."""
    tree = copy.deepcopy(tree)  # the linker keeps it
    match tree.body:
        case [*before, ast.For(ast.Name(i), ast.Call(ast.Name("range"), [_, end, _]), body)]:
            (first,) = parse(f"{i} = thread()").body
            lanes: list[ast.stmt] = [_Lane().visit(statement) for statement in body]
            tree.body = [*before, first, ast.If(ast.Compare(ast.Name(i), [ast.Lt()], [end]), lanes, [])]
            tree.decorator_list = [ast.Name("kernel", ast.Load())]
            return tree
    raise KernelError(f"loop {tree.name} has no loop over lanes at its end")


class _Lane(ast.NodeTransformer):
    """Writes access to lanes as access to elements."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        match self.generic_visit(node):
            case ast.Call(ast.Name("load"), [array, i]):
                return ast.Subscript(array, i, ast.Load())
            case ast.Call() as call:
                return call
        raise AssertionError(node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        match self.generic_visit(node):
            case ast.Expr(ast.Call(ast.Name("store"), [array, i, value])):
                return ast.Assign([ast.Subscript(array, i, ast.Store())], value, lineno=node.lineno)
            case ast.Expr() as expression:
                return expression
        raise AssertionError(node)


def typed(source: str) -> str:
    """Rewrite formulas as device functions whose numbers are all ``real`` or ``whole``."""
    tree = parse(source)
    return ast.unparse(ast.fix_missing_locations(_Typed(tree).visit(tree))) + "\n"


def _uses(name: str, body: Sequence[ast.stmt]) -> list[ast.Name]:
    """All uses of a name in statements."""
    nodes = (node for statement in body for node in ast.walk(statement))
    return [node for node in nodes if isinstance(node, ast.Name) and node.id == name]


class _Typed(ast.NodeTransformer):
    """Converts integers to ``real`` where they meet a real; among themselves, and in subscripts, they stay.

    Integers are literals without a point, loop counters, and all names of a function that shifts bits. A
    product with zero, by which a formula broadcasts a number to its points, becomes zero: a thread has one
    point.
    """

    def __init__(self, tree: ast.Module) -> None:
        functions = [f for f in tree.body if isinstance(f, ast.FunctionDef)]
        self.shifting = {f.name for f in functions if any(isinstance(n, _SHIFTS) for n in ast.walk(f))}
        self.counters: set[str] = set()
        self.shifts = False

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        loops = [n for n in ast.walk(node) if isinstance(n, ast.For)]
        self.counters = {loop.target.id for loop in loops if isinstance(loop.target, ast.Name)} | {"P0"}
        self.shifts = node.name in self.shifting
        self.generic_visit(node)
        node.decorator_list = node.decorator_list or [ast.Name("device", ast.Load())]
        return node

    def whole(self, node: ast.expr) -> bool:
        """True if an expression is an integer."""
        match node:
            case ast.Constant(value):
                return isinstance(value, int) and not isinstance(value, bool)
            case ast.Name(name):
                return self.shifts or name in self.counters
            case ast.UnaryOp(ast.USub(), value):
                return self.whole(value)
            case ast.BinOp(left, op, right):
                return self.whole(left) and self.whole(right) and not isinstance(op, ast.Div)
            case ast.Call(ast.Name(name)):
                return name in self.shifting
        return False

    def real(self, node: ast.expr) -> Any:
        """Visit an expression in a place that requires a real."""
        return _call("real", node) if self.whole(node) else self.visit(node)

    def passed(self, node: ast.expr) -> Any:
        """Visit an argument: a number or a tuple of numbers."""
        if isinstance(node, ast.Tuple):
            return ast.Tuple([self.passed(e) for e in node.elts], ast.Load())
        return self.real(node)

    def operand(self, node: ast.BinOp, side: ast.expr) -> Any:
        """Visit an operand: in arithmetic, a comparison is 1 or 0."""
        mask = isinstance(side, ast.Compare) and isinstance(node.op, (ast.Add, ast.Sub, ast.Mult))
        return _call("real", self.visit(side)) if mask else self.real(side)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return _call("real", node) if isinstance(node.value, float) else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        if isinstance(node.value, ast.Tuple):
            node.value = self.given(node.value)
        return node

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        op = ast.Not() if isinstance(node.op, ast.Invert) else node.op
        return ast.UnaryOp(op, self.visit(node.operand))

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        if self.whole(node):
            return node
        left, right = self.operand(node, node.left), self.operand(node, node.right)
        match node:
            case ast.BinOp(ast.Constant(0.0), ast.Mult()):
                return _call("real", node.left)
            case ast.BinOp(op=ast.Div()):
                return _call("divide", left, right)
        return ast.BinOp(left, node.op, right)

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        if not all(map(self.whole, [node.left, *node.comparators])):
            node.left, node.comparators = self.real(node.left), [self.real(c) for c in node.comparators]
        return node

    def visit_For(self, node: ast.For) -> Any:
        """Rewrite as a loop over a 32-bit counter, which no statement of the loop can change.

        Numba's own iterator costs several instructions per iteration.
        """
        match node:
            case ast.For(ast.Name(name), ast.Call(ast.Name("range"), [end])):
                uses = [type(n.ctx) for n in _uses(name, node.body)]
                changed = ast.Store in uses
                i = f"{name}_count" if changed else name
                first, after = parse(f"{i} = whole(0)\n{i} = whole({i} + 1)").body
                end = self.visit(end) if isinstance(end, ast.Call) else _call("whole", end)
                body = [part for s in node.body for part in _listed(self.visit(s))]
                if changed and ast.Load in uses:
                    body = [*parse(f"{name} = {i}").body, *body]
                return [first, ast.While(ast.Compare(ast.Name(i), [ast.Lt()], [end]), [*body, after], [])]
        raise KernelError(f"a formula cannot be compiled: a loop over {ast.unparse(node.iter)}")

    def visit_Call(self, node: ast.Call) -> ast.AST:
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called == "int":
            return _call("whole", *node.args)
        if called not in self.shifting:
            places = after_parameters(node.args)
            node.args = [*map(self.passed, node.args[: len(node.args) - len(places)]), *places]
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        node.value = self.given(node.value)
        return node

    def visit_Return(self, node: ast.Return) -> ast.AST:
        node.value = self.given(node.value) if node.value else None
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        return ast.IfExp(self.visit(node.test), self.given(node.body), self.given(node.orelse))

    def given(self, node: ast.expr) -> ast.expr:
        """Visit an expression that becomes the value of a name or a function."""
        if isinstance(node, ast.Tuple):
            return ast.Tuple([self.given(e) for e in node.elts], ast.Load())
        visited: ast.expr = self.visit(node) if self.shifts else self.real(node)
        return visited


def _listed(visited: Any) -> list[ast.stmt]:
    return visited if isinstance(visited, list) else [visited]


def after_parameters(arguments: list[ast.expr]) -> list[ast.expr]:
    """Return the arguments of a call after P: integer offsets into P."""
    names = [a.id if isinstance(a, ast.Name) else "" for a in arguments]
    return arguments[names.index("P") + 1 :] if "P" in names[:-1] else []


_SHIFTS = (ast.LShift, ast.RShift, ast.BitXor)


def _call(name: str, *args: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(args), [])
