"""Steps of orbits as straight-line code, with their derivatives in forward mode.

A step maps a point w and a constant c to the next point. Its text is followed once, onto a `Tape` with the
derivatives by w and by c. The stretch of the step is the one that verbs, sums and constant factors are known
to keep; where they do not, it is a bound of the norm of the Jacobian.

Every number is an expression with three derivatives by a point w and three by a constant c (Wengert 1964,
"A simple automatic derivative evaluation program"). A vector also carries its stretch as far as sums and
constant factors are known to keep it.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from math import isfinite, nan
from typing import Any, cast

from ..errors import KernelError
from ..expr import graph, language
from ..expr.frontend import FormulaReader, Source, source_function
from ..expr.graph import MismatchError
from ..expr.language import EVALUATED, parse, parse_expression
from .maps import CENTRAL, LENGTHS, MAJORANTS, RIGID

Terms = dict[tuple[str, ...], float]
"""Coefficients of monomials, each the sorted names of its factors."""

Find = Callable[[str], str | None]
"""Expression of a name, or None."""


def linear(atom: str, find: Find) -> Terms:
    """Return an atom as a linear form of names."""
    if atom[0] == "-":
        return scale_form(linear(atom[1:], find), -1.0)
    if not atom.isidentifier():
        return {(): float(atom)}
    match (find(atom) or "").split(" "):
        case [a, ("+" | "-") as sign, b] if _is_atom(a) and _is_atom(b):
            terms = add_forms(linear(a, find), scale_form(linear(b, find), 1.0 if sign == "+" else -1.0))
        case [a, "*", b] if _is_atom(a) and _is_atom(b):
            terms = multiply_forms(linear(a, find), linear(b, find))
        case _:
            return {(atom,): 1.0}
    return terms if all(len(names) == 1 for names in terms) else {(atom,): 1.0}


def _is_atom(text: str) -> bool:
    """True for a name or a number."""
    name = text.removeprefix("-")
    return name.isidentifier() or name.replace(".", "", 1).isdigit()


def scale_form(a: Terms, factor: float) -> Terms:
    """Return a form times a number."""
    return {names: factor * value for names, value in a.items()}


def add_forms(a: Mapping[tuple[str, ...], float], b: Mapping[tuple[str, ...], float]) -> Terms:
    """Return the sum of two forms, without terms that cancel."""
    total = {names: a.get(names, 0.0) + b.get(names, 0.0) for names in {**a, **b}}
    return {names: value for names, value in total.items() if value}


def multiply_forms(a: Terms, b: Terms) -> Terms:
    """Return the product of two forms."""
    total: Terms = {}
    for (p, u), (q, v) in product(a.items(), b.items()):
        total = add_forms(total, {tuple(sorted((*p, *q))): u * v})
    return total


def dot(a: Sequence[str | None], b: Sequence[str | None], find: Find) -> Terms | None:
    """Return the dot product of two rows of atoms if it needs less code than its products.

    `a`, `b`: rows.
    """
    pairs = [(x, y) for x, y in zip(a, b, strict=True) if x is not None and y is not None]
    total: Terms = {}
    for x, y in pairs:
        total = add_forms(total, multiply_forms(linear(x, find), linear(y, find)))
    same = len({abs(value) for value in total.values()}) <= 1
    quadratic = all(len(names) == 2 for names in total)
    return total if same and quadratic and len(total) <= len(pairs) else None


Slopes = tuple[str | None, ...]
"""Derivatives by w (three) and by c (three); None is zero."""

FLAT: Slopes = (None,) * 6


@dataclass(frozen=True)
class Scalar:
    """Atom, which is a name or a number with or without a minus, and its derivatives."""

    atom: str
    slopes: Slopes = FLAT

    @property
    def constant(self) -> bool:
        """True if it depends on neither w nor c."""
        return self.slopes == FLAT


Stretch = tuple[str | None, str | None]
"""Stretch by w and by c; None is zero."""


Majorant = tuple[str | None, str | None]
"""Bend by w (`fields.maps.sure_distance`), and distance to the nearest tear; None is none."""


@dataclass(frozen=True)
class Vector3:
    """Three scalars; the stretch, the majorant and an atom of the length if they are known."""

    parts: tuple[Scalar, Scalar, Scalar]
    stretch: Stretch | None = None
    majorant: Majorant | None = None
    length: str | None = None

    @property
    def known_majorant(self) -> Majorant | None:
        """The majorant; that of a constant is none."""
        return (None, None) if self.stretch == (None, None) else self.majorant


@dataclass
class Tape:
    """Assignments, one for each expression."""

    prefix: str  # prefix of the assigned names
    lines: list[str] = field(default_factory=list)  # assignments
    names: dict[str, str] = field(default_factory=dict)  # names by expression
    expressions: dict[str, str] = field(default_factory=dict)  # expressions by name

    def variable(self, names: str, first: int, length: str) -> Vector3:
        """Point of three names; its derivatives are those from the given index on."""
        parts = [
            Scalar(name, tuple("1.0" if i == first + k else None for i in range(6)))
            for k, name in enumerate(names.split())
        ]
        stretch = (None, "1.0") if first else ("1.0", None)
        return Vector3(tuple(parts), stretch, (None, None), length)  # type: ignore[arg-type]

    def name(self, code: str | None) -> str | None:
        """Name of an expression; equal expressions have one. That of a name with a minus is itself."""
        if code is None or code.removeprefix("-").isidentifier() or as_number(code) is not None:
            return code
        if code not in self.names:
            self.names[code] = f"{self.prefix}{len(self.names)}"
            self.expressions[self.names[code]] = code
            self.lines.append(f"{self.names[code]} = {code}")
        return self.names[code]

    def times(self, a: str | None, b: str | None) -> str | None:
        """Product of two atoms; None is zero."""
        if a is None or b is None:
            return None
        (p, q), (m, n) = (as_number(a), as_number(b)), (a.removeprefix("-"), b.removeprefix("-"))
        if 0 in (p, q):
            return None
        if p is not None and q is not None and isfinite(p * q):
            return repr(p * q)
        size = self.name(_product(*sorted((m, n), key=_numbers_first)))
        return size if (m == a) == (n == b) else _negative(size)

    def plus(self, a: str | None, b: str | None, sign: str = "+") -> str | None:
        """Sum or difference of two atoms; None is zero."""
        b = b if sign == "+" else _negative(b)
        p, q = (0 if e is None else as_number(e) for e in (a, b))
        if a is None or b is None or 0 in (p, q):
            return b if p == 0 else a
        if p is not None and q is not None and isfinite(abs(p) + abs(q)):
            return repr(p + q) if p + q else None
        if a == b:
            return self.times("2.0", a)
        if a == _negative(b):
            return None
        if a[0] == b[0] == "-":
            return _negative(self.plus(a[1:], b[1:]))
        a, b = (b, a) if a[0] == "-" else (a, b)
        return self.name(f"{a} - {b[1:]}" if b[0] == "-" else " + ".join(sorted((a, b))))

    def scalar(self, code: str, *slopes: tuple[str | None, Scalar]) -> Scalar:
        """Scalar of an expression, with factors of the derivatives of others."""
        total: list[str | None] = [None] * 6
        for factor, of in slopes:
            total = [self.plus(t, self.times(factor, s)) for t, s in zip(total, of.slopes, strict=True)]
        return Scalar(str(self.name(code)), tuple(total))

    def sum(self, a: Scalar, b: Scalar, sign: str) -> Scalar:
        """Sum or difference of two scalars."""
        slopes = [self.plus(x, y, sign) for x, y in zip(a.slopes, b.slopes, strict=True)]
        return Scalar(self.plus(a.atom, b.atom, sign) or "0.0", tuple(slopes))

    def vector_sum(self, a: Vector3, b: Vector3, sign: str) -> Vector3:
        """Sum or difference of two vectors; the stretch of both is at most the sum."""
        stretch = None
        if a.stretch and b.stretch:
            stretch = self.plus(a.stretch[0], b.stretch[0]), self.plus(a.stretch[1], b.stretch[1])
        parts = tuple(self.sum(p, q, sign) for p, q in zip(a.parts, b.parts, strict=True))
        first, second = a.known_majorant, b.known_majorant
        majorant = first and second and self.joined(first, second)
        return Vector3(parts, stretch, majorant, self.length_of_sum(a, b, parts))  # type: ignore[arg-type]

    def length_of_sum(self, a: Vector3, b: Vector3, parts: Sequence[Scalar]) -> str | None:
        """Length of a sum or difference: of intervals, between the difference and the sum of the lengths."""
        first, second = (self.norm_of(v.parts) if v.stretch == (None, None) else v.length for v in (a, b))
        if first is None or second is None:
            return None
        least, most = self.size(self.plus(first, second, "-")), self.plus(first, second)
        return self.name(f"maximum({least or '0.0'}, {self.name(f'minimum({most}, {self.norm_of(parts)})')})")

    def norm_of(self, parts: Sequence[Scalar]) -> str:
        """Length of a vector, from its coordinates."""
        x, y, z = (self.times(part.atom, part.atom) for part in parts)
        total = self.plus(self.plus(x, y), z)
        return str(self.name(f"sqrt({total})")) if total else "0.0"

    def joined(self, a: Majorant, b: Majorant) -> Majorant:
        """Majorant of a sum: the larger bend, and the nearer tear."""
        pairs = zip(("maximum", "minimum"), a, b, strict=True)
        bend, tear = (self.name(f"{which}({p}, {q})") if p and q else p or q for which, p, q in pairs)
        return bend, tear

    def product(self, a: Scalar, b: Scalar) -> Scalar:
        """Product of two scalars."""
        return self.scalar(self.times(a.atom, b.atom) or "0.0", (b.atom, a), (a.atom, b))

    def scaled(self, a: Scalar, b: Vector3) -> Vector3:
        """Vector times a scalar."""
        stretch = None
        if a.constant and b.stretch:
            size = self.size(a.atom)
            stretch = self.times(size, b.stretch[0]), self.times(size, b.stretch[1])
        majorant = b.known_majorant if a.constant else None
        length = self.times(self.size(a.atom), b.length) if a.constant and b.length else None
        return Vector3(tuple(self.product(a, part) for part in b.parts), stretch, majorant, length)  # type: ignore[arg-type]

    def after(self, before: Vector3, own: Majorant) -> Majorant | None:
        """Majorant of a map after others; None if it is not known."""
        if before.stretch is None or before.known_majorant is None:
            return None
        (bend, tear), (size, _) = before.known_majorant, before.stretch
        if own[1] is not None and bend is not None:
            return None
        over = own[1] if size in (None, "1.0") else own[1] and self.name(f"ratio({own[1]}, {size})")
        return self.joined((None, tear), (self.plus(bend, self.times(size, own[0])), over))

    def inverse(self, b: Scalar) -> Scalar:
        """Reciprocal of a scalar."""
        number = as_number(b.atom)
        if number:
            return Scalar(repr(1.0 / number))
        over = str(self.name(f"ratio(1.0, {b.atom})"))
        return self.scalar(over, (self.name(f"-{over} * {over}") if not b.constant else None, b))

    def intrinsic(self, name: str, given: list[Scalar]) -> Scalar:
        """Value of an intrinsic of `DERIVATIVES`, or of ``where``."""
        atoms = [v.atom for v in given]
        result = str(self.name(f"{name}({', '.join(atoms)})"))
        if all(v.constant for v in given):
            return Scalar(result)
        if name in ("minimum", "maximum", "where"):
            sign = "<" if name == "minimum" else ">"
            mask = self.name(atoms[0] if name == "where" else f"{atoms[0]} {sign} {atoms[1]}")
            pairs = zip(given[-2].slopes, given[-1].slopes, strict=True)
            return Scalar(result, tuple(self.chosen(mask, a, b) for a, b in pairs))
        places = dict(zip("abc", atoms, strict=False)) | {"r": result}
        factors = [
            (self.name(_filled(text, places)) if text and not of.constant else None, of)
            for text, of in zip(DERIVATIVES[name], given, strict=True)
        ]
        return self.scalar(result, *factors)

    def chosen(self, mask: str | None, a: str | None, b: str | None) -> str | None:
        """Expression of a where a mask holds, else of b; None is zero."""
        return a if a == b else self.name(f"where({mask}, {a or '0.0'}, {b or '0.0'})")

    def norms(self, vector: Vector3) -> Stretch:
        """Bounds of the norms of the Jacobians by w and by c."""
        rows = [part.slopes for part in vector.parts]
        return self.norm([r[:3] for r in rows]), self.norm([r[3:] for r in rows])

    def norm(self, rows: Sequence[Slopes]) -> str | None:
        """Bound of the norm of a matrix J.

        The largest eigenvalue of J J^T is at most the largest sum of absolute values in a row (Gershgorin
        1931), which is exact for similarities.
        """
        if all(as_number(rows[i][k] or "0") == (i == k) for i in range(3) for k in range(3)):
            return "1.0"
        largest: str | None = None
        for i, row in enumerate(rows):
            total = self.dot(row, row)
            for other in (*rows[:i], *rows[i + 1 :]):
                total = self.plus(total, self.size(self.dot(row, other)))
            largest = self.name(f"maximum({largest}, {total})") if largest and total else largest or total
        return largest and self.name(f"sqrt({largest})")

    def size(self, a: str | None) -> str | None:
        """Absolute value of an atom."""
        magnitude = a and a.removeprefix("-")
        if magnitude is None or as_number(magnitude) is not None:
            return magnitude
        return self.name(f"absolute({magnitude})")

    def dot(self, a: Slopes, b: Slopes) -> str | None:
        """Dot product of two rows."""
        total: str | None = None
        terms = dot(a, b, self.expressions.get)
        if terms is not None:
            for names, value in terms.items():
                total = self.plus(total, self.times(*names), "+" if value > 0 else "-")
            return total and self.times(repr(abs(next(iter(terms.values())))), total)
        for x, y in zip(a, b, strict=True):
            total = self.plus(total, self.times(x, y))
        return total


DERIVATIVES: dict[str, tuple[str, ...]] = {
    "sqrt": ("ratio(0.5, maximum(r, 1e-15))",),
    "rsqrt": ("-0.5 * r * r * r",),
    "ratio": ("ratio(1.0, b)", "-r * ratio(1.0, b)"),
    "log": ("ratio(1.0, a)",),
    "exp": ("r",),
    "sin": ("cos(a)",),
    "cos": ("-sin(a)",),
    "atan2": ("b * ratio(1.0, a * a + b * b)", "-a * ratio(1.0, a * a + b * b)"),
    "floor": ("",),
    "absolute": ("where(a < 0.0, -1.0, 1.0)",),
    "minimum": (),
    "maximum": (),
}
"""Derivatives of the vocabulary by each argument, in terms of a, b and the result r."""


def _filled(text: str, places: Mapping[str, str]) -> str:
    tree = parse_expression(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in places:
            node.id = places[node.id]
    return ast.unparse(tree)


def _product(a: str, b: str) -> str:
    """Expression of a product whose first factor is a number if one is."""
    return b if as_number(a) == 1 else f"{a} * {b}"


def _numbers_first(atom: str) -> tuple[bool, str]:
    return as_number(atom) is None, atom


def _negative(atom: str | None) -> str | None:
    """Atom with the other sign."""
    return atom and (atom[1:] if atom[0] == "-" else f"-{atom}")


def as_number(code: str) -> float | None:
    """Number that an expression spells, or None."""
    try:
        return float(code)
    except ValueError:
        return None


CONSTANTS, POINTS = re.compile(r"\bc[xyz]\d+\b"), re.compile(r"\b([xyz]|c[xyz]\d+)\b")
TEARS = re.compile(r"\b(floor|where|atan2)\b|[<>]")
"""Coordinates of the constant, and of it or the point; functions and comparisons that may tear space."""


@dataclass
class Step:
    """Code of a step."""

    before: list[str]  # assignments that do not depend on the last point
    lines: list[str]  # the other assignments
    point: tuple[str, str, str]  # expressions of the next point
    stretch: tuple[str, str]  # expressions of the stretch by w and by c
    # expressions of the bend and of the distance to the nearest tear, or None without one; None if they are
    # not known
    majorant: tuple[str, str | None] | None = None
    bending: tuple[str, ...] = ()  # assignments after `lines` that the majorant depends on
    # expression of the length of the next point, from "rw" and "rc", those of the point and the constant;
    # None if it is not known
    length: str | None = None
    measuring: tuple[str, ...] = ()  # assignments after `lines` that the length depends on

    @cached_property
    def image(self) -> list[str]:
        """Assignments of `lines` that the next point depends on."""
        before = {*self.before}
        return [line for line in self.needed(*self.point) if line not in before]

    def needed(self, *names: str) -> list[str]:
        """Assignments that some names depend on."""
        kept, live = [], {name.removeprefix("-") for name in names}
        for line in reversed([*self.before, *self.lines]):
            target, value = line.split(" = ", 1)
            if target in live:
                live |= names_in(value)
                kept.append(line)
        return kept[::-1]

    @property
    def constants(self) -> list[str]:
        """Coordinates of the constant, wherever the next point depends on them."""
        return CONSTANTS.findall("\n".join([*self.needed(*self.point), *self.point]))

    @property
    def is_added(self) -> bool:
        """True if the constant is a summand of the next point and nowhere else."""
        values = dict(line.split(" = ", 1) for line in self.image)
        summands = [values.get(name, "").split(" + ") for name in self.point]
        constants = sorted(self.constants)
        return len(constants) == 3 and all(c in two for c, two in zip(constants, summands, strict=True))

    @property
    def is_torn(self) -> bool:
        """True if the step may tear space."""
        return bool(TEARS.search("\n".join(self.image)))

    @property
    def is_steady(self) -> bool:
        """True if the stretch is the same at all points, and space is not torn."""
        stretch = "\n".join([*self.needed(self.stretch[0]), self.stretch[0]])
        return not self.is_torn and not POINTS.search(stretch)


def names_in(value: str) -> set[str]:
    """Return the names in an expression."""
    return {n.id for n in ast.walk(parse(value)) if isinstance(n, ast.Name)}


Value = Any
"""Scalar, Vector or tuple of these."""


def trace(
    function: Callable[..., Any], parameters: Mapping[str, int], fixed: Mapping[str, Any], place: int = 0
) -> Step:
    """Follow the graph of a step."""
    tape = Tape(f"s{place}_")
    constant = tape.variable(f"cx{place} cy{place} cz{place}", 3, f"rc{place}")
    env: dict[str, Value] = {"w": tape.variable("x y z", 0, f"rw{place}"), "c": constant}
    env |= {name: _argument(f"v{place}_{name}", size) for name, size in parameters.items()}
    names = language.parameters(function)
    if names[:2] != ["w", "c"] or {*names[2:]} != {*parameters, *fixed}:
        line = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted = ", ".join(("w", "c", *parameters, *fixed))
        raise KernelError(f"{line}: step {function.__name__}: expected the arguments {wanted}")
    step = step_function(function, parameters, fixed)
    value = _Follower(tape)(step, *(env[name] for name in step.parameters))
    declared = value[1] if isinstance(value, tuple) and len(value) == 2 else None
    vector = _vector(value if declared is None else value[0], function)
    stretch = vector.stretch or tape.norms(vector)
    if declared is not None:
        stretch = declared.atom, stretch[1]
    point = tuple(part.atom for part in vector.parts)
    majorant = vector.majorant and (vector.majorant[0] or "0.0", vector.majorant[1])
    made = Step([], tape.lines, point, (stretch[0] or "0.0", stretch[1] or "0.0"), majorant)  # type: ignore[arg-type]
    own = made.needed(*made.point, *made.stretch)
    before, lines = _divide_assignments(own)
    bending, measuring = (
        tuple(line for line in made.needed(*filter(None, names)) if line not in own)
        for names in (majorant or (), (vector.length,))
    )
    return replace(
        made, before=before, lines=lines, bending=bending, length=vector.length, measuring=measuring
    )


@dataclass
class StepReader(FormulaReader):
    """Reads a step, whose tuples have a known number of parts, and the verbs that it calls."""

    sizes: Mapping[str, int] = field(kw_only=True)  # of its arguments

    kind = "step"

    def known(self, node: ast.expr) -> Any:
        """What is known; a function of numbers is evaluated, of NaN for a number that is not known."""
        match node:
            case ast.Call(ast.Name(name), arguments) if self.outside(name) in EVALUATED:
                values = map(self.known, arguments)
                return self.scope[name](*(v if language.is_number(v) else nan for v in values))
        return super().known(node)

    def read_statement(self, node: ast.stmt) -> bool:
        match node:
            case ast.Assign([ast.Tuple(targets)], ast.Call(ast.Name(name)) as value):
                if self.outside(name) in EVALUATED:
                    names = map(ast.unparse, targets)
                    self.fixed = {**self.fixed, **dict(zip(names, self.known(value), strict=True))}
                    return True
        return super().read_statement(node)

    def over(self, node: ast.For, target: ast.expr, iterated: ast.expr) -> bool:
        """A loop over a tuple; that of an argument, too."""
        if not (isinstance(iterated, ast.Name) and iterated.id in self.sizes):
            return super().over(node, target, iterated)
        for item in self.items(self.value(iterated), self.sizes[iterated.id]):
            self.assign(target, item)
            if not self.statements(node.body):
                return False
        return True

    def call_function(self, called: Callable[..., Any], arguments: list[ast.expr]) -> graph.Value:
        """A call of a verb; what is known is fixed in it."""
        names, known = language.parameters(called), [self.known(argument) for argument in arguments]
        pairs = list(zip(names, known, strict=False))
        fixed = {name: value for name, value in pairs if language.is_number(value)}
        passed = [a for a, value in zip(arguments, known, strict=True) if not language.is_number(value)]
        return self.call_counted(step_function(called, {}, fixed), list(map(self.value, passed)))


def step_function(
    function: Callable[..., Any], sizes: Mapping[str, int], fixed: Mapping[str, Any]
) -> graph.Function:
    """Return the function of a step or of a verb; `sizes`: numbers of components of its arguments."""
    made = source_function(StepReader, Source.of(function, "step"), tuple(fixed.items()), sizes=sizes)
    return replace(made, source=Verb(function, fixed))


@dataclass(frozen=True, eq=False)
class Verb:
    """Function of Python with some arguments known."""

    function: Callable[..., Any]
    fixed: Mapping[str, Any]

    def values(self, given: Sequence[Any]) -> list[Any]:
        """Return all arguments in order, from those that are not known."""
        rest = iter(given)
        names = language.parameters(self.function)
        return [self.fixed[name] if name in self.fixed else next(rest) for name in names]


def _argument(name: str, size: int) -> Value:
    """Argument of a step: a number, a point or a tuple of numbers."""
    if size == 1:
        return Scalar(name)
    parts = tuple(Scalar(f"{name}_{k}") for k in range(size))
    return Vector3(parts, (None, None)) if size == 3 else parts  # type: ignore[arg-type]


def _divide_assignments(lines: Sequence[str]) -> tuple[list[str], list[str]]:
    """Assignments that do not depend on the point x, y, z, and the others."""
    before: list[str] = []
    others: list[str] = []
    changing = {"x", "y", "z"}
    for line in lines:
        target, value = line.split(" = ", 1)
        changes = not changing.isdisjoint(names_in(value))
        (others if changes else before).append(line)
        changing |= {target} if changes else set()
    return before, others


class _Count(int):
    """Counter of a loop."""


class _Follower(graph.Evaluator):
    """Follows graphs onto a tape: values are scalars, vectors and tuples of these."""

    def __init__(self, tape: Tape) -> None:
        super().__init__({})
        self.tape = tape

    def __call__(self, function: graph.Function, *given: Any) -> Any:
        value = super().__call__(function, *given)
        return _constants(value) if isinstance(value, float) else value

    def decide(self, value: Any) -> bool:
        if isinstance(value, (bool, tuple)):
            return bool(value)
        number = as_number(value.atom) if isinstance(value, Scalar) else None
        if number is None:
            raise MismatchError("expected a condition on constants")
        return number != 0

    def evaluate(self, value: graph.Value, given: list[Any]) -> Any:
        op = value.op
        if op == "index" or (given and all(isinstance(v, _Count) for v in given)):
            return self.counted(op, given, value.data)
        parts = [_constants(v) if isinstance(v, (int, float)) else v for v in given]
        if op == "call":
            return self.called(value.data, parts)
        if op == "tuple":
            whole = tuple(parts)
            return Vector3(whole, _constant_stretch(whole)) if _is_triple(whole) else whole
        if op in ("item", "element"):
            return self.part(parts, value.data)
        if op in graph.BINARY | graph.UNARY:
            return self.operator(op, *parts)
        return self.intrinsic(op, parts)

    def counted(self, op: str, given: list[Any], data: int | None) -> Any:
        """A step of a counter."""
        if op in ("index", "int"):
            number = data if data is not None else given[0]
            return _Count(_number(number) if isinstance(number, Scalar) else number)
        made = getattr(operator, op)(*given)
        return made if isinstance(made, bool) else _Count(made)

    def part(self, given: list[Any], data: tuple[int, int] | None) -> Any:
        """A part of a point or of a tuple."""
        whole = given[0].parts if isinstance(given[0], Vector3) else given[0]
        if not isinstance(whole, tuple) or (data and len(whole) != data[1]):
            raise MismatchError(f"expected {data[1] if data else 'several'} values")
        return whole[data[0] if data else int(_number(given[1]))]

    # --- arithmetic ---
    def operator(self, op: str, a: Value, b: Value | None = None) -> Value:
        if op == "neg":
            return self.product(Scalar("-1.0"), a)
        assert b is not None
        if op in SIGNS:
            if not (isinstance(a, Scalar) and isinstance(b, Scalar)):
                raise MismatchError("expected numbers, found a point; x, y, z = w gives its coordinates")
            return Scalar(str(self.tape.name(f"{a.atom} {SIGNS[op]} {b.atom}")))
        if op == "mul":
            return self.product(a, b)
        if op == "truediv":
            if not isinstance(b, Scalar):
                raise MismatchError("expected a number to divide by")
            return self.product(self.tape.inverse(b), a)
        if op not in ("add", "sub"):
            raise MismatchError("expected +, -, * or /")
        if isinstance(b, Vector3) != isinstance(a, Vector3):
            raise MismatchError("expected two points or two numbers")
        sign = "+" if op == "add" else "-"
        if isinstance(a, Scalar):
            return self.tape.sum(a, b, sign)
        return self.tape.vector_sum(a, b, sign)

    def product(self, a: Value, b: Value) -> Value:
        if isinstance(a, Vector3):
            a, b = b, a
        if not isinstance(a, Scalar) or not isinstance(b, (Scalar, Vector3)):
            raise MismatchError("expected a number as one of the factors")
        return self.tape.product(a, b) if isinstance(b, Scalar) else self.tape.scaled(a, b)

    # --- calls ---
    def called(self, function: graph.Function, given: list[Value]) -> Value:
        value, verb = self(function, *given), function.source
        if not (isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], Vector3)):
            return value
        if not (given and isinstance(given[0], Vector3)):
            raise MismatchError("expected a point first")
        (image, factor), before = value, given[0].stretch
        stretch = before and tuple(self.tape.times(factor.atom, s) for s in before)
        length = self.length(verb, given)
        return Vector3(image.parts, stretch, self.majorant(verb, given), length)  # type: ignore[arg-type]

    def followed(self, function: Callable[..., Any], values: Sequence[Any]) -> Any:
        """Follow a function of all values, some of which are known numbers."""
        names = language.parameters(function)
        fixed = {n: v for n, v in zip(names, values, strict=True) if language.is_number(v)}
        given = [v for v in values if not language.is_number(v)]
        return self(step_function(function, {}, fixed), *given)

    def intrinsic(self, name: str, given: list[Value]) -> Value:
        if name not in DERIVATIVES and name != "where":
            raise MismatchError(f"{name!r} is not in the language of steps")
        if name == "where" and isinstance(given[1], Vector3) and isinstance(given[2], Vector3):
            pairs = zip(given[1].parts, given[2].parts, strict=True)
            return Vector3(tuple(self.intrinsic(name, [given[0], p, q]) for p, q in pairs))
        if not all(isinstance(v, Scalar) for v in given):
            raise MismatchError("expected numbers, found a point")
        return self.tape.intrinsic(name, given)

    def majorant(self, verb: Verb, given: list[Value]) -> Majorant | None:
        """Majorant of a verb's image."""
        if verb.function in RIGID:
            return self.tape.after(given[0], (None, None))
        if verb.function not in MAJORANTS:
            return None
        bend, tear = self.followed(MAJORANTS[verb.function], verb.values(given))
        return self.tape.after(given[0], (bend.atom, None if as_number(tear.atom) else tear.atom))

    def length(self, verb: Verb, given: list[Value]) -> str | None:
        """Length of a verb's image, from that of its point."""
        before = given[0].length
        if before is None or verb.function in CENTRAL:
            return cast("str | None", before)
        if verb.function not in LENGTHS:
            return None
        values = verb.values([Scalar(before), *given[1:]])
        return cast("str", self.followed(LENGTHS[verb.function], values).atom)


SIGNS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!=", "and_": "&", "or_": "|"}
"""Comparisons and conjunctions in the text of a step."""


def _vector(value: Value, function: Callable[..., Any]) -> Vector3:
    """Vector that a step returns."""
    if isinstance(value, Vector3):
        return value
    if not _is_triple(value):
        place = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        raise KernelError(f"{place}: step {function.__name__}: expected it to return a point")
    return Vector3(value)


def _is_triple(value: Value) -> bool:
    return isinstance(value, tuple) and len(value) == 3 and all(isinstance(v, Scalar) for v in value)


def _constant_stretch(parts: tuple[Scalar, ...]) -> Stretch | None:
    return (None, None) if all(part.constant for part in parts) else None


def _number(value: Value) -> float:
    """Number that a value is known to be; NaN if it is not known."""
    number = as_number(value.atom) if isinstance(value, Scalar) else None
    return nan if number is None else number


def _constants(value: Any) -> Value:
    """Numbers from outside a step."""
    if not isinstance(value, tuple):
        return Scalar(repr(float(value)))
    parts = tuple(map(_constants, value))
    return Vector3(parts, (None, None)) if _is_triple(parts) else parts
