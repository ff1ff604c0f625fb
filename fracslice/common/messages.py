"""Words of messages: numbers, the right name for a wrong one, and what installs a missing package."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable


def significant(value: float, digits: int = 3) -> str:
    """Format a number with a few significant digits, without an exponent where it is large.

    Examples
    --------
    >>> significant(1938.7), significant(0.012345), significant(2e9, 2)
    ('1940', '0.0123', '2000000000')
    """
    return f"{float(f'{value:.{digits}g}'):.12g}"


def decimal(value: float) -> str:
    """Format a number with two decimals or, below a tenth, three significant digits.

    Examples
    --------
    >>> decimal(80), decimal(0.1), decimal(0.00041), decimal(0)
    ('80.00', '0.10', '0.00041', '0.00')
    """
    return significant(value) if 0 < value < 0.1 else f"{value:.2f}"


def place(at: Iterable[float], decimals: int = 2) -> str:
    """Format coordinates with a few decimals, without negative zeros.

    Examples
    --------
    >>> place([1.234, -0.001, 30])
    '1.23 0.00 30.00'
    """
    return " ".join(f"{round(x, decimals) + 0.0:.{decimals}f}" for x in at)


def duration(seconds: float) -> str:
    """Format a time in hours and minutes, or in seconds.

    Examples
    --------
    >>> duration(0.3), duration(95), duration(7260)
    ('1 s', '2 min', '2 h 1 min')
    """
    minutes = round(seconds / 60)
    if seconds < 60:
        return f"{max(round(seconds), 1)} s"
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"


def format_count(count: int, one: str, more: str = "") -> str:
    """Format a count with its noun.

    Examples
    --------
    >>> format_count(1, "layer"), format_count(13068, "triangle"), format_count(2, "cavity", "cavities")
    ('1 layer', '13,068 triangles', '2 cavities')
    """
    return f"{count:,} {one if count == 1 else more or one + 's'}"


MANY = 24
"""Number of names that are not listed any more."""


def hint(wrong: str, right: Iterable[str], form: str = "{}", where: str = "") -> str:
    """Suggestion for an unknown name: the only known one that begins so, the nearest, or a list of all.

    `form` formats a name. If there are more than `MANY` names, `where` takes the place of the list.

    >>> hint("mandelblub", ["julia", "mandelbulb"], "<{}>")
    'did you mean <mandelbulb>?'
    >>> hint("res", ["threads", "resolution"])
    'did you mean resolution?'
    """
    from difflib import get_close_matches  # for errors only: it takes a millisecond to import

    known = sorted(right)
    folded = {name.lower(): name for name in known}
    begun = [name for name in folded if len(wrong) > 1 and name.startswith(wrong.lower())]
    near = begun if len(begun) == 1 else get_close_matches(wrong.lower(), folded, n=1)
    if near:
        return f"did you mean {form.format(folded[near[0]])}?"
    if where and len(known) > MANY:
        return where
    *most, last = map(form.format, known)
    return "expected " + (f"{', '.join(most)} or {last}" if most else last)


def lacking(module: str, use: str, package: str | None = None) -> str:
    """Return the package to install for a use.

    Examples
    --------
    >>> lacking("json", "files need")
    ''
    >>> lacking("no_such_module", "windows need", "no-such-package")
    'windows need no-such-package, which is not installed: pip install "no-such-package"'
    """
    if importlib.util.find_spec(module):
        return ""
    name = package or module
    return f'{use} {name}, which is not installed: pip install "{name}"'
