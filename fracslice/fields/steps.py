"""Steps of orbits as straight-line code, with their derivatives in forward mode.

A step maps a point w and a constant c to the next point. Its graph is followed once, onto a `Tape` with the
derivatives by w and by c. The stretch of the step is the one that verbs, sums and constant factors are known
to keep; where they do not, it is a bound of the norm of the Jacobian.

Every number is a term with three derivatives by a point w and three by a constant c (Wengert 1964, "A simple
automatic derivative evaluation program"). A vector also carries its stretch as far as sums and constant
factors are known to keep it.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from itertools import product
from math import copysign, isfinite, nan
from typing import Any, NamedTuple, cast

from ..errors import KernelError
from ..expr import graph, language
from ..expr.frontend import FormulaReader, Source, formula, source_function
from ..expr.graph import Function, MismatchError, Writer, identified, written
from ..expr.language import EVALUATED, parse_expression
from ..expr.vocabulary import cos, maximum, ratio, sin, where
from .maps import CENTRAL, LENGTHS, MAJORANTS, RIGID


class Term(NamedTuple):
    """Operation on terms before it; a number, an input."""

    op: str  # of `expr.graph`; "constant" and "input" without operands
    operands: tuple[int, ...] = ()  # indices of terms
    data: Any = None  # the number; the name of the input, or its place in the arguments of the step


Sum = dict[tuple[int, ...], float]
"""Coefficients of monomials, each the sorted indices of its factors."""


def scale_form(a: Sum, factor: float) -> Sum:
    """Return a form times a number."""
    return {names: factor * value for names, value in a.items()}


def add_forms(a: Mapping[tuple[int, ...], float], b: Mapping[tuple[int, ...], float]) -> Sum:
    """Return the sum of two forms, without terms that cancel."""
    total = {names: a.get(names, 0.0) + b.get(names, 0.0) for names in {**a, **b}}
    return {names: value for names, value in total.items() if value}


def multiply_forms(a: Sum, b: Sum) -> Sum:
    """Return the product of two forms."""
    total: Sum = {}
    for (p, u), (q, v) in product(a.items(), b.items()):
        total = add_forms(total, {tuple(sorted((*p, *q))): u * v})
    return total


Slopes = tuple[int | None, ...]
"""Derivatives by w (three) and by c (three); None is zero."""

FLAT: Slopes = (None,) * 6


@dataclass(frozen=True)
class Scalar:
    """Term and its derivatives."""

    term: int
    slopes: Slopes = FLAT

    @property
    def constant(self) -> bool:
        """True if it depends on neither w nor c."""
        return self.slopes == FLAT


Stretch = tuple[int | None, int | None]
"""Stretch by w and by c; None is zero."""


Majorant = tuple[int | None, int | None]
"""Bend by w (`fields.maps.sure_distance`), and distance to the nearest tear; None is none."""


@dataclass(frozen=True)
class Vector3:
    """Three scalars; the stretch, the majorant and the length if they are known."""

    parts: tuple[Scalar, Scalar, Scalar]
    stretch: Stretch | None = None
    majorant: Majorant | None = None
    length: int | None = None

    @property
    def known_majorant(self) -> Majorant | None:
        """The majorant; that of a constant is none."""
        return (None, None) if self.stretch == (None, None) else self.majorant


@dataclass
class Tape:
    """Terms, each once."""

    terms: list[Term] = field(default_factory=list)
    places: dict[Term, int] = field(default_factory=dict)  # indices of the terms

    def add(self, op: str, *operands: int, data: Any = None) -> int:
        """Index of a term."""
        term = Term(op, operands, data)
        if term not in self.places:
            self.places[term] = len(self.terms)
            self.terms.append(term)
        return self.places[term]

    def number(self, value: float) -> int:
        """Index of a number; a negative one is that of its size with a minus."""
        size = self.add("constant", data=abs(value))
        return self.negative(size) if copysign(1.0, value) < 0 else size

    def variable(self, letter: str, first: int) -> Vector3:
        """Point whose derivatives are those from the given index on; `letter`: name of the point."""
        parts = [
            Scalar(
                self.add("input", data=letter + axis),
                tuple(self.one if i == first + k else None for i in range(6)),
            )
            for k, axis in enumerate("xyz")
        ]
        stretch = (None, self.one) if first else (self.one, None)
        return Vector3(tuple(parts), stretch, (None, None), self.add("input", data=letter + "r"))  # type: ignore[arg-type]

    @property
    def one(self) -> int:
        return self.number(1.0)

    @property
    def zero(self) -> int:
        return self.number(0.0)

    def value(self, term: int | None) -> float | None:
        """Number of a term that is one; None is zero."""
        if term is None:
            return 0.0
        op, operands, data = self.terms[term]
        if op == "neg":
            number = self.value(operands[0])
            return None if number is None else -number
        return cast("float", data) if op == "constant" else None

    def negative(self, a: int) -> int:
        """Term with the other sign."""
        size, minus = self.parted(a)
        return size if minus else self.add("neg", a)

    def parted(self, a: int) -> tuple[int, bool]:
        """Term without its minus, and whether it has one."""
        op, operands, _ = self.terms[a]
        return (operands[0], True) if op == "neg" else (a, False)

    def times(self, a: int | None, b: int | None) -> int | None:
        """Product of two terms; None is zero."""
        if a is None or b is None:
            return None
        p, q = self.value(a), self.value(b)
        if 0 in (p, q):
            return None
        if p is not None and q is not None and isfinite(p * q):
            return self.number(p * q)
        (m, minus), (n, other) = self.parted(a), self.parted(b)
        one = self.one
        factors = [f for f in sorted((m, n), key=lambda f: (self.value(f) is None, f)) if f != one]
        size = self.add("mul", *factors) if len(factors) > 1 else factors[0]
        return size if minus == other else self.negative(size)

    def plus(self, a: int | None, b: int | None, sign: int = 1) -> int | None:
        """Sum or difference of two terms; None is zero."""
        b = b if sign > 0 or b is None else self.negative(b)
        p, q = self.value(a), self.value(b)
        if a is None or b is None or 0 in (p, q):
            return b if p == 0 else a
        if p is not None and q is not None and isfinite(abs(p) + abs(q)):
            return self.number(p + q) if p + q else None
        if a == b:
            return self.times(self.number(2.0), a)
        (m, minus), (n, other) = self.parted(a), self.parted(b)
        if m == n:
            return None
        if minus and other:
            return self.negative(self.or_zero(self.plus(m, n)))
        if minus or other:
            return self.add("sub", *((n, m) if minus else (m, n)))
        return self.add("add", *sorted((a, b)))

    def scalar(self, term: int, *slopes: tuple[int | None, Scalar]) -> Scalar:
        """Scalar of a term, with factors of the derivatives of others."""
        total: list[int | None] = [None] * 6
        for factor, of in slopes:
            total = [self.plus(t, self.times(factor, s)) for t, s in zip(total, of.slopes, strict=True)]
        return Scalar(term, tuple(total))

    def sum(self, a: Scalar, b: Scalar, sign: int) -> Scalar:
        """Sum or difference of two scalars."""
        slopes = tuple(self.plus(x, y, sign) for x, y in zip(a.slopes, b.slopes, strict=True))
        return Scalar(self.or_zero(self.plus(a.term, b.term, sign)), slopes)

    def or_zero(self, a: int | None) -> int:
        """Term that may be zero."""
        return self.zero if a is None else a

    def vector_sum(self, a: Vector3, b: Vector3, sign: int) -> Vector3:
        """Sum or difference of two vectors; the stretch of both is at most the sum."""
        stretch = None
        if a.stretch and b.stretch:
            stretch = self.plus(a.stretch[0], b.stretch[0]), self.plus(a.stretch[1], b.stretch[1])
        parts = tuple(self.sum(p, q, sign) for p, q in zip(a.parts, b.parts, strict=True))
        first, second = a.known_majorant, b.known_majorant
        majorant = first and second and self.joined(first, second)
        return Vector3(parts, stretch, majorant, self.length_of_sum(a, b, parts))  # type: ignore[arg-type]

    def length_of_sum(self, a: Vector3, b: Vector3, parts: Sequence[Scalar]) -> int | None:
        """Length of a sum or difference: of intervals, between the difference and the sum of the lengths."""
        first, second = (self.norm_of(v.parts) if v.stretch == (None, None) else v.length for v in (a, b))
        if first is None or second is None:
            return None
        least, most = self.size(self.plus(first, second, -1)), self.plus(first, second)
        within = self.add("minimum", self.or_zero(most), self.norm_of(parts))
        return self.add("maximum", self.or_zero(least), within)

    def norm_of(self, parts: Sequence[Scalar]) -> int:
        """Length of a vector, from its coordinates."""
        x, y, z = (self.times(part.term, part.term) for part in parts)
        total = self.plus(self.plus(x, y), z)
        return self.zero if total is None else self.add("sqrt", total)

    def joined(self, a: Majorant, b: Majorant) -> Majorant:
        """Majorant of a sum: the larger bend, and the nearer tear."""
        pairs = zip(("maximum", "minimum"), a, b, strict=True)
        bend, tear = (
            (p if q is None else q) if None in (p, q) else self.add(which, cast("int", p), cast("int", q))
            for which, p, q in pairs
        )
        return bend, tear

    def product(self, a: Scalar, b: Scalar) -> Scalar:
        """Product of two scalars."""
        return self.scalar(self.or_zero(self.times(a.term, b.term)), (b.term, a), (a.term, b))

    def scaled(self, a: Scalar, b: Vector3) -> Vector3:
        """Vector times a scalar."""
        stretch = length = None
        if a.constant and b.stretch:
            size = self.size(a.term)
            stretch = self.times(size, b.stretch[0]), self.times(size, b.stretch[1])
        majorant = b.known_majorant if a.constant else None
        if a.constant and b.length is not None:
            length = self.times(self.size(a.term), b.length)
        return Vector3(tuple(self.product(a, part) for part in b.parts), stretch, majorant, length)  # type: ignore[arg-type]

    def after(self, before: Vector3, own: Majorant) -> Majorant | None:
        """Majorant of a map after others; None if it is not known."""
        if before.stretch is None or before.known_majorant is None:
            return None
        (bend, tear), (size, _) = before.known_majorant, before.stretch
        if own[1] is not None and bend is not None:
            return None
        over = own[1]
        if over is not None and size not in (None, self.one):
            over = self.add("ratio", over, size)
        return self.joined((None, tear), (self.plus(bend, self.times(size, own[0])), over))

    def inverse(self, b: Scalar) -> Scalar:
        """Reciprocal of a scalar."""
        number = self.value(b.term)
        if number:
            return Scalar(self.number(1.0 / number))
        over = self.add("ratio", self.one, b.term)
        squared = self.times(over, over)
        return self.scalar(over, (None if b.constant else self.negative(self.or_zero(squared)), b))

    def intrinsic(self, name: str, given: list[Scalar]) -> Scalar:
        """Value of an intrinsic of `DERIVATIVES`, or of ``where``."""
        terms = [v.term for v in given]
        result = self.add(name, *terms)
        if all(v.constant for v in given):
            return Scalar(result)
        if name in ("minimum", "maximum", "where"):
            less = "lt" if name == "minimum" else "gt"
            mask = terms[0] if name == "where" else self.add(less, *terms)
            pairs = zip(given[-2].slopes, given[-1].slopes, strict=True)
            return Scalar(result, tuple(self.chosen(mask, a, b) for a, b in pairs))
        slopes = _Slopes(self)
        factors = [
            (slopes(formula(slope), *terms, result) if slope and not of.constant else None, of)
            for slope, of in zip(DERIVATIVES[name], given, strict=True)
        ]
        return self.scalar(result, *factors)

    def chosen(self, mask: int, a: int | None, b: int | None) -> int | None:
        """Term a where a mask holds, else b; None is zero."""
        return a if a == b else self.add("where", mask, self.or_zero(a), self.or_zero(b))

    def norms(self, vector: Vector3) -> Stretch:
        """Bounds of the norms of the Jacobians by w and by c."""
        rows = [part.slopes for part in vector.parts]
        return self.norm([r[:3] for r in rows]), self.norm([r[3:] for r in rows])

    def norm(self, rows: Sequence[Slopes]) -> int | None:
        """Bound of the norm of a matrix J.

        The largest eigenvalue of J J^T is at most the largest sum of absolute values in a row (Gershgorin
        1931), which is exact for similarities.
        """
        if all(self.value(rows[i][k]) == (i == k) for i in range(3) for k in range(3)):
            return self.one
        largest: int | None = None
        for i, row in enumerate(rows):
            total = self.dot(row, row)
            for other in (*rows[:i], *rows[i + 1 :]):
                total = self.plus(total, self.size(self.dot(row, other)))
            if total is not None:
                largest = total if largest is None else self.add("maximum", largest, total)
        return None if largest is None else self.add("sqrt", largest)

    def size(self, a: int | None) -> int | None:
        """Absolute value of a term."""
        if a is None:
            return None
        magnitude, _ = self.parted(a)
        return magnitude if self.value(magnitude) is not None else self.add("absolute", magnitude)

    def dot(self, a: Slopes, b: Slopes) -> int | None:
        """Dot product of two rows."""
        total: int | None = None
        terms = self.short_dot(a, b)
        if terms is not None:
            for names, value in terms.items():
                total = self.plus(total, self.times(*names), 1 if value > 0 else -1)
            return total and self.times(self.number(abs(next(iter(terms.values())))), total)
        for x, y in zip(a, b, strict=True):
            total = self.plus(total, self.times(x, y))
        return total

    def short_dot(self, a: Slopes, b: Slopes) -> Sum | None:
        """Dot product of two rows if it needs less code than its products."""
        pairs = [(x, y) for x, y in zip(a, b, strict=True) if x is not None and y is not None]
        total: Sum = {}
        for x, y in pairs:
            total = add_forms(total, multiply_forms(self.linear(x), self.linear(y)))
        same = len({abs(value) for value in total.values()}) <= 1
        quadratic = all(len(names) == 2 for names in total)
        return total if same and quadratic and len(total) <= len(pairs) else None

    def linear(self, a: int) -> Sum:
        """Term as a linear form of others."""
        op, operands, data = self.terms[a]
        match op:
            case "neg":
                return scale_form(self.linear(operands[0]), -1.0)
            case "constant":
                return {(): cast("float", data)}
            case "add" | "sub":
                p, q = map(self.linear, operands)
                terms = add_forms(p, scale_form(q, 1.0 if op == "add" else -1.0))
            case "mul":
                terms = multiply_forms(*map(self.linear, operands))
            case _:
                return {(a,): 1.0}
        return terms if all(len(names) == 1 for names in terms) else {(a,): 1.0}


class _Slopes(graph.Evaluator):
    """Writes derivatives on a tape."""

    def __init__(self, tape: Tape) -> None:
        super().__init__({})
        self.tape = tape

    def evaluate(self, value: graph.Value, given: list[Any]) -> int:
        terms = [self.tape.number(v) if isinstance(v, float) else v for v in given]
        if value.op == "mul":
            return self.tape.or_zero(self.tape.times(*terms))
        return self.tape.negative(terms[0]) if value.op == "neg" else self.tape.add(value.op, *terms)


# Derivatives of the vocabulary by an argument: functions of the arguments and of the result r.
def _of_sqrt(a, r):  # type: ignore[no-untyped-def]
    return ratio(0.5, maximum(r, 1e-15))


def _of_rsqrt(a, r):  # type: ignore[no-untyped-def]
    return -0.5 * r * r * r


def _of_upper(a, b, r):  # type: ignore[no-untyped-def]
    return ratio(1.0, b)


def _of_lower(a, b, r):  # type: ignore[no-untyped-def]
    return -r * ratio(1.0, b)


def _of_log(a, r):  # type: ignore[no-untyped-def]
    return ratio(1.0, a)


def _of_exp(a, r):  # type: ignore[no-untyped-def]
    return r


def _of_sin(a, r):  # type: ignore[no-untyped-def]
    return cos(a)


def _of_cos(a, r):  # type: ignore[no-untyped-def]
    return -sin(a)


def _of_rise(a, b, r):  # type: ignore[no-untyped-def]
    return b * ratio(1.0, a * a + b * b)


def _of_run(a, b, r):  # type: ignore[no-untyped-def]
    return -a * ratio(1.0, a * a + b * b)


def _of_absolute(a, r):  # type: ignore[no-untyped-def]
    return where(a < 0.0, -1.0, 1.0)


DERIVATIVES: dict[str, tuple[Callable[..., Any] | None, ...]] = {
    "sqrt": (_of_sqrt,),
    "rsqrt": (_of_rsqrt,),
    "ratio": (_of_upper, _of_lower),
    "log": (_of_log,),
    "exp": (_of_exp,),
    "sin": (_of_sin,),
    "cos": (_of_cos,),
    "atan2": (_of_rise, _of_run),
    "floor": (None,),
    "absolute": (_of_absolute,),
    "minimum": (),
    "maximum": (),
}
"""Derivatives of the vocabulary by each argument; None is zero."""


CONSTANT, POINT = ("cx", "cy", "cz"), ("wx", "wy", "wz")
"""Inputs: coordinates of the constant and of the point; "cr" and "wr" are their lengths."""

TEARING = frozenset({"floor", "where", "atan2", "lt", "le", "gt", "ge"})
"""Operations that may tear space."""


@dataclass(frozen=True)
class Step:
    """Code of a step.

    Its functions take the point w, the constant c, the tuple v of the other arguments, and the terms that are
    `ready`.
    """

    terms: tuple[Term, ...]
    point: tuple[int, ...]  # coordinates of the next point
    stretch: tuple[int, int]  # stretch by w and by c
    # bend and distance to the nearest tear, or None without one; None if they are not known
    majorant: tuple[int, int | None] | None = None
    length: int | None = None  # length of the next point, from those of the point and of the constant

    @classmethod
    def read(cls, text: str) -> Step:
        """Step of a text; see `text`."""
        terms, *others = ast.literal_eval(parse_expression(text))
        return cls(tuple(Term(*term) for term in terms), *others)

    @property
    def text(self) -> str:
        """The step as text."""
        terms = tuple(map(tuple, self.terms))
        return repr((terms, self.point, self.stretch, self.majorant, self.length))

    @cached_property
    def identity(self) -> str:
        """Identity of the code."""
        return identified(self.text)

    def __hash__(self) -> int:
        return hash(self.identity)

    def needed(self, places: Sequence[int], known: Sequence[int] = ()) -> list[int]:
        """Terms that some terms depend on, in order, without those that are known and theirs."""
        live, stack = {*known}, [*places]
        while stack:
            if (place := stack.pop()) not in live:
                live.add(place)
                stack += self.terms[place].operands
        return sorted(live.difference(known))

    @cached_property
    def changing(self) -> frozenset[int]:
        """Terms that depend on the point."""
        changing = set[int]()
        for place, (_, operands, data) in enumerate(self.terms):
            if data in POINT or not changing.isdisjoint(operands):
                changing.add(place)
        return frozenset(changing)

    @cached_property
    def ready(self) -> tuple[int, ...]:
        """Calculations of the next point and the stretch that do not depend on the point."""
        needed = self.needed([*self.point, *self.stretch])
        plain = ("input", "constant", "neg")
        return tuple(p for p in needed if p not in self.changing and self.terms[p].op not in plain)

    def inputs(self, places: Sequence[int]) -> Iterator[Any]:
        """Inputs that terms are made of, each as often as it is used."""
        within = [o for p in self.needed(places) if self.terms[p].op != "neg" for o in self.terms[p].operands]
        for place in (*within, *places):
            op, operands, data = self.terms[place]
            if op == "neg":
                op, operands, data = self.terms[operands[0]]
            if op == "input":
                yield data

    @property
    def constants(self) -> list[str]:
        """Coordinates of the constant, as often as the next point depends on them."""
        return [name for name in self.inputs(self.point) if name in CONSTANT]

    @cached_property
    def is_added(self) -> bool:
        """True if the constant is a summand of the next point and nowhere else."""
        sums = [term.operands if term.op == "add" else () for term in map(self.terms.__getitem__, self.point)]
        summands = [[self.terms[operand].data for operand in operands] for operands in sums]
        constants = sorted(self.constants)
        return len(constants) == 3 and all(c in two for c, two in zip(constants, summands, strict=True))

    @cached_property
    def is_torn(self) -> bool:
        """True if the step may tear space."""
        return any(self.terms[p].op in TEARING for p in self.needed(self.point) if p in self.changing)

    @cached_property
    def is_steady(self) -> bool:
        """True if the stretch is the same at all points, and space is not torn."""
        return not self.is_torn and {*POINT, *CONSTANT}.isdisjoint(self.inputs(self.stretch[:1]))

    @cached_property
    def has_tear(self) -> bool:
        """True if the distance to a tear of the step is known."""
        return self.majorant is not None and self.majorant[1] is not None

    @cached_property
    def is_measured(self) -> bool:
        """True if the length of the next point is known."""
        return self.length is not None

    @cached_property
    def ignores_constant(self) -> bool:
        """True if the constant does not change the next point."""
        return self.terms[self.stretch[1]] == Term("constant", data=0.0)

    # --- functions ---
    @cached_property
    def prepared(self) -> Function:
        """Terms that are ready, from c and v."""
        return self.function("prepared", ("c", "v"), self.ready)

    @cached_property
    def image(self) -> Function:
        """The next point, from w, c, v and ready."""
        return self.function("image", TAKEN, self.point)

    @cached_property
    def taken(self) -> Function:
        """The next point and the stretches by w and by c, from w, c, v and ready."""
        return self.function("taken", TAKEN, (self.point, *self.stretch))

    @cached_property
    def bent(self) -> Function:
        """As `taken`, then the bend and the distance to the nearest tear, zero without one."""
        assert self.majorant is not None
        bend, tear = self.majorant
        return self.function("bent", TAKEN, (self.point, *self.stretch, bend, bend if tear is None else tear))

    @cached_property
    def sized(self) -> Function:
        """As `taken`, then the length of the next point, from those of w and c, too."""
        return self.function("sized", (*TAKEN, "wr", "cr"), (self.point, *self.stretch, self.length))

    def function(self, name: str, parameters: Sequence[str], results: tuple[Any, ...]) -> Function:
        """Return a function of some results: terms, and tuples of terms."""
        known = self.ready if "ready" in parameters else ()
        places = [p for result in results for p in (result if isinstance(result, tuple) else (result,))]

        def write(writer: Writer) -> graph.Value:
            given = writer.items(writer.names["ready"], len(known)) if known else ()
            values = dict(zip(known, given, strict=True))
            for place in self.needed(places, known):
                values[place] = self.written(writer, place, values)

            def tupled(result: Any) -> graph.Value:
                return (
                    writer.add("tuple", *map(tupled, result)) if isinstance(result, tuple) else values[result]
                )

            return tupled(results)

        return written(name, parameters, identified(self.identity, name), write)

    def written(self, writer: Writer, place: int, values: Mapping[int, graph.Value]) -> graph.Value:
        """Write a term."""
        op, operands, data = self.terms[place]
        if op == "constant":
            return writer.constant(data)
        if op != "input":
            return writer.add(op, *(values[operand] for operand in operands))
        if isinstance(data, tuple):
            return reduce(lambda whole, k: writer.add("element", whole, k), data, writer.names["v"])
        if data in ("wr", "cr"):
            return writer.names[data]
        return writer.items(writer.names[data[0]], 3)["xyz".index(data[1])]


TAKEN = ("w", "c", "v", "ready")
"""Arguments of the functions of a step."""

Value = Any
"""Scalar, Vector or tuple of these."""


def trace(function: Callable[..., Any], parameters: Mapping[str, int], fixed: Mapping[str, Any]) -> Step:
    """Follow the graph of a step; `parameters`: numbers of components of its other arguments, in order."""
    tape = Tape()
    env: dict[str, Value] = {"w": tape.variable("w", 0), "c": tape.variable("c", 3)}
    env |= {name: _argument(tape, k, size) for k, (name, size) in enumerate(parameters.items())}
    names = language.parameters(function)
    if names[:2] != ["w", "c"] or {*names[2:]} != {*parameters, *fixed}:
        line = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted = ", ".join(("w", "c", *parameters, *fixed))
        raise KernelError(f"{line}: step {function.__name__}: expected the arguments {wanted}")
    step = step_function(function, parameters, fixed)
    value = _Follower(tape)(step, *(env[name] for name in step.parameters))
    declared = value[1] if isinstance(value, tuple) and len(value) == 2 else None
    vector = _vector(value if declared is None else value[0], function)
    by_w, by_c = map(tape.or_zero, vector.stretch or tape.norms(vector))
    majorant = vector.majorant and (tape.or_zero(vector.majorant[0]), vector.majorant[1])
    point = tuple(part.term for part in vector.parts)
    stretch = by_w if declared is None else declared.term, by_c
    return Step(tuple(tape.terms), point, stretch, majorant, vector.length)


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


def _argument(tape: Tape, place: int, size: int) -> Value:
    """Argument of a step: a number, a point or a tuple of numbers."""
    if size == 1:
        return Scalar(tape.add("input", data=(place,)))
    parts = tuple(Scalar(tape.add("input", data=(place, k))) for k in range(size))
    return Vector3(parts, (None, None)) if size == 3 else parts  # type: ignore[arg-type]


class _Count(int):
    """Counter of a loop."""


class _Follower(graph.Evaluator):
    """Follows graphs onto a tape: values are scalars, vectors and tuples of these."""

    def __init__(self, tape: Tape) -> None:
        super().__init__({})
        self.tape = tape

    def __call__(self, function: graph.Function, *given: Any) -> Any:
        value = super().__call__(function, *given)
        return self.constants(value) if isinstance(value, float) else value

    def decide(self, value: Any) -> bool:
        if isinstance(value, (bool, tuple)):
            return bool(value)
        number = self.tape.value(value.term) if isinstance(value, Scalar) else None
        if number is None:
            raise MismatchError("expected a condition on constants")
        return number != 0

    def evaluate(self, value: graph.Value, given: list[Any]) -> Any:
        op = value.op
        if op == "index" or (given and all(isinstance(v, _Count) for v in given)):
            return self.counted(op, given, value.data)
        parts = [self.constants(v) if isinstance(v, (int, float)) else v for v in given]
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
            return _Count(self.number(number) if isinstance(number, Scalar) else number)
        made = getattr(operator, op)(*given)
        return made if isinstance(made, bool) else _Count(made)

    def part(self, given: list[Any], data: tuple[int, int] | None) -> Any:
        """A part of a point or of a tuple."""
        whole = given[0].parts if isinstance(given[0], Vector3) else given[0]
        if not isinstance(whole, tuple) or (data and len(whole) != data[1]):
            raise MismatchError(f"expected {data[1] if data else 'several'} values")
        return whole[data[0] if data else int(self.number(given[1]))]

    def number(self, value: Value) -> float:
        """Number that a value is known to be; NaN if it is not known."""
        number = self.tape.value(value.term) if isinstance(value, Scalar) else None
        return nan if number is None else number

    def constants(self, value: Any) -> Value:
        """Numbers from outside a step."""
        if not isinstance(value, tuple):
            return Scalar(self.tape.number(float(value)))
        parts = tuple(map(self.constants, value))
        return Vector3(parts, (None, None)) if _is_triple(parts) else parts

    # --- arithmetic ---
    def operator(self, op: str, a: Value, b: Value | None = None) -> Value:
        if op == "neg":
            return self.product(Scalar(self.tape.number(-1.0)), a)
        assert b is not None
        if op in DECIDING:
            if not (isinstance(a, Scalar) and isinstance(b, Scalar)):
                raise MismatchError("expected numbers, found a point; x, y, z = w gives its coordinates")
            return Scalar(self.tape.add(op, a.term, b.term))
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
        sign = 1 if op == "add" else -1
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
        stretch = before and tuple(self.tape.times(factor.term, s) for s in before)
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
            parts = tuple(self.intrinsic(name, [given[0], p, q]) for p, q in pairs)
            return Vector3(parts, self.stretch_chosen(*given))
        if not all(isinstance(v, Scalar) for v in given):
            raise MismatchError("expected numbers, found a point")
        return self.tape.intrinsic(name, given)

    def stretch_chosen(self, mask: Value, first: Vector3, second: Vector3) -> Stretch | None:
        """Stretch of the one of two points that is taken, where both are known."""
        if first.stretch is None or second.stretch is None or not isinstance(mask, Scalar):
            return None
        by_w, by_c = (
            self.tape.chosen(mask.term, a, b) for a, b in zip(first.stretch, second.stretch, strict=True)
        )
        return by_w, by_c

    def majorant(self, verb: Verb, given: list[Value]) -> Majorant | None:
        """Majorant of a verb's image."""
        if verb.function in RIGID:
            return self.tape.after(given[0], (None, None))
        if verb.function not in MAJORANTS:
            return None
        bend, tear = self.followed(MAJORANTS[verb.function], verb.values(given))
        return self.tape.after(given[0], (bend.term, None if self.tape.value(tear.term) else tear.term))

    def length(self, verb: Verb, given: list[Value]) -> int | None:
        """Length of a verb's image, from that of its point."""
        before = given[0].length
        if before is None or verb.function in CENTRAL:
            return cast("int | None", before)
        if verb.function not in LENGTHS:
            return None
        values = verb.values([Scalar(before), *given[1:]])
        return cast("int", self.followed(LENGTHS[verb.function], values).term)


DECIDING = graph.COMPARISONS | {"and_", "or_"}
"""Comparisons and conjunctions."""


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
