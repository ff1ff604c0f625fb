"""Sweeps: one output for each value of a range."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import TypeVar

import click

from fracslice.errors import SharedError

from .execution import load_scene
from .options import SceneOptions

R = TypeVar("R", bound=SceneOptions)

MOST = 10_000
"""Greatest number of members."""

TABLE = ".csv"
"""Ending of a table, which is one file for a whole family."""

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_RANGE = re.compile(rf"(?<!\S)({_NUMBER})\s*\.\.\s*({_NUMBER})(?:\s*:\s*({_NUMBER}))?(?!\S)")


def with_suffix(path: str, suffix: str) -> str:
    """Insert text before the extension of a file name; a table stays one file."""
    file = Path(path)
    if not suffix or is_table(path):
        return path
    return str(file.with_name(file.stem + suffix + file.suffix))


def is_table(path: str) -> bool:
    """True if a file is named as a table."""
    return path.lower().endswith(TABLE)


def members(settings: Sequence[str]) -> list[tuple[tuple[str, ...], str]]:
    """Members of the ranges among settings, such as mandelbulb.power=2..9:0.5; the last range changes first.

    Each has its settings, and the end of the names of its files, such as "-power2.5"; empty without a range.
    Raises `click.UsageError` for an empty range, or too many members.
    """
    choices = [list(_values(setting)) for setting in settings]
    count = math.prod(map(len, choices))
    if count > MOST:
        raise click.UsageError(f"--set: expected at most {MOST} outputs, and these ranges make {count}")
    return [(tuple(text for text, _ in c), "".join(suffix for _, suffix in c)) for c in product(*choices)]


def _values(setting: str) -> Iterator[tuple[str, str]]:
    """Settings of a range, which may be one number of several, and their part of the file name.

    The setting itself if it has no range.
    """
    name, _, text = setting.partition("=")
    match, name = _RANGE.search(text), name.strip()
    if not match:
        yield setting, ""
        return
    from decimal import Decimal  # takes a millisecond to import

    first, last, step = (Decimal(number or 1) for number in match.groups())
    if not step or (last - first) / step < 0:
        raise click.UsageError(f"--set {setting}: expected a range such as {name}=2..9:0.5")
    if (last - first) / step >= MOST:
        raise click.UsageError(f"--set {setting}: expected at most {MOST} values")
    for k in range(int((last - first) / step) + 1):
        value = f"{first + k * step:f}"
        value = value.rstrip("0").rstrip(".") if "." in value else value
        yield (
            f"{name}={text[: match.start()]}{value}{text[match.end() :]}",
            f"-{name.rpartition('.')[2]}{value}",
        )


def families(*names: str) -> Callable[[Callable[[R], int | None]], Callable[[R], int]]:
    """Decorator of a command that runs once for each member of a family; its exit status is the greatest.

    names: options of output files, which get the values of the member.
    """

    def decorated(command: Callable[[R], int | None]) -> Callable[[R], int]:
        @functools.wraps(command)
        def run(given: R) -> int:
            family = members(given.settings)
            if len(family) == 1:
                return command(given) or 0
            names_of_values = re.findall(r"-([a-z_]+)", family[0][1])
            if len(set(names_of_values)) < len(names_of_values):
                raise click.UsageError("--set: expected ranges of attributes with different names")
            for settings, _ in family:  # refuse a value before the first output is made
                load_scene(vars(given)["source"], settings)
            return max(_status(command, given, *member, names) for member in family)

        return run

    return decorated


def _status(
    command: Callable[[R], int | None], given: R, settings: tuple[str, ...], suffix: str, names: Sequence[str]
) -> int:
    """Exit status of one member."""
    files = {name: vars(given)[name] for name in names}
    own = {name: with_suffix(file, suffix) for name, file in files.items() if file is not None}
    with going_on(own["output"]):
        return command(given.but(settings=settings, **own)) or 0
    return 0


@contextmanager
def going_on(file: str) -> Iterator[None]:
    """Let a shard that does not write a file go on with the next one."""
    try:
        yield
    except SharedError as error:
        click.echo(f"fracslice: {file}: {error}", err=True)
