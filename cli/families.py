"""Families: one output for each value of a range."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal
from itertools import product
from pathlib import Path
from typing import Any

import click

from fracslice.errors import SharedError

from .inputs import load_scene

MOST = 10_000
"""Greatest number of members."""

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)"
_RANGE = re.compile(rf"(?P<name>[^=]+)=\s*({_NUMBER})\s*\.\.\s*({_NUMBER})\s*(?::\s*({_NUMBER})\s*)?")


@dataclass(frozen=True)
class Member:
    """Member of a family.

    Attributes
    ----------
    settings : tuple of str
        Values of --set, without ranges.
    suffix : str
        End of the names of its files, such as "-power2.5"; empty without a range.
    """

    settings: tuple[str, ...]
    suffix: str

    def named(self, path: str) -> str:
        """Name of a file of this member.

        Parameters
        ----------
        path : str
            Name without the value.

        Returns
        -------
        str
            The name with the value before its extension.
        """
        return suffixed(path, self.suffix)


def suffixed(path: str, suffix: str) -> str:
    """Insert text before the extension of a file name."""
    return str(Path(path).with_name(Path(path).stem + suffix + Path(path).suffix)) if suffix else path


def members(settings: Sequence[str]) -> list[Member]:
    """Members of the ranges among settings, such as mandelbulb.power=2..9:0.5; the last range changes first.

    Raises `click.UsageError` for an empty range, or too many members.
    """
    choices = [list(_values(setting)) for setting in settings]
    count = functools.reduce(lambda n, values: n * len(values), choices, 1)
    if count > MOST:
        raise click.UsageError(f"--set: expected at most {MOST} outputs, and these ranges make {count}")
    return [
        Member(tuple(text for text, _ in chosen), "".join(suffix for _, suffix in chosen))
        for chosen in product(*choices)
    ]


def _values(setting: str) -> Iterator[tuple[str, str]]:
    """Settings of a range, and their part of the file name; the setting itself if it has none."""
    match = _RANGE.fullmatch(setting)
    if not match:
        yield setting, ""
        return
    name, (first, last, step) = match["name"].strip(), map(Decimal, (match[2], match[3], match[4] or "1"))
    if not step or (last - first) / step < 0:
        raise click.UsageError(f"--set {setting}: expected a range such as {name}=2..9:0.5")
    if (last - first) / step >= MOST:
        raise click.UsageError(f"--set {setting}: expected at most {MOST} values")
    for k in range(int((last - first) / step) + 1):
        value = f"{first + k * step:f}"
        value = value.rstrip("0").rstrip(".") if "." in value else value
        yield f"{name}={value}", f"-{name.rpartition('.')[2]}{value}"


def families(*names: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorator of a command that runs once for each member of a family.

    Parameters
    ----------
    *names : str
        Options that name output files; they get the values of the member.

    Returns
    -------
    callable
        Decorator. The exit status is the greatest one.
    """

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def run(*arguments: Any, **options: Any) -> int:
            family = members(options["settings"])
            if len(family) == 1:
                return command(*arguments, **{**options, "settings": family[0].settings}) or 0
            names_of_values = re.findall(r"-([a-z_]+)", family[0].suffix)
            if len(set(names_of_values)) < len(names_of_values):
                raise click.UsageError("--set: expected ranges of attributes with different names")
            for member in family:  # refuse a value before the first output is made
                load_scene(options["source"], member.settings)
            return max(_status(command, arguments, options, member, names) for member in family)

        return run

    return decorated


def _status(
    command: Callable[..., Any], arguments: Any, options: dict[str, Any], member: Member, names: Sequence[str]
) -> int:
    """Exit status of one member."""
    own = {name: member.named(options[name]) for name in names if options[name] is not None}
    with going_on(own["output"]):
        return command(*arguments, **{**options, "settings": member.settings, **own}) or 0
    return 0


@contextmanager
def going_on(file: str) -> Iterator[None]:
    """Let a shard that does not write a file go on with the next one."""
    try:
        yield
    except SharedError as error:
        click.echo(f"fracslice: {file}: {error}", err=True)
