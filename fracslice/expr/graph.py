"""Functions of the language as graphs: values in basic blocks, each of them assigned once.

A block ends with a jump, a branch or a return. Where ways join, the values that differ are parameters of the
block there, and each jump passes its own (Cytron et al. 1991, "Efficiently Computing Static Single Assignment
Form"; parameters instead of phis as in Appel 1998, "SSA is Functional Programming"). From this one form come
the values on NumPy arrays and on intervals, the derivatives of steps, and the code of lanes and of threads.

| Operation | Operands | Data | Value |
|---|---|---|---|
| `argument`, `parameter` | | name | of the function, of the block |
| `constant` | | number | the number |
| `tuple` | parts | | several values |
| `item` | tuple | index and count | a part of as many |
| `element` | array or tuple, index | | an element |
| `set` | array, index, value | | none: stores an element |
| `call` | arguments | function, or its name | what the function returns |
| `index` | none, or a number | number | counter of a loop |
| `truth` | number | | whether it is not zero |
| `near` | point, address in words | | the number of elements of a long union that matter there, and these |
| names of Python's `operator` | one or two | | the operator's |
| names of the vocabulary and of intrinsics | the function's | | the function's |
"""

from __future__ import annotations

import hashlib
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from . import vocabulary

ARITHMETIC = frozenset(("add", "sub", "mul", "truediv"))
COMPARISONS = frozenset(("lt", "le", "gt", "ge", "eq", "ne"))
WHOLE_ONLY = frozenset(("floordiv", "mod", "xor", "lshift", "rshift"))
BINARY = ARITHMETIC | COMPARISONS | WHOLE_ONLY | {"and_", "or_"}
UNARY = frozenset(("neg", "invert", "not_"))
"""Operators, by their names in Python's `operator`."""


class MismatchError(Exception):
    """Incompatible values; the message names them."""


@dataclass(eq=False, slots=True, repr=False)
class Value:
    """Result of an operation."""

    op: str
    operands: tuple[Value, ...] = ()
    data: Any = None
    origin: Any = None  # statement that it is of

    @property
    def known(self) -> Any:
        """The number of a constant; None of others."""
        return self.data if self.op == "constant" else None


@dataclass(eq=False, slots=True, repr=False)
class Jump:
    """Way to another block."""

    target: Block
    passed: list[Value]  # of the parameters of the block


@dataclass(eq=False, slots=True, repr=False)
class Branch:
    """Two ways, by a condition; neither block has parameters."""

    test: Value
    yes: Block
    no: Block
    origin: Any = None


@dataclass(eq=False, slots=True, repr=False)
class Return:
    """End of the function; without a value, that of a loop."""

    value: Value | None = None


@dataclass(eq=False, slots=True, repr=False)
class Block:
    """Operations one after the other."""

    parameters: list[Value] = field(default_factory=list)
    body: list[Value] = field(default_factory=list)
    exit: Jump | Branch | Return = field(default_factory=Return)
    is_head: bool = False  # whether a jump comes back from behind: it is the head of a loop
    ways: int = 0  # jumps to it, without those that come back


@dataclass(eq=False, repr=False)
class FlowGraph:
    """Body of a function; its first block is the beginning."""

    arguments: list[Value]
    blocks: list[Block] = field(default_factory=list)


@dataclass(frozen=True)
class Width:
    """Lanes that a function is read for."""

    lanes: int
    on_gpu: bool = False  # whether they are the threads of a GPU


ARRAYS = Width(0)
"""Arrays of any size, in place of lanes."""


@dataclass(eq=False, repr=False)
class Function:
    """Function of the language, which is read when it is needed."""

    name: str
    parameters: tuple[str, ...]
    identity: str  # of everything that it is made of
    read: Callable[[Width], FlowGraph]
    fail: Callable[[Any, str], Exception]  # error about a statement of it
    source: Any = None  # what it is read from
    _graphs: dict[Width, FlowGraph] = field(default_factory=dict)

    def __call__(self, *given: Any) -> Any:
        """Evaluate the function on NumPy arrays."""
        return _ON_ARRAYS(self, *given)

    def __repr__(self) -> str:
        return self.identity

    def graph(self, width: Width) -> FlowGraph:
        """Return the body for a number of lanes."""
        if width not in self._graphs:
            self._graphs[width] = self.read(width)
        return self._graphs[width]


def identified(*parts: object) -> str:
    """Identity of what is made of some parts, which are text or have one."""
    texts = (part.identity if isinstance(part, Function) else str(part) for part in parts)
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Entry:
    """Number that is read from the parameters P where it is used."""

    index: int
    is_whole: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class Program:
    """Functions of a linked scene."""

    functions: Mapping[str, Function] = field(default_factory=dict)  # those that are called by name
    parts: Sequence[Function] = ()  # functions of the parts of the scene, innermost first
    called: frozenset[Function] = frozenset()  # parts that are called, not inlined

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Program) and self.identity == other.identity

    def __hash__(self) -> int:
        return hash(self.identity)

    @cached_property
    def identity(self) -> str:
        """Identity of all functions."""
        calls = (str(k) for k, part in enumerate(self.parts) if part in self.called)
        return identified(*(text for pair in self.functions.items() for text in pair), *self.parts, *calls)


NOTHING = Program()
"""Program of loops without a field."""

Names = dict[str, Value]


@dataclass
class Writer:
    """Writes a graph, block after block."""

    width: Width
    names: Names = field(default_factory=dict)  # values of the names here
    graph: FlowGraph = field(default_factory=lambda: FlowGraph([]))
    statement: Any = None  # the one that is written

    def begin(self, parameters: Sequence[str]) -> None:
        """Begin with the arguments."""
        self.graph.arguments = [Value("argument", data=name) for name in parameters]
        self.names.update(zip(parameters, self.graph.arguments, strict=True))
        self.block = self.new_block()

    def new_block(self, *parameters: Value) -> Block:
        """Append an empty block."""
        block = Block(list(parameters))
        self.graph.blocks.append(block)
        return block

    def add(self, op: str, *operands: Value | float, data: Any = None) -> Value:
        """Append an operation to the block; numbers become constants."""
        given = tuple(v if isinstance(v, Value) else self.constant(v) for v in operands)
        value = Value(op, given, data, self.statement)
        self.block.body.append(value)
        return value

    def constant(self, number: Any) -> Value:
        """Return a number, or a tuple of numbers."""
        if isinstance(number, tuple):
            return self.add("tuple", *map(self.constant, number))
        if isinstance(number, float) and str(number)[0] == "-":
            return self.add("neg", -number)
        return Value("constant", data=number, origin=self.statement)

    def call(self, function: Function | str, *given: Value) -> Value:
        """Append a call."""
        return self.add("call", *given, data=function)

    def entry(self, entry: Entry, origin: Value | None = None) -> Value:
        """Read a number from P.

        `origin`: where its index begins; without it at 0.
        """
        if "P" not in self.names:
            raise MismatchError("P is expected among the arguments, from which a number is read")
        index = self.constant(entry.index) if origin is None else self.add("add", origin, entry.index)
        value = self.add("element", self.names["P"], index)
        return self.add("int", value) if entry.is_whole else value

    def items(self, value: Value, count: int) -> list[Value]:
        """Parts of a tuple."""
        if value.op != "tuple":
            return [self.add("item", value, data=(k, count)) for k in range(count)]
        if len(value.operands) != count:
            raise MismatchError(f"{count} values are expected")
        return list(value.operands)

    def give(self, value: Value | None) -> None:
        """End the function."""
        self.block.exit = Return(value)

    def jump(self, target: Block, passed: Sequence[Value] = ()) -> None:
        """End the block."""
        self.block.exit = Jump(target, list(passed))
        target.ways += 1

    def fork(self, test: Value) -> tuple[Block, Block]:
        """End the block with two ways."""
        yes, no = self.new_block(), self.new_block()
        self.block.exit = Branch(test, yes, no, self.statement)
        return yes, no

    def joined(self, ends: Sequence[tuple[Block, Names]]) -> bool:
        """Join blocks and continue with the names that all of them have; return False without blocks."""
        if not ends:
            return False
        first, *others = (names for _, names in ends)
        common = [name for name in first if all(name in names for names in others)]
        same = {name: first[name] for name in common if all(n[name] is first[name] for n in others)}
        differ = [name for name in common if name not in same]
        merged = {name: Value("parameter", data=name, origin=self.statement) for name in differ}
        into = self.new_block(*merged.values())
        for block, names in ends:
            self.block = block
            self.jump(into, [names[name] for name in differ])
        self.block, self.names = into, same | merged
        return True

    def loop(
        self,
        changed: set[str],
        own: Mapping[str, Value | None],
        test: Callable[[], Value | None],
        body: Callable[[], bool],
        exits: list[tuple[Block, Names]],
    ) -> bool:
        """Write a loop; return True if what follows is reachable.

        `changed`: names that are assigned in it; `own`: names that have no value after it, and their values
        before it; `test`: writes the condition to go on; `body`: returns True if its end is reachable;
        `exits`: receives the ways out of it.
        """
        statement = self.statement
        self.names |= {name: value for name, value in own.items() if value}
        carried = sorted((changed | own.keys()) & self.names.keys())
        heads = {name: Value("parameter", data=name, origin=statement) for name in carried}
        head = self.new_block(*heads.values())
        head.is_head = True
        self.jump(head, [self.names[name] for name in carried])
        self.block, self.names = head, self.names | heads
        inside, more = self.new_block(), test()
        if more is None:
            self.jump(inside)
        else:
            out = self.new_block()
            self.block.exit = Branch(more, inside, out, statement)
            exits.append((out, {name: value for name, value in self.names.items() if name not in own}))
        self.block = inside
        if body():
            self.block.exit = Jump(head, [self.names[name] for name in carried])
        self.statement = statement
        return self.joined(exits)

    def counted(
        self,
        counter: str,
        limits: Sequence[Value],
        changed: set[str],
        body: Callable[[], bool],
        exits: list[tuple[Block, Names]],
    ) -> bool:
        """Write a loop over a range with a positive step. After it the counter has no value; see `loop`."""
        zero, one = (self.add("index", data=number) for number in (0, 1))
        limits = [self.add("index", limit) for limit in limits]
        first, end, step = [zero, *limits, one] if len(limits) == 1 else [*limits, one][:3]
        place = f"{counter} of {len(self.graph.blocks)}"

        def test() -> Value:
            here = self.names[place]
            self.names[counter] = self.add("int", here)
            inside = self.add("lt", here, end)
            self.names[place] = self.add("add", here, step)
            return inside

        return self.loop(changed, {place: first, counter: None}, test, body, exits)


def written(
    name: str, parameters: Sequence[str], identity: str, write: Callable[[Writer], Value | None]
) -> Function:
    """Return a function that code writes.

    `write`: writes the body, and returns the value.
    """

    def read(width: Width) -> FlowGraph:
        writer = Writer(width)
        writer.begin(parameters)
        writer.give(write(writer))
        return writer.graph

    def fail(_: Any, message: str) -> Exception:
        return MismatchError(f"{name}: {message}")

    return Function(name, tuple(parameters), identity, read, fail)


class Evaluator:
    """Evaluates functions in a domain: arrays, intervals, symbols.

    Attributes
    ----------
    operations
        Functions of the domain by operation; an operator is Python's own if it is not among them.
    named
        Functions that are called by their names.
    """

    def __init__(
        self, operations: Mapping[str, Callable[..., Any]], named: Mapping[str, Function] | None = None
    ) -> None:
        self.operations, self.named = {**_OPERATIONS, **operations}, named or {}

    def __call__(self, function: Function, *given: Any) -> Any:
        graph = function.graph(ARRAYS)
        values = dict(zip(graph.arguments, given, strict=True))
        block = graph.blocks[0]
        while True:
            for value in block.body:
                operands = [values.get(o, o.data) for o in value.operands]
                try:
                    values[value] = self.evaluate(value, operands)
                except MismatchError as error:
                    raise function.fail(value.origin, str(error)) from None
            match block.exit:
                case Jump(target, passed):
                    moved = [values.get(v, v.data) for v in passed]
                    values.update(zip(target.parameters, moved, strict=True))
                    block = target
                case Branch(test, yes, no):
                    block = yes if self.decide(values.get(test, test.data)) else no
                case Return(None):
                    return None
                case Return(Value() as result):
                    return values.get(result, result.data)

    def evaluate(self, value: Value, given: list[Any]) -> Any:
        """Apply an operation."""
        match value.op:
            case "call":
                return self.call(value.data, given)
            case "tuple":
                return tuple(given)
            case "item":
                return given[0][value.data[0]]
            case "index":
                return int(given[0]) if given else value.data
        return self.operations[value.op](*given)

    def decide(self, value: Any) -> bool:
        """Whether a condition holds."""
        return bool(value)

    def call(self, function: Function | str, given: list[Any]) -> Any:
        """Call a function."""
        return self(self.named[function] if isinstance(function, str) else function, *given)


_OPERATIONS: dict[str, Callable[..., Any]] = {name: getattr(operator, name) for name in BINARY | UNARY} | {
    "element": operator.getitem, "set": operator.setitem, "truth": bool, "int": int, "min": min, "max": max
}  # fmt: skip


ON_ARRAYS: Mapping[str, Callable[..., Any]] = {
    name: getattr(vocabulary, name) for name in vocabulary.NAMES | vocabulary.OF_CELLS
}
"""The vocabulary on arrays."""

_ON_ARRAYS = Evaluator(ON_ARRAYS)


def text(*functions: Function, width: Width = ARRAYS) -> str:
    """Return functions and those that they call as text, for readers."""
    shown = list(dict.fromkeys(functions))
    for one in shown:
        shown += dict.fromkeys(f for f in _called(one.graph(width)) if f not in shown)
    return "\n\n".join("\n".join(_lines(one, one.graph(width))) for one in reversed(shown))


def _called(graph: FlowGraph) -> Iterator[Function]:
    for block in graph.blocks:
        for value in block.body:
            if isinstance(value.data, Function):
                yield value.data


def _lines(function: Function, graph: FlowGraph) -> Iterator[str]:
    places = {block: f"b{k}" for k, block in enumerate(graph.blocks)}
    parameters = [v for block in graph.blocks for v in (*block.parameters, *block.body)]
    numbers = {value: f"v{k}" for k, value in enumerate(parameters)}

    def shown(value: Value) -> str:
        return numbers.get(value) or str(value.data)

    def way(block: Block, passed: Sequence[Value] = ()) -> str:
        return f"{places[block]}({', '.join(map(shown, passed))})"

    yield f"{function.name}({', '.join(function.parameters)}):"
    for block in graph.blocks:
        yield f"{places[block]}({', '.join(map(shown, block.parameters))}):"
        for value in block.body:
            data = value.data.name if isinstance(value.data, Function) else value.data
            about = "" if data is None else f" {data}"
            yield f"  {shown(value)} = {value.op}{about} {', '.join(map(shown, value.operands))}".rstrip()
        match block.exit:
            case Jump(target, passed):
                yield f"  jump {way(target, passed)}"
            case Branch(test, yes, no):
                yield f"  branch {shown(test)} {way(yes)} {way(no)}"
            case Return(result):
                yield f"  return {shown(result)}" if result else "  return"
