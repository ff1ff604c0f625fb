"""Linking of a scene to one program: its functions, one for all parts of the same structure.

Parts of a scene that differ in numbers only share one function, ``N0(x, y, z, P, P0)``. Their numbers lie in
the parameter array P from offset P0, followed by those of their child elements. A union of a hundred spheres
is thus one sphere and a loop, and scenes that differ in numbers only have the same program: editing a value
compiles nothing.

Shapes and CSG operators are called with their arguments read from P. `Fixed` arguments are known when the
function is read, so that dead branches are dropped and loops over fixed tuples are unrolled. A domain
operator is read with its child in the place of ``child``. Identities are omitted.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import count
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np

from ..common.parameters import AUTO
from ..errors import KernelError
from ..expr.frontend import FormulaReader, formula
from ..expr.graph import Entry, FlowGraph, Function, Program, Value, Width, Writer, identified, written
from ..expr.language import CHILD, WORDS, Fixed, InMemory, OfPoint, parameters, words
from .regions import Region, is_long

if TYPE_CHECKING:
    from .node import Node

INLINED = 12
"""Parts whose code may be inlined in one function; others are called. Kernels of small scenes are one
function, and the compile time of a large one grows with the number of its parts.
"""

UNROLLED = 3
"""Elements of one structure that are unrolled; more become a loop."""

EMPTY = 1e30
"""Value of a union that lists no element."""

PART = ("x", "y", "z", "P", "P0")
"""Arguments of a part's function."""

POINT = ("x", "y", "z")

FIELD = "field"
"""Name of the field's function."""


@dataclass(frozen=True, eq=False)
class Linked:
    """Linked scene; equal if functions and numbers are.

    Attributes
    ----------
    program
        Functions, with the signed field ``field(x, y, z, P)``.
    parameters
        Parameters P, float64 [n].
    held
        Arguments in memory, each with the index in P of its first word.
    regions
        Long unions, each with the index in P of the first word of its address.
    """

    program: Program
    parameters: np.ndarray
    held: tuple[tuple[int, InMemory], ...] = ()
    regions: tuple[tuple[int, Region], ...] = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Linked) and self._contents == other._contents

    def __hash__(self) -> int:
        return hash(self._contents)

    @cached_property
    def _contents(self) -> tuple[str, bytes]:
        return self.program.identity, self.parameters.tobytes()


Passed = Any
"""Where an argument lies in P, from its beginning: an `Entry`, or a tuple of these; or a `Called`."""

Structure = Any
"""What is the same of arguments that differ in numbers only: of a number, whether it is whole; a tuple of
these; or a `Called`.
"""


@dataclass(frozen=True)
class Called:
    """Function of a point that gives an argument there."""

    function: Function

    def __repr__(self) -> str:
        return self.function.identity


def load(writer: Writer, passed: Passed, origin: Value | None = None) -> Value:
    """Write the value of an argument.

    `origin`: P0; without it, P begins at 0.
    """
    if isinstance(passed, tuple):
        return writer.add("tuple", *(load(writer, part, origin) for part in passed))
    if isinstance(passed, Called):
        return writer.call(passed.function, *(writer.names[name] for name in POINT))
    return writer.entry(passed, origin)


def append_numbers(value: Any, numbers: list[float]) -> Structure:
    """Append a number or a tuple of numbers to a list; of an argument in memory its hash."""
    if isinstance(value, float):  # most are
        numbers.append(value)
        return False
    if isinstance(value, tuple):
        if set(map(type, value)) == {float}:
            numbers += value
            return (False,) * len(value)
        return tuple([append_numbers(part, numbers) for part in value])
    if isinstance(value, OfPoint):
        return Called(formula(value.function))
    if isinstance(value, InMemory):
        return append_numbers(words(value.digest), numbers)
    numbers.append(float(value))
    return isinstance(value, int)


def passed(structure: Structure, start: int = 0) -> Passed:
    """Return where the arguments of a structure lie whose numbers begin at an index."""
    places = count(start)

    def placed(part: Structure) -> Passed:
        if isinstance(part, tuple):
            return tuple(map(placed, part))
        return part if isinstance(part, Called) else Entry(next(places), part)

    return placed(structure)


@dataclass(slots=True)
class Arguments:
    """Function of a node and its arguments."""

    function: Callable[..., Any] | Function  # function of the formula
    fixed: tuple[tuple[str, Any], ...]  # arguments that are known when the function is read
    structure: tuple[Structure, ...]  # of the other arguments, in the function's order
    numbers: list[float]  # numbers in P
    held: tuple[tuple[int, InMemory], ...] = ()  # arguments in memory, by the index of their first word

    @property
    def read(self) -> Function:
        """The function."""
        return formula(self.function, self.fixed)

    @property
    def passed(self) -> tuple[Passed, ...]:
        """Places of the arguments that are passed."""
        places: tuple[Passed, ...] = passed(self.structure)
        return places

    def load(self, writer: Writer) -> list[Value]:
        """Write the values of the arguments that are passed."""
        return [load(writer, place, writer.names["P0"]) for place in self.passed]


def arguments(node: Node) -> Arguments:
    """Return the function of a node and its arguments."""
    function, values = node.function, node.arguments
    names = function.parameters if isinstance(function, Function) else parameters(function)
    names = names[leading(node) :]
    if values.keys() ^ names:
        wanted, given = (", ".join(s) or "nothing" for s in (values, names))
        code = function.__code__
        raise KernelError(
            f"{code.co_filename}:{code.co_firstlineno}: formula {node.formula.name}: expected "
            f"{function.__name__} to take {wanted} after its points, found {given}"
        )
    fixed, structure, held, numbers = [], [], [], list[float]()
    for name in names:
        value = values[name]
        if isinstance(value, Fixed):
            fixed.append((name, value.value))
            continue
        if isinstance(value, InMemory):
            held.append((len(numbers), value))
        structure.append(append_numbers(value, numbers))
    return Arguments(function, tuple(fixed), tuple(structure), numbers, tuple(held))


@dataclass(frozen=True, eq=False)
class Subroutine:
    """Function ``name(x, y, z, P, P0)`` of all trees of one structure."""

    function: Function
    size: int  # number of entries of P that it reads, from P0 on
    weight: int  # number of parts whose code it contains


@dataclass(frozen=True)
class Run:
    """Consecutive elements computed by one function."""

    part: Subroutine  # function of the elements
    count: int  # number of elements
    start: int  # offset from P0 of the first element's numbers

    def call(self, writer: Writer, point: Sequence[Value] = (), k: Value | None = None) -> Value:
        """Write the call of one element.

        `point`: another one than x, y, z; `k`: index of the element.
        """
        names = writer.names
        place = self.first(writer)
        if k is not None:
            place = writer.add("add", place, writer.add("mul", writer.constant(self.part.size), k))
        point = point or [names[name] for name in POINT]
        return writer.call(self.part.function, *point, names["P"], place)

    def first(self, writer: Writer) -> Value:
        """Write the index in P of the first element's numbers."""
        return writer.add("add", writer.names["P0"], self.start)

    def begin(self, writer: Writer) -> Value | None:
        """Write the value of the first element; None if there may be none."""
        return self.call(writer)

    def each(
        self, writer: Writer, begun: bool, changed: set[str], fold: Callable[[Run, Value | None], None]
    ) -> None:
        """Write what is done with each element, one after the other or in a loop.

        `begun`: leave out the first one; `changed`: names that `fold` assigns, which writes it for the
        element of an index of a run.
        """
        if not self.is_loop:
            for k in range(begun, self.count):
                fold(Run(self.part, 1, self.start + k * self.part.size), None)
            return

        def body() -> bool:
            fold(self, writer.names["i"])
            return True

        limits = [writer.constant(int(begun)), writer.constant(self.count)]
        writer.counted("i", limits, changed, body, [])

    @property
    def is_loop(self) -> bool:
        """True if its elements are not unrolled."""
        return self.count > UNROLLED

    @property
    def taken(self) -> int:
        """Entries of P that it takes from its start on."""
        return self.count * self.part.size

    @property
    def about(self) -> str:
        """Text of its place."""
        return f"{self.count} {self.start} {self.part.size}"

    @property
    def key(self) -> tuple[Any, ...]:
        """What a function that calls it depends on."""
        return self.part.function, self.count, self.start


@dataclass(frozen=True)
class LongRun(Run):
    """Elements of a long union. In P stand the words of an address, where a compiled kernel asks for those
    that matter (`regions`), then the index of the first one's numbers and the number of all.
    """

    def first(self, writer: Writer) -> Value:
        return self._number(writer, WORDS)

    def begin(self, writer: Writer) -> Value | None:
        return None

    def each(
        self, writer: Writer, begun: bool, changed: set[str], fold: Callable[[Run, Value | None], None]
    ) -> None:
        names, width = writer.names, writer.width
        near = None
        if width.lanes and not width.on_gpu:
            words = (self._number(writer, k) for k in range(WORDS))
            near = writer.add("near", *(names[name] for name in POINT), writer.add("tuple", *words))

        def body() -> bool:
            k = writer.names["i"]
            fold(self, writer.add("element", near, writer.add("add", k, 1)) if near else k)
            return True

        end = writer.add("element", near, 0) if near else self._number(writer, WORDS + 1)
        writer.counted("i", [end], changed, body, [])

    def _number(self, writer: Writer, k: int) -> Value:
        index = writer.add("add", writer.names["P0"], self.start + k)
        return writer.add("int", writer.add("element", writer.names["P"], index))

    @property
    def is_loop(self) -> bool:
        return True

    @property
    def taken(self) -> int:
        return WORDS + 2

    @property
    def about(self) -> str:
        return f"long {self.start} {self.part.size}"

    @property
    def key(self) -> tuple[Any, ...]:
        return self.part.function, "long", self.start


class Dialect(Protocol):
    """Style of the functions of a tree."""

    prefix: str  # prefix of their names

    def kept(self, node: Node) -> Node:
        """Return the node that represents this one."""

    def arguments(self, node: Node) -> Arguments: ...

    def elements(self, node: Node) -> Elements:
        """Return the elements of a long union."""

    def region(self, node: Node) -> Region:
        """Return the region of a long union."""

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Return an order in which the children may be evaluated."""

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a node."""


@dataclass
class PartNumbers:
    """Numbers of P of a part, with what is in memory and long unions, each by the index of its first word."""

    values: list[float] = field(default_factory=list)
    held: list[tuple[int, InMemory]] = field(default_factory=list)
    unions: list[tuple[int, LongUnion]] = field(default_factory=list)

    def __iadd__(self, more: PartNumbers) -> Self:
        """Append those of another part."""
        start = len(self.values)
        self.values += more.values
        if more.held:
            self.held += [(start + place, memory) for place, memory in more.held]
        if more.unions:
            self.unions += [(start + place, union) for place, union in more.unions]
        return self


@dataclass(frozen=True, eq=False)
class Elements:
    """Elements of a long union, linked apart from all else."""

    part: Subroutine  # function of one of them
    numbers: np.ndarray  # P of each, float64 [n, size]
    held: Sequence[tuple[int, InMemory]]  # see `Linked`; places in the flat numbers
    parts: Sequence[Function]  # functions of all, innermost first
    called: frozenset[Function]  # those that are called, not inlined

    @property
    def program(self) -> Program:
        """Program of one element, whose numbers are P."""
        return Program({FIELD: function_of(self.part, 0)}, self.parts, self.called)


@dataclass(frozen=True)
class LongUnion:
    """A long union, whose elements' numbers come after the other ones of P."""

    elements: Elements
    region: Region


def link_tree(linker: Linker, root: Node, dialect: Dialect) -> Function:
    """Link a tree and append its numbers to P; return its function of x, y, z and P."""
    start = len(linker.parameters)
    part, numbers = _Tree(linker, dialect, is_long).linked(root)
    linker.main += numbers
    return function_of(part, start)


def link_elements(node: Node, dialect: Dialect) -> Elements:
    """Link the elements of a long union."""
    tree = _Tree(Linker(), dialect, lambda _: False)
    linked = [tree.linked(child) for child in node.fields]
    kinds = [*dict.fromkeys(part for part, _ in linked)]
    part, numbers = tree.any_of(kinds), PartNumbers()
    for number, (kind, own) in enumerate(linked, 1):
        if len(kinds) > 1:
            numbers.values.append(float(kinds.index(kind)))
        numbers += own
        numbers.values += [0.0] * (number * part.size - len(numbers.values))
    values = np.array(numbers.values).reshape(len(linked), part.size)
    return Elements(part, values, numbers.held, tree.linker.parts, frozenset(tree.linker.called))


def function_of(part: Subroutine, start: int) -> Function:
    """Return the function of x, y, z and P of a part whose numbers begin at an index in P."""

    def write(writer: Writer) -> Value:
        given = [writer.names[name] for name in (*POINT, "P")]
        return writer.call(part.function, *given, writer.constant(start))

    return written("tree", (*POINT, "P"), identified("tree", part.function, start), write)


@dataclass(frozen=True)
class _Tree:
    linker: Linker
    dialect: Dialect
    is_long: Callable[[Node], bool]  # whether the elements of a union are linked apart
    known: dict[int, tuple[Subroutine, PartNumbers]] = field(default_factory=dict)

    def linked(self, node: Node) -> tuple[Subroutine, PartNumbers]:
        """Function and numbers of a node with all below it; of one that stands in many places, once."""
        found = self.known.get(id(node))
        if not found:
            found = self.known[id(node)] = self.linked_now(node)
        return found

    def linked_now(self, node: Node) -> tuple[Subroutine, PartNumbers]:
        """See `linked`."""
        node = self.dialect.kept(node)
        given = self.dialect.arguments(node)
        numbers = PartNumbers([*given.numbers], [*given.held])
        runs = self.long_run(node, numbers) if self.is_long(node) else self.runs(node, numbers)
        key = given.function, given.fixed, given.structure, *[run.key for run in runs]

        def make(name: str) -> Subroutine:
            function = self.dialect.write(name, node, given, runs)
            return Subroutine(function, len(numbers.values), self.weight(runs))

        return self.linker.part(self.dialect.prefix, key, make), numbers

    def runs(self, node: Node, numbers: PartNumbers) -> list[Run]:
        """Runs of the elements of a node, whose numbers are appended to its own."""
        linked = [self.linked(child) for child in node.fields]
        runs = list[Run]()
        for k in self.dialect.order(node, [part for part, _ in linked]):
            part, own = linked[k]
            if runs and runs[-1].part is part:
                runs[-1] = replace(runs[-1], count=runs[-1].count + 1)
            else:
                runs.append(Run(part, 1, len(numbers.values)))
            numbers += own
        return runs

    def long_run(self, node: Node, numbers: PartNumbers) -> list[Run]:
        """The elements of a long union; what stands in P of it is appended to its own numbers."""
        elements, start = self.dialect.elements(node), len(numbers.values)
        self.linker.include(elements)
        numbers.unions.append((start, LongUnion(elements, self.dialect.region(node))))
        numbers.values += [*[0.0] * (WORDS + 1), float(len(elements.numbers))]
        return [LongRun(elements.part, len(elements.numbers), start)]

    def any_of(self, kinds: Sequence[Subroutine]) -> Subroutine:
        """Function of elements of several kinds, of which the first number is the kind."""
        if len(kinds) == 1:
            return kinds[0]

        def make(name: str) -> Subroutine:
            size = 1 + max(part.size for part in kinds)
            return Subroutine(one_of(name, kinds), size, self.weight([Run(part, 1, 1) for part in kinds]))

        return self.linker.part(self.dialect.prefix, ("one of", *kinds), make)

    def weight(self, runs: Sequence[Run]) -> int:
        """Weight of a function with these calls. If it is too large, the heaviest parts are called, not
        inlined.
        """
        held = {run.part.function: 0 for run in runs}
        for run in runs:
            sites = 2 if run.is_loop else run.count
            part = run.part
            held[part.function] += 0 if part.function in self.linker.called else sites * part.weight
        for function in sorted(held, key=lambda function: -held[function]):
            if sum(held.values()) < INLINED:
                break
            if held[function]:
                self.linker.called.add(function)
                held[function] = 0
        return 1 + sum(held.values())


LEADING = {"shape": 3, "csg": 2, "domain": 4}
"""Number of leading arguments (points, values or child) by kind of formula."""


def one_of(name: str, kinds: Sequence[Subroutine]) -> Function:
    """Return the function of a part that is of the kind, of several, that its first number is."""

    def write(writer: Writer) -> Value:
        names = writer.names
        kind = writer.add("int", writer.add("element", names["P"], names["P0"]))
        given = [*(names[name] for name in POINT), names["P"], writer.add("add", names["P0"], 1)]
        ends = []
        for k, part in enumerate(kinds):
            others = None
            if k < len(kinds) - 1:
                writer.block, others = writer.fork(writer.add("eq", kind, k))
            value = writer.call(part.function, *given)
            ends.append((writer.block, {"f": value}))
            writer.block = others or writer.block
        writer.joined(ends)
        return writer.names["f"]

    return written(name, PART, identified("one of", *(part.function for part in kinds)), write)


def part_function(
    name: str, given: Arguments, runs: Sequence[Run], write: Callable[[Writer], Value], kind: str
) -> Function:
    """Return the function of a part, which is written.

    `kind`: what `write` does.
    """
    about = kind, given.read, repr(given.passed), *(x for run in runs for x in (run.part.function, run.about))
    return written(name, PART, identified(*about), write)


@dataclass
class FieldDialect:
    """Dialect of functions that return the field's value."""

    prefix: str = "N"

    def kept(self, node: Node) -> Node:
        """Return the first node from this one on that is no identity and no CSG operator of one element."""
        while node.is_identity or (node.formula.kind == "csg" and _folds(node) and len(node.children) == 1):
            node = node.children[0]
        return node

    def arguments(self, node: Node) -> Arguments:
        """Return the function of a node and its arguments. Raises `KernelError` if a depth is "auto"."""
        if AUTO in node.values.values():
            raise KernelError(
                f"<{node.formula.name}>: the depth is still auto; resolve it for a voxel size first"
            )
        return arguments(node)

    def elements(self, node: Node) -> Elements:
        """Return the elements of a long union, which are linked once; see `Dialect.elements`."""
        return node.linked_elements

    def region(self, node: Node) -> Region:
        """Return the region of a long union; see `Dialect.region`."""
        return Region.of(node)

    def order(self, node: Node, parts: Sequence[Subroutine]) -> Sequence[int]:
        """Group elements of the same structure where their order changes no bit of the result."""
        places = range(len(parts))
        if len(parts) == 1 or not node.is_unordered:
            return places
        first = list(dict.fromkeys(part.function for part in parts))
        return sorted(places, key=lambda k: first.index(parts[k].function))

    def write(self, name: str, node: Node, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a node."""
        write = {"shape": self.shape, "csg": self.csg_operator, "domain": self.domain_operator}
        return write[node.formula.kind](name, given, runs)

    def shape(self, name: str, given: Arguments, _: Sequence[Run]) -> Function:
        """Return the function of a shape."""

        def write(writer: Writer) -> Value:
            point = [writer.names[name] for name in POINT]
            return writer.call(given.read, *point, *given.load(writer))

        return part_function(name, given, (), write, "shape")

    def csg_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a CSG operator."""

        def write(writer: Writer) -> Value:
            names = writer.names

            def fold(run: Run, k: Value | None) -> None:
                other = run.call(writer, k=k)
                names_now = writer.names
                names_now["f"] = writer.call(given.read, names_now["f"], other, *given.load(writer))

            first = runs[0].begin(writer)
            names["f"] = first or writer.constant(EMPTY)
            if sum(run.count for run in runs) == 1:
                names["f"] = writer.call(given.read, names["f"], *given.load(writer))
            for number, run in enumerate(runs):
                run.each(writer, number == 0 and bool(first), {"f"}, fold)
            return writer.names["f"]

        return part_function(name, given, runs, write, "csg")

    def domain_operator(self, name: str, given: Arguments, runs: Sequence[Run]) -> Function:
        """Return the function of a domain operator."""
        return domain_function(DomainReader, name, given, runs[0])


@dataclass
class DomainReader(FormulaReader):
    """Reads a domain operator as the function of a part, with its child's."""

    child: Run = field(kw_only=True)

    def calling(self, node: ast.Call, function: ast.expr, arguments: list[ast.expr]) -> Value:
        """A call; that of ``child`` is one of the child's function."""
        if isinstance(function, ast.Name) and function.id == CHILD:
            return self.evaluated_child(list(map(self.value, arguments)))
        return super().calling(node, function, arguments)

    def evaluated_child(self, point: list[Value]) -> Value:
        """The child's value at a point."""
        return self.child.call(self, point)


def domain_function(kind: type[DomainReader], name: str, given: Arguments, child: Run) -> Function:
    """Return the function of a domain operator.

    `kind`: its reader.
    """
    source, known = formula(given.function).source, dict(given.fixed)
    rest = given.read.parameters[4:]

    def read(width: Width) -> FlowGraph:
        reader = kind(width, source=source, fixed=known, child=child)
        reader.begin(PART)
        reader.names.update(zip(rest, given.load(reader), strict=True))
        return reader.read()

    about = kind.__name__, given.read, repr(given.passed), child.part.function, child.about
    return Function(name, PART, identified(*about), read, source.error)


def _folds(node: Node) -> bool:
    """True if a CSG operator's function takes the values of two elements and is called once per further
    element.
    """
    return node.formula.children[1] != 1


def leading(node: Node) -> int:
    """Return the number of a node's arguments that are points, values or its child."""
    return 1 if node.formula.kind == "csg" and not _folds(node) else LEADING[node.formula.kind]


LARGEST = 1 << 24
"""Largest number of parameters: a float32 holds every index."""


def link(root: Node) -> Linked:
    """Link a scene tree.

    Parameters
    ----------
    root
        Scene with resolved depths.

    Returns
    -------
    Linked
        Functions and parameters.

    Raises
    ------
    KernelError
        If a depth is "auto".
    """
    linker = Linker()
    linker.field(root)
    return linker.linked()


@dataclass
class Linker:
    """Collects functions and parameters."""

    main: PartNumbers = field(default_factory=PartNumbers)  # of P, without the lists behind them
    functions: dict[str, Function] = field(default_factory=dict)  # those that are called by name
    called: set[Function] = field(default_factory=set)  # those that are called, not inlined
    # arrays that stand behind the numbers in P, each with the index of the number that is its offset
    tables: list[tuple[int, np.ndarray]] = field(default_factory=list)
    _parts: dict[Any, Subroutine] = field(default_factory=dict)
    _functions: dict[Function, None] = field(default_factory=dict)  # of parts, in order

    def field(self, root: Node) -> None:
        """Write the field of a scene tree."""
        self.functions[FIELD] = link_tree(self, root, FieldDialect())

    def part(self, prefix: str, key: tuple[Any, ...], make: Callable[[str], Subroutine]) -> Subroutine:
        """Return the function of a structure; make it once."""
        known = self._parts.get((prefix, key))
        if not known:
            known = self._parts[prefix, key] = make(f"{prefix}{len(self._functions)}")
            self._functions[known.function] = None
        return known

    @property
    def parts(self) -> tuple[Function, ...]:
        """Functions of the parts, innermost first."""
        return tuple(self._functions)

    def include(self, elements: Elements) -> None:
        """Include the functions of the elements of a long union."""
        self._functions |= dict.fromkeys(elements.parts)
        self.called |= elements.called

    def argument(self, value: Any) -> Any:
        """Append a number, a tuple of numbers or an array to P; return the entries that are read for it."""
        if isinstance(value, np.ndarray):
            self.tables.append((len(self.parameters), value))
            value = 0.0
        start = len(self.parameters)
        return passed(append_numbers(value, self.parameters), start)

    @property
    def parameters(self) -> list[float]:
        """Numbers of P so far, without the lists behind them."""
        return self.main.values

    def linked(self) -> Linked:
        """Return what is collected: P is the numbers, then each array once, then those of long unions."""
        numbers, held = self._numbers_and_arrays(), [*self.main.held]
        tails, end = [numbers], len(numbers)
        for place, union in self.main.unions:
            numbers[place + WORDS] = end
            held += [(end + index, memory) for index, memory in union.elements.held]
            tails.append(union.elements.numbers.ravel())
            end += len(tails[-1])
        if end > LARGEST:
            raise KernelError(f"a scene of {end:,} numbers: expected at most {LARGEST:,}")
        program = Program(dict(self.functions), self.parts, frozenset(self.called))
        regions = tuple((place, union.region) for place, union in self.main.unions)
        return Linked(program, np.concatenate(tails), tuple(held), regions)

    def _numbers_and_arrays(self) -> np.ndarray:
        """The numbers, then each array once, float64 [n]."""
        numbers, arrays = np.array(self.parameters or [0.0], np.float64), {}
        end = len(numbers)
        for place, array in self.tables:
            if id(array) not in arrays:
                arrays[id(array)] = end, array
                end += array.size
            numbers[place] = arrays[id(array)][0]
        if end > LARGEST:
            raise KernelError(
                f"the pictures of a scene hold {end:,} numbers: expected at most {LARGEST:,} in all"
            )
        return np.concatenate([numbers, *(array.ravel() for _, array in arrays.values())])

    def bind(self, function: Callable[..., Any], values: dict[str, Any]) -> Function:
        """Return the function of the arguments that have no value, in their order, and of P.

        The others are read from P or fixed. An argument named P receives P.
        """
        fixed = {k: v.value for k, v in values.items() if isinstance(v, Fixed)}
        called = formula(function, tuple(fixed.items()))
        given = (self.argument(values[a]) if a in values else a for a in called.parameters)
        return _bound(called, tuple(given))


@lru_cache(maxsize=512)
def _bound(called: Function, passed: tuple[Passed, ...]) -> Function:
    """Function that calls another one with values from P and, where a name stands, its own arguments."""
    rest = [name for name in passed if isinstance(name, str) and name != "P"]

    def write(writer: Writer) -> Value:
        given = (writer.names[p] if isinstance(p, str) else load(writer, p) for p in passed)
        return writer.call(called, *given)

    return written(f"bound_{called.name}", (*rest, "P"), identified("bound", called, repr(passed)), write)
