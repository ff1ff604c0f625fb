"""Material and orbit trap at a surface point.

The field's tree is compiled a second time, with every function returning (f, paint, tone). `paint` is the
material's number, 0 for none. `tone` is the smallest abs(w) of the orbit (Pickover's and Carlson's orbit
traps; Carlson 1999). The result is evaluated once per hit.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from ..formulas.material import material
from ..formulas.registry import Node
from ..kernel import source
from ..kernel.arguments import Arguments, arguments, read
from ..kernel.dialects import OF_FORMULAS, FieldDialect, folded, function, leading
from ..kernel.parsing import parse
from ..kernel.structure import Run, Subroutine
from .trace_syntax import KeepChild, KeepNearest

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
    """Return the orbit traps of the shapes of a tree.

    Parameters
    ----------
    root : Node
        Root of the formula tree.
    trap : str
        Trap of the shapes that are in no material.

    Returns
    -------
    dict of int to str
        Traps of the innermost materials, by the `id` of the shapes.
    """
    trap = root["trap"] if root.formula.name == material.name else trap
    below = (item for child in root.children for item in traps(child, trap).items())
    return dict(below) if root.children else {id(root): trap}


@dataclass
class TraceDialect(FieldDialect):
    """Dialect whose functions return (f, paint, tone).

    Attributes
    ----------
    materials : dict of int to int
        Paint number of each material node, by the node's `id`.
    traps : dict of int to str
        Orbit trap of each shape, by the node's `id`; see `traps`.
    prefix : str
        Prefix of the function names.
    """

    materials: dict[int, int] = field(default_factory=dict)
    traps: dict[int, str] = field(default_factory=dict)
    prefix: str = "T"

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
        passed = read(float(self.materials[id(node)]), paint, "P0")
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
        """Write the function of a material: its paint applies where the child has none.

        Parameters
        ----------
        name : str
            Function name.
        given : Arguments
            The paint of the material.
        child : Run
            Call of the child.

        Returns
        -------
        str
            Source text.
        """
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
        tree = KeepNearest(update).visit(source.specialised(given.function, fixed))
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
            lines += folded(run, k == 0, lambda call: [taken[0].format(call), *taken[1:]])
        return function(name, [*lines, "return f, paint, tone"])

    def domain_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> str:
        """Write the function of a domain operator: paint and tone of the child's lowest evaluation.

        See `FieldDialect.domain_operator`.
        """
        tree = source.specialised(given.function, dict(given.fixed))
        arguments = [a.arg for a in tree.args.args][4:]
        tree.args.args = [ast.arg(a) for a in ("x", "y", "z", "P", "P0")]
        tree = KeepChild(runs[0]).visit(tree)
        start = [f"{a} = {p}" for a, p in zip(arguments, given.passed, strict=True)]
        start += ["lowest = 0.0 * x + 1e30", "paint = 0.0 * x", "tone = 0.0 * x"]
        tree.body = [*(parse(line).body[0] for line in start), *tree.body]
        return self.linker.named(name, tree, given.function)
