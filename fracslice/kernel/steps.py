"""Steps of orbits as straight-line code, with their stretch.

A step maps a point w and a constant c to the next point. Its text is followed once, with every number as an
expression and its three derivatives by w and three by c (forward mode: Wengert 1964, "A simple automatic
derivative evaluation program"). A vector also carries its stretch as far as verbs, sums and constant factors
are known to keep it; where they do not, the stretch is a bound of the norm of the Jacobian.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import FunctionType
from typing import Any, NoReturn

from ..errors import KernelError
from . import language
from .source import specialised

Slopes = tuple[str | None, ...]
"""Derivatives by w (three) and by c (three); None is zero."""

FLAT: Slopes = (None,) * 6


@dataclass(frozen=True)
class Scalar:
    """Expression that is a name or a number, and its derivatives."""

    atom: str
    slopes: Slopes = FLAT

    @property
    def constant(self) -> bool:
        """True if it depends on neither w nor c."""
        return self.slopes == FLAT


Stretch = tuple[str | None, str | None]
"""Stretch by w and by c; None is zero."""


@dataclass(frozen=True)
class Vector:
    """Three scalars, and the stretch if it is known."""

    parts: tuple[Scalar, Scalar, Scalar]
    stretch: Stretch | None = None


Value = Any
"""Scalar, Vector or tuple of these."""


@dataclass
class Step:
    """Code of a step.

    Attributes
    ----------
    lines
        Assignments.
    point
        Expressions of the next point.
    stretch
        Expressions of the stretch by w and by c.
    """

    lines: list[str]
    point: tuple[str, str, str]
    stretch: tuple[str, str]


def traced(
    function: Callable[..., Any], parameters: Mapping[str, int], fixed: Mapping[str, Any], place: int = 0
) -> Step:
    """Follow the text of a step.

    Parameters
    ----------
    function
        Step ``f(w, c, ...)``.
    parameters
        Number of components of each argument after w and c.
    fixed
        Values of the arguments that are constants of the code.
    place
        Place of the step in the round, part of all names but x, y and z.

    Returns
    -------
    Step
        Code in terms of x, y, z, of cx0, cy0, cz0 and of the arguments, such as v0_scale, for place 0.

    Raises
    ------
    KernelError
        If the function is not in the language of steps.
    """
    trace = _Trace(f"s{place}_")
    env: dict[str, Value] = {"w": trace.variable("x y z", 0), "c": trace.variable(f"cx{place} cy{place} cz{place}", 3)}
    for name, size in parameters.items():
        parts = tuple(Scalar(f"v{place}_{name}_{k}") for k in range(size))
        env[name] = Scalar(f"v{place}_{name}") if size == 1 else Vector(parts, (None, None)) if size == 3 else parts  # type: ignore[arg-type]
    names = language.parameters(function)
    if names[:2] != ["w", "c"] or {*names[2:]} != {*parameters, *fixed}:
        line = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted = ", ".join(("w", "c", *parameters, *fixed))
        raise KernelError(f"{line}: step {function.__name__}: expected the arguments {wanted}")
    found = trace.body(function, fixed, env)
    declared = found[1] if isinstance(found, tuple) and len(found) == 2 else None
    vector = _vector(found if declared is None else found[0], function)
    stretch = vector.stretch or trace.norms(vector)
    if declared is not None:
        stretch = declared.atom, stretch[1]
    point = tuple(part.atom for part in vector.parts)
    lines = _used(trace.lines, {*point, *filter(None, stretch)})
    return Step(lines, point, (stretch[0] or "0.0", stretch[1] or "0.0"))  # type: ignore[arg-type]


def _used(lines: Sequence[str], wanted: set[str]) -> list[str]:
    """Assignments that the wanted names depend on."""
    kept, live = [], set(wanted)
    for line in reversed(lines):
        target, value = line.split(" = ", 1)
        if target in live:
            live |= {n.id for n in ast.walk(ast.parse(value)) if isinstance(n, ast.Name)}
            kept.append(line)
    return kept[::-1]


@dataclass
class _Trace:
    prefix: str
    lines: list[str] = field(default_factory=list)
    known: dict[str, str] = field(default_factory=dict)

    def variable(self, names: str, first: int) -> Vector:
        parts = [
            Scalar(name, tuple("1.0" if i == first + k else None for i in range(6)))
            for k, name in enumerate(names.split())
        ]
        return Vector(tuple(parts), (None, "1.0") if first else ("1.0", None))  # type: ignore[arg-type]

    # --- expressions as text ---
    def name(self, code: str | None) -> str | None:
        """Name of an expression; equal expressions have one."""
        if code is None or code.isidentifier() or _number(code) is not None:
            return code
        if code not in self.known:
            self.known[code] = f"{self.prefix}{len(self.known)}"
            self.lines.append(f"{self.known[code]} = {code}")
        return self.known[code]

    def times(self, a: str | None, b: str | None) -> str | None:
        """Product of two expressions."""
        if a is None or b is None:
            return None
        if _number(a) == 1 or _number(b) == 1:
            return b if _number(a) == 1 else a
        return self.name(f"{a} * {b}")

    def plus(self, a: str | None, b: str | None, sign: str = "+") -> str | None:
        """Sum or difference of two expressions."""
        if b is None:
            return a
        return self.name(f"{a} {sign} {b}" if a is not None else b if sign == "+" else f"-{b}")

    def scalar(self, code: str, *slopes: tuple[str | None, Scalar]) -> Scalar:
        """Scalar of an expression, with factors of the derivatives of others."""
        total: list[str | None] = [None] * 6
        for factor, of in slopes:
            total = [self.plus(t, self.times(factor, s)) for t, s in zip(total, of.slopes, strict=True)]
        return Scalar(str(self.name(code)), tuple(total))

    # --- the text of functions ---
    def body(self, function: Callable[..., Any], fixed: Mapping[str, Any], env: dict[str, Value]) -> Value:
        """Follow the statements of a function; return what it returns."""
        scope, code = language.scope(function), function.__code__
        loops = {n: v for n, v in scope.items() if n in code.co_names and isinstance(v, tuple)}
        tuples = {n: v for n, v in loops.items() if language.is_number(v)}
        place = f"{code.co_filename}:{code.co_firstlineno}: step {function.__name__}: "
        return _Reader(self, env, scope, place).run(specialised(function, {**tuples, **fixed}).body)

    def norms(self, vector: Vector) -> Stretch:
        """Bounds of the norms of the Jacobians by w and by c."""
        rows = [part.slopes for part in vector.parts]
        return self.norm([r[:3] for r in rows]), self.norm([r[3:] for r in rows])

    def norm(self, rows: Sequence[Slopes]) -> str | None:
        """Bound of the norm of a matrix.

        The largest eigenvalue of J J^T is at most its mean plus sqrt(2) deviations (Wolkowicz and Styan 1980,
        "Bounds for eigenvalues using traces"), which is exact for similarities and for rank one.
        """
        if all(entry is None for row in rows for entry in row):
            return None
        if all(_number(rows[i][k] or "0") == (i == k) for i in range(3) for k in range(3)):
            return "1.0"
        gram = {(i, k): self.dot(rows[i], rows[k]) for i in range(3) for k in range(i, 3)}
        trace = self.plus(self.plus(gram[0, 0], gram[1, 1]), gram[2, 2])
        mean = self.name(f"minimum(maximum({trace} * 0.3333333333333333, 1e-30), 1e30)")
        inverse = self.name(f"ratio(1.0, {mean})")
        spread: str | None = None
        for (i, k), entry in gram.items():
            part = self.times(entry, inverse)
            part = self.plus(part or "0.0", "1.0", "-") if i == k else part
            square = self.times(part, part)
            spread = self.plus(spread, square if i == k else self.times("2.0", square))
        return self.name(f"sqrt({mean} * (1.0 + sqrt(minimum(0.6666666666666666 * {spread}, 4.0))))")

    def dot(self, a: Slopes, b: Slopes) -> str | None:
        total: str | None = None
        for x, y in zip(a, b, strict=True):
            total = self.plus(total, self.times(x, y))
        return total


@dataclass
class _Reader:
    """Follows the statements of one function."""

    trace: _Trace
    env: dict[str, Value]
    scope: Mapping[str, Any]
    place: str

    def fail(self, node: ast.AST, message: str) -> NoReturn:
        raise KernelError(f"{self.place}{ast.unparse(node)!r}: {message}")

    def run(self, body: Sequence[ast.stmt]) -> Value:
        for statement in body:
            match statement:
                case ast.Assign([target], value):
                    self.assign(target, self.value(value))
                case ast.For(ast.Name(counter), ast.Call(ast.Name("range"), [ast.Constant(int(n))]), inner):
                    for k in range(n):
                        self.env[counter] = Scalar(repr(float(k)))
                        self.run(inner)
                case ast.For(target, ast.Name(name), inner) if name in self.env:
                    for value in self.elements(self.env[name]):
                        self.assign(target, value)
                        self.run(inner)
                case ast.If(test, body, others):
                    self.run(body if self.known(test) else others)
                case ast.Return(ast.expr() as value):
                    return self.value(value)
                case _:
                    self.fail(statement, "expected assignments, loops over constants and a return")
        return None

    def elements(self, value: Value) -> tuple[Value, ...]:
        return value.parts if isinstance(value, Vector) else value

    def known(self, test: ast.expr) -> bool:
        """Truth of a condition that is known here."""
        value = self.value(test)
        number = _number(value.atom) if isinstance(value, Scalar) else None
        if number is None:
            self.fail(test, "expected a condition on constants")
        return number != 0

    def assign(self, target: ast.expr, value: Value) -> None:
        match target:
            case ast.Name(name):
                self.env[name] = value
            case ast.Tuple(targets):
                parts = self.elements(value)
                if not isinstance(parts, tuple) or len(parts) != len(targets):
                    self.fail(target, f"expected {len(targets)} values")
                for one, part in zip(targets, parts, strict=True):
                    self.assign(one, part)
            case _:
                self.fail(target, "expected a name to assign to")

    def value(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(int() | float() as number):
                return Scalar(repr(float(number)))
            case ast.Name(name) if name in self.env:
                return self.env[name]
            case ast.Name(name) if language.is_number(self.scope.get(name)):
                return _constants(self.scope[name])
            case ast.Tuple(elements):
                parts = tuple(map(self.value, elements))
                return Vector(parts, _constant_stretch(parts)) if _is_triple(parts) else parts
            case ast.UnaryOp(ast.USub(), operand):
                return self.product(Scalar("-1.0"), self.value(operand), node)
            case ast.BinOp(left, op, right):
                return self.binary(op, self.value(left), self.value(right), node)
            case ast.Compare(left, [op], [right]):
                a, b = self.scalars(node, left, right)
                return Scalar(str(self.trace.name(ast.unparse(ast.Compare(_n(a), [op], [_n(b)])))))
            case ast.Subscript(place, ast.Constant(int(k))):
                value = self.value(place)
                return (value.parts if isinstance(value, Vector) else value)[k]
            case ast.Call(ast.Name(name), arguments):
                return self.call(name, [self.value(a) for a in arguments], node)
        self.fail(node, "it is not in the language of steps")

    def scalars(self, node: ast.AST, *parts: ast.expr) -> list[Scalar]:
        values = [self.value(part) for part in parts]
        if not all(isinstance(v, Scalar) for v in values):
            self.fail(node, "expected numbers, found a point; x, y, z = w takes it apart")
        return values

    # --- arithmetic ---
    def binary(self, op: ast.operator, a: Value, b: Value, node: ast.AST) -> Value:
        if isinstance(op, ast.Mult):
            return self.product(a, b, node)
        if isinstance(op, ast.Div):
            if not isinstance(b, Scalar):
                self.fail(node, "expected a number to divide by")
            return self.product(self.inverse(b), a, node)
        if isinstance(op, (ast.BitAnd, ast.BitOr)):
            return Scalar(
                str(self.trace.name(f"{a.atom} {'&' if isinstance(op, ast.BitAnd) else '|'} {b.atom}"))
            )
        if not isinstance(op, (ast.Add, ast.Sub)):
            self.fail(node, "expected +, -, * or /")
        if isinstance(b, Vector) != isinstance(a, Vector):
            self.fail(node, "expected two points or two numbers")
        sign = "+" if isinstance(op, ast.Add) else "-"
        if isinstance(a, Scalar):
            return self.sum(a, b, sign)
        stretch = a.stretch and b.stretch and self.sums(a.stretch, b.stretch)
        return Vector(tuple(self.sum(p, q, sign) for p, q in zip(a.parts, b.parts, strict=True)), stretch)  # type: ignore[arg-type]

    def sum(self, a: Scalar, b: Scalar, sign: str) -> Scalar:
        trace = self.trace
        slopes = [trace.plus(x, y, sign) for x, y in zip(a.slopes, b.slopes, strict=True)]
        return Scalar(str(trace.plus(a.atom, b.atom, sign)), tuple(slopes))

    def sums(self, a: Stretch, b: Stretch) -> Stretch:
        return self.trace.plus(a[0], b[0]), self.trace.plus(a[1], b[1])

    def product(self, a: Value, b: Value, node: ast.AST) -> Value:
        trace = self.trace
        if isinstance(a, Vector):
            a, b = b, a
        if not isinstance(a, Scalar) or not isinstance(b, (Scalar, Vector)):
            self.fail(node, "expected a number as one of the factors")
        if isinstance(b, Scalar):
            product = Scalar(str(trace.times(a.atom, b.atom)))
            slopes = trace.scalar(product.atom, (b.atom, a), (a.atom, b)).slopes
            return Scalar(product.atom, slopes)
        stretch = None
        if a.constant and b.stretch:
            number = _number(a.atom)
            size = trace.name(f"absolute({a.atom})" if number is None else repr(abs(number)))
            stretch = trace.times(size, b.stretch[0]), trace.times(size, b.stretch[1])
        return Vector(tuple(self.product(a, part, node) for part in b.parts), stretch)

    def inverse(self, b: Scalar) -> Scalar:
        number = _number(b.atom)
        if number:
            return Scalar(repr(1.0 / number))
        over = str(self.trace.name(f"ratio(1.0, {b.atom})"))
        return self.trace.scalar(over, (self.trace.name(f"-{over} * {over}") if not b.constant else None, b))

    # --- calls ---
    def call(self, name: str, given: list[Value], node: ast.AST) -> Value:
        function = self.scope.get(name)
        if name not in language.INTRINSICS and isinstance(function, FunctionType):
            names = language.parameters(function)
            if len(names) != len(given):
                self.fail(node, f"{name} takes {len(names)} values, found {len(given)}")
            found = self.trace.body(function, {}, dict(zip(names, given, strict=True)))
            if not (isinstance(found, tuple) and len(found) == 2 and isinstance(found[0], Vector)):
                return found
            if not isinstance(given[0], Vector):
                self.fail(node, "expected a point first")
            (image, factor), before = found, given[0].stretch
            return Vector(image.parts, before and tuple(self.trace.times(factor.atom, s) for s in before))  # type: ignore[arg-type]
        if name not in _DERIVATIVES and name != "where":
            self.fail(node, f"{name!r} is not in the language of steps")
        if name == "where" and isinstance(given[1], Vector) and isinstance(given[2], Vector):
            pairs = zip(given[1].parts, given[2].parts, strict=True)
            return Vector(tuple(self.call(name, [given[0], p, q], node) for p, q in pairs))
        if not all(isinstance(v, Scalar) for v in given):
            self.fail(node, "expected numbers, found a point")
        return self.intrinsic(name, given)

    def intrinsic(self, name: str, given: list[Scalar]) -> Scalar:
        trace, atoms = self.trace, [v.atom for v in given]
        result = str(trace.name(f"{name}({', '.join(atoms)})"))
        if all(v.constant for v in given):
            return Scalar(result)
        if name in ("minimum", "maximum", "where"):
            test = (
                atoms[0] if name == "where" else f"{atoms[0]} {'<' if name == 'minimum' else '>'} {atoms[1]}"
            )
            mask = trace.name(test)
            pairs = zip(given[-2].slopes, given[-1].slopes, strict=True)
            chosen = [self.chosen(mask, a, b) for a, b in pairs]
            return Scalar(result, tuple(chosen))
        places = dict(zip("abc", atoms, strict=False)) | {"r": result}
        factors = [
            (trace.name(_filled(text, places)) if text and not of.constant else None, of)
            for text, of in zip(_DERIVATIVES[name], given, strict=True)
        ]
        return trace.scalar(result, *factors)

    def chosen(self, mask: str | None, a: str | None, b: str | None) -> str | None:
        return a if a == b else self.trace.name(f"where({mask}, {a or '0.0'}, {b or '0.0'})")


_DERIVATIVES: dict[str, tuple[str, ...]] = {
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
    tree = ast.parse(text, mode="eval")
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id in places:
            node.id = places[node.id]
    return ast.unparse(tree)


def _n(value: Scalar) -> ast.expr:
    return ast.parse(value.atom, mode="eval").body


def _vector(value: Value, function: Callable[..., Any]) -> Vector:
    """Vector that a step returns."""
    if isinstance(value, Vector):
        return value
    if not _is_triple(value):
        place = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        raise KernelError(f"{place}: step {function.__name__}: expected it to return a point")
    return Vector(value)


def _is_triple(value: Value) -> bool:
    return isinstance(value, tuple) and len(value) == 3 and all(isinstance(v, Scalar) for v in value)


def _constant_stretch(parts: tuple[Scalar, ...]) -> Stretch | None:
    return (None, None) if all(part.constant for part in parts) else None


def _constants(value: Any) -> Value:
    """Numbers from outside a step."""
    if not isinstance(value, tuple):
        return Scalar(repr(float(value)))
    parts = tuple(map(_constants, value))
    return Vector(parts, (None, None)) if _is_triple(parts) else parts


def _number(code: str) -> float | None:
    try:
        return float(code)
    except ValueError:
        return None
