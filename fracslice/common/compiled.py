"""Loops over samples, written in Python and compiled by Numba."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

from .cache_files import Kept, cache_folder
from .keys import PACKAGE, texts

CONFIG: Any = numba.config


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function with Numba at its first call; it runs without the GIL.

    Machine code is cached in the folder of the kernels unless other users can write there: Numba would load
    any file.

    Returns
    -------
    Callable
        Numba dispatcher of the function.
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
    """Cache folder of all compiled loops, keyed by their joint text: they call each other, and Numba checks
    only the file of the function itself. None if the folder cannot be trusted.
    """
    own = [path for path in sorted(PACKAGE.rglob("*.py")) if b"@compiled\n" in path.read_bytes()]
    return Kept(cache_folder() / "loops" / texts(*own)).place()
