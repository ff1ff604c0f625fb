"""A linked scene as the text of a CUDA module: one thread a point, every number of the kernel's float width.

Numba types a literal as float64 or int64, and arithmetic with float32 then happens in float64, which a GPU
does up to 64 times slower. So the module that it compiles says ``real(2.0)`` where the formula says ``2.0``.
"""

from __future__ import annotations

import ast

from ..formulas.vocabulary import NAMES
from .linker import Linked

WORDS = "fracslice.kernel.cuda_words"

POINTS = """
@kernel
def points(P, X, Y, Z, F):
    i = cuda.grid(1)
    if i < F.size:
        x = X[i]
        y = Y[i]
        z = Z[i]
        f = field(x, y, z, P)
        F[i] = where((x == x) & (y == y) & (z == z), f, x + y + z)
"""
"""Field values at points; a point with a NaN gives NaN."""

BRICKS = """
@kernel
def bricks(P, ox, oy, oz, h, corners, F):
    i = cuda.grid(1)
    b = i >> 9
    s = i & 511
    if b < F.shape[0]:
        x = real(whole(corners[b, 0] + (s >> 6))) * h + ox
        y = real(whole(corners[b, 1] + (s >> 3 & 7))) * h + oy
        z = real(whole(corners[b, 2] + (s & 7))) * h + oz
        F[b, s] = field(x, y, z, P)
"""
"""512 samples of each brick, at ``(ox, oy, oz) + h * (corner + offset)``."""


def module(linked: Linked, bits: int, loops: str) -> str:
    """The text of a Python module that Numba compiles for CUDA (and its simulator runs).

    loops: functions marked ``@kernel`` that may call ``field(x, y, z, P)``. In them numbers are typed by
    hand: ``real(0.5)``, ``whole(3)``. P is a tuple of numbers, which become constants of the launch.
    """
    words = [*sorted(NAMES), "device", "divide", f"float{bits} as real", "int32 as whole", "kernel"]
    header = f"from numba import cuda\nfrom {WORDS} import {', '.join(words)}\n"
    return "\n".join([header, typed(linked.source), loops])


def typed(source: str) -> str:
    """Functions in the words of the formulas, as device functions whose every number is ``real`` or
    ``whole``."""
    return ast.unparse(ast.fix_missing_locations(_Typed().visit(ast.parse(source)))) + "\n"


class _Typed(ast.NodeTransformer):
    """Literals and loop counters in arithmetic become ``real``, ends of ranges ``whole``, divisions
    ``divide``.

    Subscripts stay as they are.
    """

    def __init__(self) -> None:
        self.counters: set[str] = set()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        self.counters = {
            loop.target.id
            for loop in ast.walk(node)
            if isinstance(loop, ast.For) and isinstance(loop.target, ast.Name)
        }
        self.generic_visit(node)
        node.decorator_list = [ast.Name("device", ast.Load())]
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        number = isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
        return _call("real", node) if number else node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return _call("real", node) if node.id in self.counters and isinstance(node.ctx, ast.Load) else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        return _call("divide", node.left, node.right) if isinstance(node.op, ast.Div) else node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called == "range":
            node.args = [
                self.visit(end) if isinstance(end, ast.Call) else _call("whole", end) for end in node.args
            ]
            return node
        if called == "int":
            return _call("whole", *node.args)
        return self.generic_visit(node)


def _call(name: str, *args: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(args), [])
