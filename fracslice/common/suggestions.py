"""The right name for a wrong one."""

from __future__ import annotations

from collections.abc import Iterable

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
