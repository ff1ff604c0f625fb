"""Loops over samples, written in Python and compiled by Numba."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

from .files import Kept
from .kernel.objects import cache_folder
from .keys import HERE, texts

CONFIG: Any = numba.config


def compiled(function: Callable[..., Any]) -> Any:
    """Decorates a function that Numba is to compile, when it is first called; it releases the interpreter.

    The machine code is kept where kernels are, as long as nobody else can write there: Numba would take any.
    """
    folder = _folder()
    if folder is None:
        return numba.njit(nogil=True)(function)
    before, CONFIG.CACHE_DIR = CONFIG.CACHE_DIR, str(folder)
    try:
        return numba.njit(nogil=True, cache=True)(function)
    finally:
        CONFIG.CACHE_DIR = before


@cache
def _folder() -> Path | None:
    """One for the text of all of them: they call each other, and Numba looks at a function's own file only.

    None if none can be trusted.
    """
    own = [path for path in sorted(HERE.rglob("*.py")) if b"@compiled\n" in path.read_bytes()]
    return Kept(cache_folder() / "loops" / texts(*own)).place()
