"""Steps of orbits as straight-line code, with their stretch.

A step maps a point w and a constant c to the next point. Its text is followed once, onto a `Tape` with the
derivatives by w and by c. The stretch of the step is the one that verbs, sums and constant factors are known
to keep; where they do not, it is a bound of the norm of the Jacobian.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from types import FunctionType
from typing import Any, NoReturn, cast

from ..errors import KernelError
from ..formulas.fixed import EVALUATED
from ..formulas.verbs import CENTRAL, LENGTHS, MAJORANTS, RIGID
from . import functions, language
from .parsing import parse_expression
from .source import specialised
from .straight_line import Step, named
from .tape import DERIVATIVES, Majorant, Scalar, Stretch, Tape, Vector3, as_number

Value = Any
"""Scalar, Vector or tuple of these."""


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
    tape = Tape(f"s{place}_")
    constant = tape.variable(f"cx{place} cy{place} cz{place}", 3, f"rc{place}")
    env: dict[str, Value] = {"w": tape.variable("x y z", 0, f"rw{place}"), "c": constant}
    env |= {name: _argument(f"v{place}_{name}", size) for name, size in parameters.items()}
    names = functions.parameters(function)
    if names[:2] != ["w", "c"] or {*names[2:]} != {*parameters, *fixed}:
        line = f"{function.__code__.co_filename}:{function.__code__.co_firstlineno}"
        wanted = ", ".join(("w", "c", *parameters, *fixed))
        raise KernelError(f"{line}: step {function.__name__}: expected the arguments {wanted}")
    value = _followed(function, fixed, env, tape)
    declared = value[1] if isinstance(value, tuple) and len(value) == 2 else None
    vector = _vector(value if declared is None else value[0], function)
    stretch = vector.stretch or tape.norms(vector)
    if declared is not None:
        stretch = declared.atom, stretch[1]
    point = tuple(part.atom for part in vector.parts)
    majorant = vector.majorant and (vector.majorant[0] or "0.0", vector.majorant[1])
    made = Step([], tape.lines, point, (stretch[0] or "0.0", stretch[1] or "0.0"), majorant)  # type: ignore[arg-type]
    own = made.needed(*made.point, *made.stretch)
    before, lines = _divided(own)
    bending, measuring = (
        tuple(line for line in made.needed(*filter(None, names)) if line not in own)
        for names in (majorant or (), (vector.length,))
    )
    return replace(
        made, before=before, lines=lines, bending=bending, length=vector.length, measuring=measuring
    )


def _argument(name: str, size: int) -> Value:
    """Argument of a step: a number, a point or a tuple of numbers."""
    if size == 1:
        return Scalar(name)
    parts = tuple(Scalar(f"{name}_{k}") for k in range(size))
    return Vector3(parts, (None, None)) if size == 3 else parts  # type: ignore[arg-type]


def _divided(lines: Sequence[str]) -> tuple[list[str], list[str]]:
    """Assignments that do not depend on the point x, y, z, and the others."""
    before: list[str] = []
    others: list[str] = []
    changing = {"x", "y", "z"}
    for line in lines:
        target, value = line.split(" = ", 1)
        changes = not changing.isdisjoint(named(value))
        (others if changes else before).append(line)
        changing |= {target} if changes else set()
    return before, others


def _followed(
    function: Callable[..., Any], fixed: Mapping[str, Any], env: dict[str, Value], tape: Tape
) -> Value:
    """Follow the statements of a function; return its value."""
    scope, code = functions.scope(function), function.__code__
    loops = {n: v for n, v in scope.items() if n in code.co_names and isinstance(v, tuple)}
    tuples = {n: v for n, v in loops.items() if functions.is_number(v)}
    place = f"{code.co_filename}:{code.co_firstlineno}: step {function.__name__}: "
    return _Reader(tape, env, scope, place).run(specialised(function, {**tuples, **fixed}).body)


@dataclass
class _Reader:
    """Follows the statements of one function."""

    tape: Tape
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
        return value.parts if isinstance(value, Vector3) else value

    def known(self, test: ast.expr) -> bool:
        """Truth of a condition that is known here."""
        value = self.value(test)
        if isinstance(value, tuple):
            return bool(value)
        number = as_number(value.atom) if isinstance(value, Scalar) else None
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
            case ast.Name(name) if functions.is_number(self.scope.get(name)):
                return _constants(self.scope[name])
            case ast.Tuple(elements):
                parts = tuple(map(self.value, elements))
                return Vector3(parts, _constant_stretch(parts)) if _is_triple(parts) else parts
            case ast.UnaryOp(ast.USub(), operand):
                return self.product(Scalar("-1.0"), self.value(operand), node)
            case ast.BinOp(left, op, right):
                return self.binary(op, self.value(left), self.value(right), node)
            case ast.Compare(left, [op], [right]):
                a, b = self.scalars(node, left, right)
                return Scalar(str(self.tape.name(ast.unparse(ast.Compare(_n(a), [op], [_n(b)])))))
            case ast.Subscript(place, ast.Constant(int(k))):
                value = self.value(place)
                return (value.parts if isinstance(value, Vector3) else value)[k]
            case ast.Call(ast.Name(name), arguments):
                return self.call(name, [self.value(a) for a in arguments], node)
        self.fail(node, "it is not in the language of steps")

    def scalars(self, node: ast.AST, *parts: ast.expr) -> list[Scalar]:
        values = [self.value(part) for part in parts]
        if not all(isinstance(v, Scalar) for v in values):
            self.fail(node, "expected numbers, found a point; x, y, z = w gives its coordinates")
        return values

    # --- arithmetic ---
    def binary(self, op: ast.operator, a: Value, b: Value, node: ast.AST) -> Value:
        if isinstance(op, ast.Mult):
            return self.product(a, b, node)
        if isinstance(op, ast.Div):
            if not isinstance(b, Scalar):
                self.fail(node, "expected a number to divide by")
            return self.product(self.tape.inverse(b), a, node)
        if isinstance(op, (ast.BitAnd, ast.BitOr)):
            sign = "&" if isinstance(op, ast.BitAnd) else "|"
            return Scalar(str(self.tape.name(f"{a.atom} {sign} {b.atom}")))
        if not isinstance(op, (ast.Add, ast.Sub)):
            self.fail(node, "expected +, -, * or /")
        if isinstance(b, Vector3) != isinstance(a, Vector3):
            self.fail(node, "expected two points or two numbers")
        sign = "+" if isinstance(op, ast.Add) else "-"
        if isinstance(a, Scalar):
            return self.tape.sum(a, b, sign)
        return self.tape.vector_sum(a, b, sign)

    def product(self, a: Value, b: Value, node: ast.AST) -> Value:
        if isinstance(a, Vector3):
            a, b = b, a
        if not isinstance(a, Scalar) or not isinstance(b, (Scalar, Vector3)):
            self.fail(node, "expected a number as one of the factors")
        return self.tape.product(a, b) if isinstance(b, Scalar) else self.tape.scaled(a, b)

    # --- calls ---
    def call(self, name: str, given: list[Value], node: ast.AST) -> Value:
        function = self.scope.get(name)
        if function in EVALUATED:
            return _constants(function(*map(_number, given)))
        if name not in language.INTRINSICS and isinstance(function, FunctionType):
            names = functions.parameters(function)
            if len(names) != len(given):
                self.fail(node, f"{name} takes {len(names)} values, found {len(given)}")
            value = _followed(function, {}, dict(zip(names, given, strict=True)), self.tape)
            if not (isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], Vector3)):
                return value
            if not isinstance(given[0], Vector3):
                self.fail(node, "expected a point first")
            (image, factor), before = value, given[0].stretch
            stretch = before and tuple(self.tape.times(factor.atom, s) for s in before)
            length = self.length(function, given)
            return Vector3(image.parts, stretch, self.majorant(function, given), length)  # type: ignore[arg-type]
        if name not in DERIVATIVES and name != "where":
            self.fail(node, f"{name!r} is not in the language of steps")
        if name == "where" and isinstance(given[1], Vector3) and isinstance(given[2], Vector3):
            pairs = zip(given[1].parts, given[2].parts, strict=True)
            return Vector3(tuple(self.call(name, [given[0], p, q], node) for p, q in pairs))
        if not all(isinstance(v, Scalar) for v in given):
            self.fail(node, "expected numbers, found a point")
        return self.tape.intrinsic(name, given)

    def majorant(self, verb: Callable[..., Any], given: list[Value]) -> Majorant | None:
        """Majorant of a verb's image."""
        if verb in RIGID:
            return self.tape.after(given[0], (None, None))
        if verb not in MAJORANTS:
            return None
        own = dict(zip(functions.parameters(verb), given, strict=True))
        bend, tear = _followed(MAJORANTS[verb], {}, own, self.tape)
        return self.tape.after(given[0], (bend.atom, None if as_number(tear.atom) else tear.atom))

    def length(self, verb: Callable[..., Any], given: list[Value]) -> str | None:
        """Length of a verb's image, from that of its point."""
        before = given[0].length
        if before is None or verb in CENTRAL:
            return cast("str | None", before)
        if verb not in LENGTHS:
            return None
        own = dict(zip(functions.parameters(LENGTHS[verb]), [Scalar(before), *given[1:]], strict=True))
        return cast("str", _followed(LENGTHS[verb], {}, own, self.tape).atom)


def _n(value: Scalar) -> ast.expr:
    return parse_expression(value.atom)


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
