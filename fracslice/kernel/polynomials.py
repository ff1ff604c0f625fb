"""Products of linear forms, expanded: terms of a derivative that cancel leave no code."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product

Terms = dict[tuple[str, ...], float]
"""Coefficients of monomials, each the sorted names of its factors."""

Find = Callable[[str], str | None]
"""Expression of a name, or None."""


def linear(atom: str, find: Find) -> Terms:
    """Return an atom as a linear form of names.

    Parameters
    ----------
    atom
        Name or number, with or without a minus.
    find
        Expression of a name: two atoms and an operator.

    Returns
    -------
    Terms
        The linear form; of a name that is none, the name itself.
    """
    if atom[0] == "-":
        return scaled(linear(atom[1:], find), -1.0)
    if not atom.isidentifier():
        return {(): float(atom)}
    match (find(atom) or "").split(" "):
        case [a, ("+" | "-") as sign, b] if _is_atom(a) and _is_atom(b):
            terms = added(linear(a, find), scaled(linear(b, find), 1.0 if sign == "+" else -1.0))
        case [a, "*", b] if _is_atom(a) and _is_atom(b):
            terms = multiplied(linear(a, find), linear(b, find))
        case _:
            return {(atom,): 1.0}
    return terms if all(len(names) == 1 for names in terms) else {(atom,): 1.0}


def _is_atom(text: str) -> bool:
    """True for a name or a number."""
    name = text.removeprefix("-")
    return name.isidentifier() or name.replace(".", "", 1).isdigit()


def scaled(a: Terms, factor: float) -> Terms:
    """Return a form times a number."""
    return {names: factor * value for names, value in a.items()}


def added(a: Mapping[tuple[str, ...], float], b: Mapping[tuple[str, ...], float]) -> Terms:
    """Return the sum of two forms, without terms that cancel."""
    total = {names: a.get(names, 0.0) + b.get(names, 0.0) for names in {**a, **b}}
    return {names: value for names, value in total.items() if value}


def multiplied(a: Terms, b: Terms) -> Terms:
    """Return the product of two forms."""
    total: Terms = {}
    for (p, u), (q, v) in product(a.items(), b.items()):
        total = added(total, {tuple(sorted((*p, *q))): u * v})
    return total


def dot(a: Sequence[str | None], b: Sequence[str | None], find: Find) -> Terms | None:
    """Return the dot product of two rows of atoms if it needs less code than its products.

    Parameters
    ----------
    a, b
        Rows; None is zero.
    find
        Expression of a name.

    Returns
    -------
    Terms or None
        Terms with one coefficient but for the sign, no more of them than products; None if there are others.
    """
    pairs = [(x, y) for x, y in zip(a, b, strict=True) if x is not None and y is not None]
    total: Terms = {}
    for x, y in pairs:
        total = added(total, multiplied(linear(x, find), linear(y, find)))
    same = len({abs(value) for value in total.values()}) <= 1
    quadratic = all(len(names) == 2 for names in total)
    return total if same and quadratic and len(total) <= len(pairs) else None
