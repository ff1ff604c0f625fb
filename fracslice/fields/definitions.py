"""Formulas that a scene defines by the text of their step or distance, checked before anything of it is
executed, and the trial of a formula at random points.

A text that passes is straight-line arithmetic: assignments, loops over constants and a return of numbers,
points and calls of named functions. It holds no attribute, no text, no other call and no import; its size,
its powers and its loops are bounded, so that no text is expensive to compile.
"""

from __future__ import annotations

import ast
import linecache
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from hashlib import sha256
from keyword import iskeyword
from types import MappingProxyType
from typing import Any, Literal, NoReturn

import numpy as np

from ..common.messages import hint
from ..common.parameters import AUTO, REQUIRED, Parameter
from ..errors import KernelError, SceneError
from ..expr import vocabulary
from ..expr.language import parse
from ..expr.vocabulary import NAMES
from . import maps
from .box import Box, Triple
from .cpu import compile_scene
from .devices import reference
from .maps import NAMES as VERBS
from .orbit_code import Code, stages
from .orbits import HOOKS, LIPSCHITZ, OWN, growth_of, orbit_select, orbit_step, steps
from .registry import Formula, Hook, Node, get, names

LONGEST, DEEPEST, MOST, SLOWEST = 4000, 24, 600, 20_000
"""Characters of a text, levels of its tree, operations that are compiled, with powers written out, where a
statement counts as one at least, and operations that are computed at a point. A step is compiled with its
loops written out.
"""

HIGHEST, LARGEST = 16, 1e9
"""Largest exponent and largest number."""

PYTHON = frozenset({"abs", "min", "max"})

_OPERATORS = (
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.Mod,
    ast.Pow,
    ast.BitAnd,
    ast.BitOr,
    ast.USub,
    ast.UAdd,
)
_COMPARED = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
RESERVED = frozenset({*NAMES, *PYTHON, *VERBS, "orbit", "range", "int", "child"})
"""Names that a text cannot define."""

Fail = Callable[[int, str], Exception]
"""Makes the error to raise from a line of the text and a message."""


def is_name(text: str) -> bool:
    """True for a name that a text may define: lower-case letters, digits and underscores."""
    return _NAME.fullmatch(text) is not None and text not in RESERVED and not iskeyword(text)


def parse_checked(
    text: str, given: Iterable[str], functions: Iterable[str], fail: Fail, written_out: bool = True
) -> list[ast.stmt]:
    """Parse a text and check it; `written_out`: whether it is compiled with its loops written out."""
    if len(text) > LONGEST:
        raise fail(1, f"has a text of {len(text)} characters: expected at most {LONGEST}")
    try:
        body: list[ast.stmt] = parse(text).body
    except SyntaxError as error:
        raise fail(error.lineno or 1, f"is not written in Python: {error.msg}") from None
    except (RecursionError, MemoryError, ValueError):
        raise fail(1, "has a text that is nested too deeply") from None
    check = _Check(set(given), frozenset(functions) | PYTHON, fail)
    check.depth(body)
    check.body(body)
    if not body or not isinstance(body[-1], ast.Return):
        raise fail(getattr(body[-1], "lineno", 1) if body else 1, "expected a return as the last statement")
    if check.cost(body, written_out) > MOST or check.cost(body) > SLOWEST:
        most = MOST if written_out else SLOWEST
        raise fail(1, f"has more than {most} operations with its loops and powers written out")
    return body


class _Check:
    """Goes through statements in order, and knows the names that have a value."""

    def __init__(self, known: set[str], functions: frozenset[str], fail: Fail) -> None:
        self.known, self.functions, self.fail = known, functions, fail

    def refuse(self, node: ast.AST, expected: str) -> NoReturn:
        shown = " ".join(ast.unparse(node).split())
        shown = shown if len(shown) <= 40 else shown[:37] + "..."
        raise self.fail(getattr(node, "lineno", 1), f"{shown!r} is not allowed: expected {expected}")

    def depth(self, body: list[ast.stmt]) -> None:
        """Refuse deep trees, level by level: the other checks are recursive."""
        level: list[ast.AST] = [*body]
        for _ in range(DEEPEST):
            level = [child for node in level for child in ast.iter_child_nodes(node)]
        if level:
            raise self.fail(body[0].lineno, f"has a text nested more than {DEEPEST} levels deep")

    def body(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            match statement:
                case ast.Assign([target], value):
                    statement.value = self.value(value)
                    self.assign(target)
                case ast.AugAssign(ast.Name(name) as target, op, value):
                    self.operator(statement, op)
                    self.value(ast.copy_location(ast.Name(name, ast.Load()), target))
                    statement.value = self.value(value)
                case ast.For(target, iterated, body, [], None):
                    statement.iter = self.iterated(iterated)
                    self.assign(target)
                    self.body(body)
                case ast.Return(ast.expr() as value):
                    statement.value = self.value(value)
                case _:
                    self.refuse(statement, "assignments, for over constants, and return")

    def assign(self, target: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            for part in target.elts:
                self.assign(part)
        elif not isinstance(target, ast.Name):
            self.refuse(target, "a name to assign to")
        elif not is_name(target.id):
            self.refuse(target, "a name of lower-case letters that is not that of a function")
        else:
            self.known.add(target.id)

    def iterated(self, node: ast.expr) -> ast.expr:
        match node:
            case ast.Call(ast.Name("range"), [ast.Constant(int(n))], []) if 0 < n <= MOST:
                return node
            case ast.Tuple():
                return self.value(node)
        self.refuse(node, f"range of a number up to {MOST}, or a tuple")

    def value(self, node: ast.expr) -> ast.expr:
        """Check an expression; return it with numbers as floats."""
        match node:
            case ast.Constant(value):
                if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > LARGEST:
                    self.refuse(node, f"numbers up to {LARGEST:g}")
                return ast.copy_location(ast.Constant(float(value)), node)
            case ast.Name(name):
                if name not in self.known:
                    near = hint(name, self.known | self.functions, "{}")
                    raise self.fail(node.lineno, f"{name!r} has no value here; {near}")
            case ast.Tuple(elements) if elements:
                node.elts = [self.value(element) for element in elements]
            case ast.UnaryOp(op, operand):
                self.operator(node, op)
                node.operand = self.value(operand)
            case ast.BinOp(left, ast.Pow(), right):
                node.left = self.value(left)
                self.exponent(right)
            case ast.BinOp(left, op, right):
                self.operator(node, op)
                node.left, node.right = self.value(left), self.value(right)
            case ast.Compare(left, [op], [right]) if isinstance(op, _COMPARED):
                node.left, node.comparators = self.value(left), [self.value(right)]
            case ast.Call(ast.Name(name), arguments, []):
                if name not in self.functions:
                    near = hint(name, self.functions, "{}")
                    raise self.fail(node.lineno, f"{name!r} is no function here; {near}")
                node.args = [self.value(argument) for argument in arguments]
            case _:
                self.refuse(node, "numbers, points, arithmetic, comparisons and calls of functions by name")
        return node

    def operator(self, node: ast.AST, op: ast.AST) -> None:
        if not isinstance(op, _OPERATORS) or (isinstance(node, ast.AugAssign) and isinstance(op, ast.Pow)):
            self.refuse(node, "+, -, *, /, %, **, & and |")

    def exponent(self, node: ast.expr) -> None:
        match node:
            case ast.Constant(int(n)) if type(n) is int and 1 <= n <= HIGHEST:
                return
            case ast.Constant(0.5):
                return
        self.refuse(node, f"a whole exponent from 1 to {HIGHEST}, or 0.5")

    def cost(self, node: ast.AST | list[ast.stmt], ranges: bool = True) -> int:
        """Operations of a tree whose powers and loops are written out, those over ranges if they are, too."""
        match node:
            case list():
                return sum(self.cost(inner, ranges) for inner in node)
            case ast.BinOp(base, ast.Pow(), ast.Constant(int(n))):
                return n * (1 + self.cost(base, ranges))
            case ast.For(_, ast.Call(_, [ast.Constant(int(n))]), body):
                return (n if ranges else 1) * self.cost(body, ranges)
            case ast.For(_, ast.Tuple(elements) as values, body):
                return self.cost(values, ranges) + len(elements) * self.cost(body, ranges)
        own = 8 if isinstance(node, ast.Call) else isinstance(node, (ast.operator, ast.Compare))
        inner = own + sum(self.cost(child, ranges) for child in ast.iter_child_nodes(node))
        return max(inner, 1) if isinstance(node, ast.stmt) else inner


POINTS = {"step": ("w", "c"), "distance": ("x", "y", "z")}
"""Names that a text has the point from."""

ERRORS = KernelError, ArithmeticError, LookupError, TypeError, ValueError
"""Errors of texts that are not in the language, or confuse points and numbers."""

_DOC = "Defined in the scene."


@dataclass(frozen=True)
class Definition:
    """Text of a formula, with everything that the formula states."""

    name: str  # name of its elements
    parameters: tuple[tuple[str, Parameter], ...]  # kinds of the parameters by name
    # statements. Names of the vocabulary, of the verbs (in a step) and of the parameters have a value
    text: str
    # what the text returns: the next point of an orbit, or the signed distance of a solid
    kind: Literal["step", "distance"] = "step"
    lipschitz: float = 1.0  # lipschitz bound of a distance
    half: Triple | None = None  # half sizes of a box around the solid of a distance; None: endless
    place: tuple[str, int] | None = field(default=None, compare=False)  # file and line of the text

    def fail(self, line: int, message: str) -> SceneError:
        """Error about a line of the text, from 1."""
        place = f"{self.place[0]}:{self.place[1] + line - 1}: " if self.place else ""
        return SceneError(f"{place}<define> {self.name}: {message}")


@dataclass(frozen=True, eq=False, repr=False)
class Defined(Formula):
    """Formula of a definition; formulas of equal definitions are equal."""

    definition: Definition = field(kw_only=True)  # the definition

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Defined) and self.definition == other.definition

    def __hash__(self) -> int:
        return hash(self.definition)

    def __reduce__(self) -> tuple[Any, ...]:
        return formula, (self.definition,)


def formula(definition: Definition) -> Defined:
    """Make the formula of a definition."""
    _check_names(definition)
    called = [*vocabulary.NAMES - {"any_of"}, *(VERBS if definition.kind == "step" else ())]
    given = [*POINTS[definition.kind], *dict(definition.parameters)]
    body = parse_checked(definition.text, given, called, definition.fail, definition.kind == "step")
    made = _make_definition(definition, given, body)
    try:
        _try(made)
    except ERRORS as error:
        raise _locate_error(definition, given, body, error) from None
    return made


def _make_definition(definition: Definition, arguments: list[str], body: list[ast.stmt]) -> Defined:
    return Defined(
        definition.name,
        "shape",
        _function(definition, arguments, body),
        MappingProxyType(dict(definition.parameters) | (OWN if definition.kind == "step" else {})),
        lipschitz=LIPSCHITZ if definition.kind == "step" else definition.lipschitz,
        exterior_only=definition.kind == "step",
        hooks=_hooks(definition),
        definition=definition,
    )


def _check_names(definition: Definition) -> None:
    taken = {*POINTS[definition.kind], *OWN, "source"}
    for name in dict(definition.parameters):
        if not is_name(name) or name in taken:
            raise definition.fail(1, f"parameter {name!r}: expected another name of lower-case letters")
    if len(dict(definition.parameters)) < len(definition.parameters):
        raise definition.fail(1, "has two parameters of one name")
    if not is_name(definition.name) or definition.name in names():
        raise definition.fail(1, "expected a name of lower-case letters that no other element has")


def _hooks(definition: Definition) -> dict[str, Hook]:
    if definition.kind == "step":
        return {**HOOKS, "step": orbit_step}
    half = definition.half
    return {"bounds": lambda _: Box.centred(*half)} if half else {}


def _function(definition: Definition, arguments: list[str], body: list[ast.stmt]) -> Callable[..., Any]:
    """Function of checked statements, whose source the linker can read."""
    lines = "\n".join(map(ast.unparse, body)).replace("\n", "\n    ")
    text = f"def {definition.name}({', '.join(arguments)}):\n    {lines}\n"
    file = f"<define {definition.name} {sha256(text.encode()).hexdigest()[:12]}>"
    scope: dict[str, Any] = {n: getattr(vocabulary, n) for n in vocabulary.NAMES}
    scope |= {n: getattr(maps, n) for n in VERBS} | {"__name__": __name__}
    exec(compile(text, file, "exec"), scope)
    linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
    function: Callable[..., Any] = scope[definition.name]
    function.__doc__ = _DOC
    return function


def _try(made: Defined) -> None:
    """Translate the text; evaluate a distance at a point.

    A step is translated to straight-line code, which knows points from numbers; a distance is not.
    """
    definition = made.definition
    if definition.kind == "step":
        kinds = dict(definition.parameters).items()
        sizes = tuple((name, len(k.default) if isinstance(k.default, tuple) else 1) for name, k in kinds)
        stages((Code(made.function, sizes),))
        return
    value = reference(made())(*np.full((3, 1), 0.3))
    if value.dtype != np.float64 or value.shape != (1,):
        raise KernelError("expected it to return a number that depends on the point")


def _locate_error(
    definition: Definition, arguments: list[str], body: list[ast.stmt], error: Exception
) -> SceneError:
    """Error of the first statement with which the text is at fault."""
    end = parse("return w" if definition.kind == "step" else "return x").body
    for count, statement in enumerate(body, 1):
        try:
            _try(_make_definition(definition, arguments, [*body[:count], *end]))
        except ERRORS as first:
            message = str(first).rpartition(f" {definition.name}: ")[2]
            return definition.fail(statement.lineno, message)
    return definition.fail(body[-1].lineno, str(error).rpartition(f" {definition.name}: ")[2])


def definitions(root: Node) -> list[Definition]:
    """Definitions of a tree's formulas, in the order of the tree."""
    if not any(isinstance(formula, Defined) for formula in root.formulas):
        return []
    used = dict.fromkeys(n.formula.definition for n in root.walk() if isinstance(n.formula, Defined))
    named: dict[str, Definition] = {}
    for definition in used:
        if named.setdefault(definition.name, definition) != definition:
            raise SceneError(f"<define> {definition.name}: expected one definition of this name in a scene")
    return list(used)


COUNT, STEPS = 20_000, 6
"""Random points, and the iterations of a trial where the depth is automatic."""

NEAR, CREASES = 1e-6, 0.002
"""Distance of the points that a step's stretch is examined with, and the share of points that may lie at its
creases.
"""

TOLERANCE = {"float64": 1e-9, "float32": 1e-3}
"""Differences from the reference, relative to values above 1."""


@dataclass(frozen=True)
class Trial:
    """Results of a trial."""

    lines: tuple[str, ...]  # one line per examination
    faults: int  # number of examinations that failed
    root: Node  # node that was examined


def trial(formula: Formula) -> Trial:
    """Examine a formula with its default values."""
    root = _sample(formula)
    box, rng = root.bounds.box, np.random.default_rng(0)
    lo, hi = (
        np.clip(corner, -2.0, 2.0) if not box.finite else np.array(corner) for corner in (box.lo, box.hi)
    )
    size = np.maximum(hi - lo, 1e-9)
    points = rng.uniform(lo - 0.25 * size, hi + 0.25 * size, (COUNT, 3)).T
    expected = reference(root)(*points)
    results = [_parity(root, points, expected, "float64"), _parity(root, points, expected, "float32")]
    if "step" in formula.hooks:
        results.append(_derivative(root, points))
    if formula.hooks.get("select") is orbit_select:
        results.append((True, _proofs(root)))
    values = compile_scene(root, "float64").points(*points)
    results += [_check_lipschitz(root, points, values), _box(root, lo, hi, points, values)]
    inside = float((values < 0).mean())
    results.append((0 < inside < 1, f"inside: {inside:.1%} of the points in and around the box"))
    lines = [f"{'ok   ' if good else 'FAULT'} {line}" for good, line in results]
    return Trial(tuple(lines), sum(not good for good, _ in results), root)


def _sample(formula: Formula) -> Node:
    """Node of a formula with its defaults."""
    for name, kind in formula.parameters.items():
        if kind.default is REQUIRED:
            raise SceneError(f"<{formula.name}> {name} has no default: expected one, for a trial")
    depths: dict[str, Any] = {
        name: STEPS for name, kind in formula.parameters.items() if kind.default == AUTO
    }
    return formula(*(get("sphere")() for _ in range(formula.children[0])), **depths)


def _parity(root: Node, points: np.ndarray, expected: np.ndarray, precision: str) -> tuple[bool, str]:
    """Comparison with the reference; creases of float32 orbits are few points with other values."""
    values = compile_scene(root, precision).points(*points)  # type: ignore[arg-type]
    error = np.abs(values - expected) / np.maximum(np.abs(expected), 1.0)
    typical = float(np.quantile(error, 0.99))
    good = bool(np.isfinite(values).all()) and typical < TOLERANCE[precision]
    return good, f"{precision}: 99% of the values within {typical:.1e} of the reference"


def _check_lipschitz(root: Node, points: np.ndarray, values: np.ndarray) -> tuple[bool, str]:
    """Search for points inside the balls that the Lipschitz bound excludes."""
    bound, outside = root.bounds.lipschitz, values > 0
    step = np.random.default_rng(2).normal(size=points.shape)
    step *= 0.999 * np.abs(values) / bound / np.linalg.norm(step, axis=0)
    field = compile_scene(root, "float64").points
    broken = int((field(*(points + step))[outside] < -1e-9).sum())
    line = f"bound L = {bound:g}: broken at {broken} of {outside.sum()}"
    if not broken or root.bounds.exterior_only:
        return not broken, line
    near = points + NEAR * step / np.linalg.norm(step, axis=0)
    slope = np.abs(field(*near) - values).max() / NEAR
    return False, f"{line}; slopes up to {slope:.3g}: expected a larger lipschitz"


def _box(
    root: Node, lo: np.ndarray, hi: np.ndarray, points: np.ndarray, values: np.ndarray
) -> tuple[bool, str]:
    """Search for points inside the solid and outside its bounding box."""
    if not root.bounds.box.finite:
        return True, "no bounding box: the solid is endless; @formula.bounds declares one"
    beyond = ((lo > points.T) | (hi < points.T)).any(axis=1)
    lost = int((values[beyond] < 0).sum())
    shown = " x ".join(f"{s:.4g}" for s in root.bounds.box.size)
    return not lost, f"box {shown}: {lost} of {beyond.sum()} points beyond it are inside"


def _proofs(root: Node) -> str:
    """Radius of escape and bound of an orbit, and whether they are proved."""
    bound = growth_of(root)
    radius, slope = ("proved" if proved else "measured" for proved in (bound.proved, bound.lipschitz))
    return f"radius of escape {bound.escape:.4g}: {radius}; L = {root.bounds.lipschitz:g}: {slope}"


def _derivative(root: Node, points: np.ndarray) -> tuple[bool, str]:
    """Comparison of a step's stretch with the distances of its images."""
    (code, *_), (given, *_) = steps(root)
    step, v, constant = code.stage.step, given[0], tuple(points)
    offset = np.random.default_rng(1).normal(size=points.shape)
    offset *= NEAR / np.linalg.norm(offset, axis=0)
    with np.errstate(all="ignore"):
        ready = step.prepared(constant, v)
        here, stretch, _ = step.taken(constant, constant, v, ready)
        there = step.image(tuple(points + offset), constant, v, ready)
        moved = np.linalg.norm(np.array(np.broadcast_arrays(*there)) - np.broadcast_arrays(*here), axis=0)
        broken = float((moved > NEAR * (1.001 * np.asarray(stretch) + 1e-3)).mean())
    return broken < CREASES, f"derivative of the step: too small at {broken:.1%} of the points"
