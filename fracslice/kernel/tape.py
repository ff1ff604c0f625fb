"""Arithmetic as straight-line code, with its derivatives in forward mode.

Every number is an expression with three derivatives by a point w and three by a constant c (Wengert 1964,
"A simple automatic derivative evaluation program"). A vector also carries its stretch as far as sums and
constant factors are known to keep it.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite

from . import polynomials
from .parsing import parse_expression

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
"""Bend by w (`formulas.escape.sure_distance`), and distance to the nearest tear; None is none."""


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
    """Assignments, one for each expression.

    Attributes
    ----------
    prefix
        Prefix of the assigned names.
    lines
        Assignments.
    names
        Names by expression.
    expressions
        Expressions by name.
    """

    prefix: str
    lines: list[str] = field(default_factory=list)
    names: dict[str, str] = field(default_factory=dict)
    expressions: dict[str, str] = field(default_factory=dict)

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
        terms = polynomials.dot(a, b, self.expressions.get)
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
