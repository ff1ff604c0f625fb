"""Steps of formulas of Mandelbulber, written as the text of a `<define>`.

A formula is a function of a `FormulaStep`, which takes the values of its section and writes statements. A
value becomes a parameter of the definition with the name that Mandelbulber has for it, so that the scene can
be changed by names that its author knows. What does nothing with its value is left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ...fields.definitions import is_name
from .settings import SettingsSection, Triple

X, Y, Z = "(1, 0, 0)", "(0, 1, 0)", "(0, 0, 1)"

ADDED, LEFT_OUT, OWN, SWAPPED = "added", "left out", "own", "swapped"
"""What becomes of the constant after a formula: it is added unless the file says not to, it is added only if
the file says so, the formula has taken it itself, or it is added with x and y swapped unless the file says
not to.
"""

ORDERS = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")
"""Words for orders of coordinates."""

SQUARE, CYLINDER = "x * x + y * y + z * z", "x * x + y * y"
"""Squares of the distance to the origin, and to the z axis."""

SMALL = 1e-9
"""Least radius within which the fold of a ball only scales."""


RADIUS, OWN_SOLID, KLEINIAN, JOS, FOUR = "radius", "own", "kleinian", "jos", "four"
"""What the last point of an orbit, or each, is measured with: its radius, a distance of its formula's own,
those of two families of Kleinian groups, or the radius in four dimensions.
"""


class UnknownError(Exception):
    """A formula, or a variant of one, that is not known here; the message is what is not."""


@dataclass(frozen=True)
class Element:
    """An element of ours that is the whole step."""

    name: str
    values: tuple[tuple[str, Any], ...]


@dataclass
class FormulaStep:
    """Step of a formula at one iteration; `w` is the point, and `c` the constant."""

    values: SettingsSection
    index: int = 0  # number of the iteration, from 0
    state: dict[str, float] = field(default_factory=dict)  # numbers that change from iteration to iteration
    symmetric: bool = False  # True if the sign of no coordinate matters after it
    lines: list[str] = field(default_factory=list)
    parameters: dict[str, float | Triple] = field(default_factory=dict)
    element: Element | None = None
    constant: str = "c"  # the constant where a formula adds it itself
    solid: MeasuredSolid | None = None  # what the formula measures the distance to

    def measure(
        self, first: bool = False, last: bool = False, thin: bool = False, slope: float = 1.0
    ) -> FormulaStep:
        """Begin the text of the formula's own distance, of x, y and z, and return it; see `MeasuredSolid`."""
        inner = FormulaStep(self.values, self.index)
        self.solid = MeasuredSolid(inner, first, last, thin, slope)
        return inner

    def write(self, *lines: str) -> None:
        """Add statements."""
        self.lines += lines

    def value(self, name: str) -> float:
        """Number of the file."""
        return self.values.number(name)

    def vector(self, name: str) -> Triple:
        """Three numbers of the file; a fourth is of a coordinate that does not count."""
        if len(self.values.text(name).split()) == 4:
            x, y, z, _ = self.values.numbers(name, 4)
            return x, y, z
        return self.values.vector(name)

    def on(self, name: str) -> bool:
        """Switch of the file; of those whose names end in false, the default is off."""
        return self.values.flag(name)

    def during(self, start: str, stop: str) -> bool:
        """True in iterations from one number on and before another."""
        return self.values.whole(start) <= self.index < self.values.whole(stop)

    def within(self, letter: str) -> bool:
        """True in the iterations of a letter."""
        own = f"_{letter}" if letter else ""
        return self.during(f"transf_start_iterations{own}", f"transf_stop_iterations{own}")

    def refuse(self, *names: str) -> None:
        """Raise an error if one of these switches, which are not known here, is on."""
        for name in names:
            if self.on(name):
                raise UnknownError(f"{self.values.place(name)}: {name}")

    def refuse_values(self, *names: str) -> None:
        """Raise an error unless these numbers and vectors, which are not known here, are 0."""
        for name in names:
            if any(float(word) for word in self.values.text(name).replace(",", ".").split()):
                raise UnknownError(f"{self.values.place(name)}: {name} {self.values.text(name)}")

    def known_as(self, name: str, *values: str) -> None:
        """Raise an error unless a choice has one of these values."""
        if self.values.text(name) not in values:
            raise UnknownError(f"{self.values.place(name)}: {name} {self.values.text(name)}")

    def parameter(self, name: str, value: float | Triple) -> str:
        """Name of a parameter of the definition."""
        own = name.lower() if is_name(name.lower()) else f"{name.lower()}_of"
        self.parameters[own] = value
        return own

    def number(self, name: str) -> str:
        """Parameter with a number of the file."""
        return self.parameter(name, self.value(name))

    def point(self, name: str) -> str:
        """Parameter with three numbers of the file."""
        return self.parameter(name, self.vector(name))

    def replace(self, name: str, **values: Any) -> None:
        """Say that an element of ours is this step, without the constant."""
        self.element = Element(name, tuple(values.items()))

    # What many formulas are made of.

    def add(self, name: str, sign: str = "+") -> None:
        """Add a vector."""
        if any(self.vector(name)):
            self.write(f"w = w {sign} {self.point(name)}")

    def scale(self, name: str) -> None:
        """Multiply by a number."""
        if self.value(name) != 1:
            self.write(f"w = {self.number(name)} * w")

    def multiply(self, name: str) -> None:
        """Multiply the coordinates by three numbers."""
        if self.vector(name) != (1, 1, 1):
            a = self.point(name)
            self.write(f"u, v, s = {a}", "x, y, z = w", "w = (u * x, v * y, s * z)")

    def turn(self, name: str, order: str = "xyz", angles: str = "xyz") -> None:
        """Rotate about the axes in an order, by the named components of a vector, in degrees."""
        axes = {"x": X, "y": Y, "z": Z}
        given = dict(zip("xyz", self.vector(name), strict=True))
        for axis, angle in zip(order, angles, strict=True):
            if given[angle]:
                own = self.parameter(f"{name}_{angle}", given[angle])
                self.write(f"w = turn(w, {axes[axis]}, {own})")

    def fold(self, name: str) -> None:
        """Reflect the coordinates at the limits of a box: |x + a| - |x - a| - x."""
        x, y, z = self.vector(name)
        if min(x, y, z) < 0:
            self.write(f"a, b, d = {self.point(name)}", "x, y, z = w")
            pairs = zip("xyz", "abd", strict=True)
            parts = (f"absolute({p} + {q}) - absolute({p} - {q}) - {p}" for p, q in pairs)
            self.write(f"w = ({', '.join(parts)})")
        elif x == y == z:
            self.write(f"w = fold(w, {self.parameter(name, x)})")
        else:
            self.write(f"w = fold_to(w, {self.point(name)})")

    def fold_flat(self, name: str) -> None:
        """Reflect x and y, not z, at the limits of a box."""
        x, y, _ = self.vector(name)
        a, b = (self.parameter(f"{name}_{axis}", abs(v)) for axis, v in (("x", x), ("y", y)))
        self.write(f"w = fold_to(w, ({a}, {b}, 1e6))")

    def fold_apart(self, limit: str, value: str) -> None:
        """Reflect each coordinate beyond a limit: to a value less it. Space is torn unless that is twice the
        limit.
        """
        self.fold_beyond(limit.removesuffix("_limit"), self.value(limit), self.value(value))

    def fold_beyond(self, name: str, most: float, image: float) -> None:
        """`fold_apart` by numbers."""
        limit = self.parameter(f"{name}_limit", most)
        if image == 2 * most and most > 0:
            self.write(f"w = fold(w, {limit})")
        else:
            self._fold_beyond(limit, self.parameter(f"{name}_value", image))

    def _fold_beyond(self, a: str, b: str) -> None:
        self.write("x, y, z = w")
        for x in "xyz":
            self.write(f"{x} = where({x} > {a}, {b} - {x}, where({x} < -{a}, -{b} - {x}, {x}))")
        self.write("w = (x, y, z)")

    def ball(
        self,
        inner: float,
        outer: float,
        offset: str | None = None,
        scale: str | None = None,
        square: str = SQUARE,
    ) -> None:
        """Invert in a ball what is in it, and scale within the inner radius; both radii are squared. A vector
        is added before and subtracted after, where only the radius is that without it; a scale is in between.
        `square` is the square of the radius where it is another.
        """
        a, b = self.parameter("inner", _root(inner)), self.parameter("outer", _root(outer))
        moved = offset is not None and any(self.vector(offset))
        scaled = scale is not None and self.value(scale) != 1
        if 0 < inner <= outer and not moved and not scaled and square == SQUARE:
            self.write(f"w = ball(w, {a})" if outer == 1 else f"w = {b} * ball(w / {b}, {a} / {b})")
            return
        self.write("x, y, z = w", f"s = {square}", f"t = {b} * {b}", f"m = {a} * {a}")
        ring = "where(s < t, t / maximum(s, 1e-18), 1)" if inner <= outer else "1"
        k = f"where(s < m, t / m, {ring})"
        if scaled and scale is not None:
            k = f"{self.number(scale)} * {k}"
        if moved and offset is not None:
            o = self.point(offset)
            self.write(f"w = {k} * (w + {o}) - {o}")
        else:
            self.write(f"w = {k} * w")

    def square(self, factor: str | None = None) -> None:
        """Square in the Mandelbulb whose angles are counted from the equator, with z turned about."""
        last = "-2 * z * r" if factor is None else f"-2 * {self.number(factor)} * z * r"
        self.write(
            "x, y, z = w",
            "s = maximum(x * x + y * y, 1e-30)",
            "r = sqrt(s)",
            "t = s - z * z",
            f"w = (t * (1 - 2 * y * y / s), t * 2 * x * y / s, {last})",
        )

    def sort(self) -> None:
        """Reflect into the part of space with x >= y >= z."""
        self.write("w = mirror(w, (1, -1, 0))", "w = mirror(w, (1, 0, -1))", "w = mirror(w, (0, 1, -1))")

    def menger(self, scale: str, offset: Triple | str = (1, 1, 1), most: float = 1) -> None:
        """Sort the absolute coordinates, enlarge, and move; z is moved back where it is beyond a number."""
        a, b, d = ("2", "2", "2") if offset == (1, 1, 1) else self.twice(str(offset))
        self.sort()
        self.write(f"w = {self.number(scale)} * w")
        if self.symmetric and d == "2":
            self.write(f"w = w - ({a}, {b}, 1)", f"w = mirror(w, {MINUS_Z}) + {Z}")
        else:
            self.write("x, y, z = w", f"w = (x - {a}, y - {b}, where(z > {most:g}, z - {d}, z))")

    def twice(self, name: str) -> tuple[str, str, str]:
        """Twice the components of a vector, as parameters."""
        x, y, z = (
            self.parameter(f"{name}_{axis}", v) for axis, v in zip("xyz", self.vector(name), strict=True)
        )
        return f"2 * {x}", f"2 * {y}", f"2 * {z}"

    def invert(self, offset: str, scale: str, back: str) -> None:
        """Invert in a sphere about a point, and move by another."""
        self.add(offset)
        radius = self.value(scale)
        if radius <= 0:
            raise UnknownError(f"{self.values.place(scale)}: {scale} {radius:g}")
        self.write(f"w = inversion(w, sqrt({self.number(scale)}))")
        self.add(back)
        self.add(offset, "-")

    def add_constant(self, order: str, factor: str, alternate: str | None = None) -> None:
        """Add the start point, its coordinates in an order, times a vector."""
        if alternate is not None:
            self.refuse(alternate)
        word = ORDERS[0] if order == "" else self.values.one_of(order, ORDERS)
        a, b, d = self.vector(factor)
        if word == "xyz" and a == b == d:
            self.write("w = w + c" if a == 1 else f"w = w + {self.parameter(factor, a)} * c")
            return
        own = self.point(factor)
        x, y, z = (f"c{axis}" for axis in word)
        self.write("cx, cy, cz = c", f"u, v, s = {own}", f"w = w + (u * {x}, v * {y}, s * {z})")


@dataclass(frozen=True)
class MeasuredSolid:
    """Solid that points of an orbit are measured with."""

    step: FormulaStep  # text of its distance
    first: bool = False  # True if it is measured before the step
    last: bool = False  # True if the last point alone counts, else the least of all points
    thin: bool = False  # True if it is a surface, without an inside
    slope: float = 1.0  # Lipschitz bound of the distance; measured where it is not 1


MINUS_Z = "(0, 0, -1)"


def _root(square: float) -> float:
    return math.sqrt(max(square, SMALL * SMALL))


@dataclass(frozen=True)
class KnownFormula:
    """A formula that is known here."""

    number: int
    name: str  # Mandelbulber's
    write: Callable[[FormulaStep], None]
    source: str  # paper or forum, author, year
    constant: str = ADDED
    even: bool = False  # True if it begins with the absolute value of all coordinates
    distance: str = RADIUS  # what it is measured with


FORMULAS: dict[int, KnownFormula] = {}
"""Formulas by their number."""

Writer = Callable[[FormulaStep], None]


def known(
    number: int,
    name: str,
    source: str,
    constant: str = ADDED,
    even: bool = False,
    distance: str = RADIUS,
) -> Callable[[Writer], Writer]:
    """Register a formula."""

    def decorate(write: Writer) -> Writer:
        FORMULAS[number] = KnownFormula(number, name, write, source, constant, even, distance)
        return write

    return decorate
