"""Python source to syntax trees."""

from __future__ import annotations

import ast
from threading import Lock

_ONE_THREAD = Lock()


def parse(text: str) -> ast.Module:
    """Parse Python, one thread at a time.

    CPython 3.11 and 3.12 keep the depth of the tree that they build per interpreter. If garbage is collected
    meanwhile, another thread may run and parse, and both raise SystemError.

    Parameters
    ----------
    text
        Statements.

    Returns
    -------
    ast.Module
        Syntax tree.

    Raises
    ------
    SyntaxError
        If the text is not Python.
    """
    with _ONE_THREAD:
        return ast.parse(text)


def parse_expression(text: str) -> ast.expr:
    """Parse an expression; see `parse`."""
    with _ONE_THREAD:
        return ast.parse(text, mode="eval").body
