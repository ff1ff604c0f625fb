"""Types of the values of options."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import click

from fracslice.errors import SceneError


class Name(click.types.StringParamType):
    """Name of a file or folder, with one of some endings."""

    name = "name"

    def __init__(self, metavar: str = "", *endings: str) -> None:
        self.metavar, self.endings = metavar, endings

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        if not value:
            self.fail("expected the name of a file, found nothing", option, context)
        if value == "-":
            self.fail(
                "-: expected the name of a file; standard input and output are not used", option, context
            )
        if self.endings and not value.lower().endswith(self.endings):
            endings = " or ".join(self.endings)
            self.fail(f"{value}: expected a file name that ends in {endings}", option, context)
        return value


class Whole(click.IntRange):
    """A whole number within a range."""

    name, metavar = "whole number", "N"

    def _describe_range(self) -> str:
        return "" if self.min is self.max is None else super()._describe_range()


class Finite(click.types.FloatParamType):
    """A number that is neither infinite nor undefined."""

    name, metavar = "number", "N"

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, option, context)
        if not math.isfinite(number):
            self.fail(f"{value}: expected a finite number", option, context)
        return number


class Signed(Finite):
    """A finite number above zero, or at least zero."""

    def __init__(self, relation: str) -> None:
        self.relation = relation

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> float:
        number = super().convert(value, option, context)
        if number < 0 or (number == 0 and self.relation == ">"):
            self.fail(f"{number:g}: expected a number {self.relation} 0", option, context)
        return number


class Parsed(click.types.StringParamType):
    """A value that a function parses; the message of its `ValueError` names what it expects."""

    name = "text"

    def __init__(self, parse: Callable[[str], Any], metavar: str) -> None:
        self.parse, self.metavar = parse, metavar

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        try:
            return self.parse(value)
        except SceneError as error:
            self.fail(str(error), option, context)
        except ValueError as error:
            self.fail(f"{value!r}: expected {error}", option, context)


class PrintSetting(click.types.StringParamType):
    """The attribute of `<print>` that the option is named after."""

    name, metavar = "text", "LENGTH"

    def convert(self, value: Any, option: click.Parameter | None, context: click.Context | None) -> Any:
        from fracslice.scene import Print

        assert option is not None
        return Parsed(Print.kinds()[str(option.name)].read, "").convert(value, option, context)


def read_length(text: str) -> float:
    """Parse a length into mm."""
    from fracslice.scene import parse_length

    return parse_length(text)


def read_seconds(text: str) -> float:
    """Parse a time of an animation."""
    from fracslice.scene.animation import Seconds

    return float(Seconds(0.0, "").read(text))


def read_interval(text: str) -> float:
    """Parse a time above zero of an animation."""
    seconds = read_seconds(text)
    if not seconds:
        raise ValueError("a time in seconds above zero, such as 2.5s")
    return seconds


def read_factors(text: str) -> tuple[float, float, float]:
    """Parse the compensation of shrinkage into factors along x, y and z."""
    from fracslice.scene.lengths import Percent

    x, y, z = Percent(None, "").read(text)
    return x, y, z


def direction(
    _: click.Context, __: click.Parameter, value: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Check that a direction is not zero."""
    if not any(value):
        raise click.BadParameter("0 0 0: expected a direction")
    return value


NUMBER, AMOUNT, POSITIVE = Finite(), Signed(">="), Signed(">")
LENGTH, SECONDS = Parsed(read_length, "LENGTH"), Parsed(read_seconds, "TIME")
INTERVAL = Parsed(read_interval, "TIME")
FACTORS = Parsed(read_factors, "N%[,N%,N%]")
