"""The right name for a wrong one."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def hint(wrong: str, right: Iterable[str], form: str = "{}") -> str:
    """Suggestion for an unknown name: the nearest known one, or a list of all; `form` formats a name.

    >>> hint("mandelblub", ["julia", "mandelbulb"], "<{}>")
    'did you mean <mandelbulb>?'
    """
    known = sorted(right)
    folded = {name.lower(): name for name in known}
    near = get_close_matches(wrong.lower(), folded, n=1)
    if near:
        return f"did you mean {form.format(folded[near[0]])}?"
    *most, last = map(form.format, known)
    return "expected " + (f"{', '.join(most)} or {last}" if most else last)
