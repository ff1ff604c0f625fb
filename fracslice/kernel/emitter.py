"""Translation of a linked scene's text to LLVM IR, function by function, in one pass over its syntax tree.

The text is structured: names are assigned, and branches and loops end where they began. Every name therefore
has one value at every place, and a value that differs where two paths join becomes a phi there (Braun et al.
2013, "Simple and Efficient Construction of Static Single Assignment Form", has the general case). A function
is emitted once for each combination of argument kinds.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

from llvmlite import ir

from ..errors import KernelError
from .expressions import Expressions
from .kinds import Kind, as_kind, joined, kind_of, made_of, parts_of, types_of
from .parsing import parse_expression
from .scalars import WHOLE, MismatchError, number
from .syntax import assigned_names
from .values import Lanes, Value

Names = dict[str, Value]


@dataclass
class Emitter:
    """LLVM module under construction.

    Attributes
    ----------
    lanes
        Layout of the lanes.
    functions
        Syntax trees of the text's functions.
    called
        Names of the functions that are not inlined.
    files
        Files that contain the lines of loops and of the functions they call.
    module
        LLVM module.
    made
        Functions emitted so far.
    """

    lanes: Lanes
    functions: Mapping[str, ast.FunctionDef]
    called: frozenset[str]
    files: Mapping[str, str]
    module: ir.Module = field(default_factory=ir.Module)
    made: dict[tuple[str, str], tuple[ir.Function, Kind]] = field(default_factory=dict)

    def function(self, name: str, kinds: tuple[Kind, ...]) -> tuple[ir.Function, Kind]:
        """Emit a function of the text for arguments of given kinds; return it and the kind of its result."""
        key = name, repr(kinds)
        if key not in self.made:
            body = Body(self, name)
            function = body.written(kinds, f"{name}.{len(self.made)}")
            function.linkage = "internal"
            function.attributes.add("noinline" if name in self.called else "alwaysinline")
            self.made[key] = function, body.returned
        return self.made[key]

    def entry(self, name: str, kinds: tuple[Kind, ...]) -> None:
        """Emit an exported function under its own name."""
        Body(self, name).written(kinds, name)


class _WiderError(Exception):
    """Names have wider kinds at the end of a loop than at its beginning."""

    def __init__(self, kinds: dict[str, Kind]) -> None:
        self.kinds = kinds


class Body(Expressions):
    """Body of one function for one combination of argument kinds."""

    def __init__(self, emitter: Emitter, name: str) -> None:
        self.emitter, self.lanes = emitter, emitter.lanes
        self.name, self.tree = name, emitter.functions[name]
        self.returned: Kind = ()
        self.returns: list[tuple[Any, Value]] = []
        self.exits: list[list[tuple[Any, Names]]] = []  # of the loops around: a block and the names there
        self.blocks: dict[str, Any] = {}

    def written(self, kinds: Sequence[Kind], name: str) -> ir.Function:
        """Emit the function under a name of the module."""
        types = [t for kind in kinds for t in types_of(kind, self.lanes)]
        function = ir.Function(self.emitter.module, ir.FunctionType(ir.VoidType(), types), name)
        function.attributes.add("nounwind")
        self.builder = ir.IRBuilder(function.append_basic_block())
        given = made_of(tuple(kinds), function.args, self.lanes, self.builder)
        width = {"WIDTH": ir.Constant(WHOLE, self.lanes.width)}
        self.names: Names = width | dict(zip((a.arg for a in self.tree.args.args), given, strict=True))
        if self.statements(self.tree.body):
            self.builder.ret_void()
            if self.returns:
                raise self.fail(self.tree.body[-1], "not every way through the function returns a value")
        elif self.returns:
            self.finish(function, types)
        return function

    def finish(self, function: ir.Function, types: list[ir.Type]) -> None:
        """Emit the return instructions, now that their kind is known, and set the function's type."""
        self.returned = reduce(joined, (kind_of(value) for _, value in self.returns))
        result = ir.LiteralStructType(types_of(self.returned, self.lanes))
        for block, value in self.returns:
            self.builder.position_at_end(block)
            whole = ir.Constant(result, ir.Undefined)
            for k, part in enumerate(parts_of(as_kind(value, self.returned, self.lanes, self.builder))):
                whole = self.builder.insert_value(whole, part, k)
            self.builder.ret(whole)
        function.ftype = ir.FunctionType(result, types)
        function.type = function.ftype.as_pointer()
        function.return_value.type = result

    def fail(self, node: ast.AST, message: str) -> KernelError:
        """Return an error with the place of a node."""
        line, file = ast.unparse(node).splitlines()[0], self.emitter.files.get(self.name)
        name = self.name.removeprefix("f_").removeprefix("l_")
        where = f"{file}:{getattr(node, 'lineno', 1)}: loop" if file else "formula"
        return KernelError(f"{where} {name}: {line!r} cannot be compiled: {message}")

    # --- statements: each returns True if the next statement is reachable ---
    def statements(self, body: Sequence[ast.stmt]) -> bool:
        """Emit statements; return True if the next statement is reachable."""
        for statement in body:
            try:
                reached = self.statement(statement)
            except MismatchError as error:
                raise self.fail(statement, str(error)) from None
            if not reached:
                return False
        return True

    def statement(self, node: ast.stmt) -> bool:
        """Emit a statement; return True if the next one is reachable."""
        match node:
            case ast.Assign([target], value):
                self.assign(target, self.value(value))
            case ast.AugAssign(target, op, value):
                before = self.value(parse_expression(ast.unparse(target)))
                self.assign(target, self.binary(op, before, self.value(value)))
            case ast.Expr(value):
                self.value(value)
            case ast.Return(value):
                given = self.value(value) if value else ()
                self.returns.append((self.builder.block, given))
                return False
            case ast.Break():
                self.exits[-1].append((self.builder.block, dict(self.names)))
                return False
            case ast.If(test, body, orelse):
                return self.branch(self.condition(test), body, orelse)
            case ast.While(ast.Constant(True)):
                return self.loop(node, (), lambda: None)
            case ast.While(test):
                return self.loop(node, (), lambda: self.condition(test))
            case ast.For(ast.Name(counter), ast.Call(ast.Name("range"), limits), body):
                ends = [number(self.builder, self.value(v), WHOLE) for v in limits]
                return self.counted(node, counter, ends)
            case ast.Pass():
                pass
            case _:
                raise MismatchError("it is not in the language")
        return True

    def assign(self, target: ast.expr, value: Value) -> None:
        """Emit an assignment."""
        match target:
            case ast.Name(name):
                self.names[name], self.blocks[name] = value, self.builder.block
            case ast.Tuple(parts):
                if not isinstance(value, tuple) or len(value) != len(parts):
                    raise MismatchError(f"{len(parts)} values are expected")
                for part, one in zip(parts, value, strict=True):
                    self.assign(part, one)
            case ast.Subscript(place, index):
                address = self.address(self.value(place), self.value(index))
                self.builder.store(number(self.builder, value, address.type.pointee), address)
            case _:
                raise MismatchError("a name is expected to assign to")

    def branch(self, test: Any, body: Sequence[ast.stmt], orelse: Sequence[ast.stmt]) -> bool:
        """Emit an ``if`` statement; return True if the next statement is reachable."""
        names, ends = dict(self.names), []
        blocks = [self.builder.append_basic_block() for _ in range(2)]
        self.builder.cbranch(test, *blocks)
        for block, part in zip(blocks, (body, orelse), strict=True):
            self.builder.position_at_end(block)
            self.names = dict(names)
            if self.statements(part):
                ends.append((self.builder.block, self.names))
        return self.joined(ends)

    def joined(self, ends: Sequence[tuple[Any, Names]]) -> bool:
        """Join blocks and continue with the names that all of them have; return False without blocks."""
        if not ends:
            return False
        first, *others = (names for _, names in ends)
        common = [name for name in first if all(name in names for names in others)]
        same = {name: first[name] for name in common if all(n[name] is first[name] for n in others)}
        differ = [name for name in common if name not in same]
        kinds = {name: reduce(joined, (kind_of(names[name]) for _, names in ends)) for name in differ}
        into, rows = self.builder.append_basic_block(), []
        for block, names in ends:
            self.builder.position_at_end(block)
            parts = {n: parts_of(as_kind(names[n], kinds[n], self.lanes, self.builder)) for n in differ}
            rows.append((block, parts))
            self.builder.branch(into)
        self.builder.position_at_end(into)
        merged = {n: self.phis(kinds[n], [(block, parts[n]) for block, parts in rows]) for n in differ}
        self.names = same | merged
        return True

    def counted(self, node: ast.For, counter: str, limits: Sequence[Any]) -> bool:
        """Emit a loop over a range with a positive step. After the loop its counter has no value."""
        zero, one = ir.Constant(WHOLE, 0), ir.Constant(WHOLE, 1)
        first, end, step = [zero, *limits, one] if len(limits) == 1 else [*limits, one][:3]
        place = f"{counter} of {node.lineno}"
        self.names[place] = first

        def test() -> Any:
            here = self.names[counter] = self.names[place]
            inside = self.builder.icmp_signed("<", here, end)
            self.names[place] = self.builder.add(here, step)
            return inside

        return self.loop(node, (place, counter), test)

    def loop(self, node: ast.For | ast.While, own: tuple[str, ...], test: Callable[[], Any]) -> bool:
        """Emit a loop, again if names turn out to be of wider kinds than at its beginning."""
        function, start = self.builder.function, self.builder.block
        names, blocks, size = dict(self.names), len(function.blocks), len(start.instructions)
        returns, depth = len(self.returns), len(self.exits)
        changed = assigned_names(node.body) | set(own)
        kinds: dict[str, Kind] = {}
        while True:
            try:
                return self.looped(node.body, test, sorted(changed & names.keys()), own, kinds)
            except _WiderError as wider:
                kinds = wider.kinds
            del (
                function.blocks[blocks:],
                start.instructions[size:],
                self.returns[returns:],
                self.exits[depth:],
            )
            start.terminator = None
            self.builder.position_at_end(start)
            self.names = dict(names)

    def looped(
        self,
        body: Sequence[ast.stmt],
        test: Callable[[], Any],
        changed: Sequence[str],
        own: tuple[str, ...],
        kinds: dict[str, Kind],
    ) -> bool:
        """Emit a loop once, with given kinds for some names; raise `_WiderError` if others are needed."""
        for name, kind in kinds.items():
            self.names[name] = as_kind(self.names[name], kind, self.lanes, self.builder)
        start, head = self.builder.block, self.builder.append_basic_block()
        before = {name: self.names[name] for name in changed}
        self.builder.branch(head)
        self.builder.position_at_end(head)
        rows = {n: [(start, parts_of(value))] for n, value in before.items()}
        phis = {n: [self.builder.phi(p.type) for p in rows[n][0][1]] for n in changed}
        for name in changed:
            self.names[name] = made_of(kind_of(before[name]), phis[name], self.lanes, self.builder)
        self.exits.append([])
        inside, more = self.builder.append_basic_block(), test()
        if more is None:
            self.builder.branch(inside)
        else:
            out = self.builder.append_basic_block()
            self.exits[-1].append((out, {n: v for n, v in self.names.items() if n not in own}))
            self.builder.cbranch(more, inside, out)
        self.builder.position_at_end(inside)
        if self.statements(body):
            after = {n: joined(kind_of(before[n]), kind_of(self.names[n])) for n in changed}
            wider = {n: kind for n, kind in after.items() if kind != kind_of(before[n])}
            if wider:
                raise _WiderError(kinds | wider)
            for name in changed:
                value = as_kind(self.names[name], after[name], self.lanes, self.builder)
                rows[name].append((self.builder.block, parts_of(value)))
            self.builder.branch(head)
        for name in changed:
            for block, parts in rows[name]:
                for phi, part in zip(phis[name], parts, strict=True):
                    phi.add_incoming(part, block)
        return self.joined(self.exits.pop())
