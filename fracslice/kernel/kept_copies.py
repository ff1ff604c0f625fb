"""Copies of formulas as text, kept in the cache of kernels: making them is most of linking."""

from __future__ import annotations

import hashlib
import linecache
from collections.abc import Callable, Hashable
from contextlib import suppress
from types import FunctionType, ModuleType
from typing import Any, BinaryIO

from ..errors import ExportError
from ..files import Kept
from ..keys import key
from . import functions

Texts = tuple[str, str, list[str]]
"""Name and text of a copy, and the names of the functions that it calls."""

DIGEST = hashlib.sha256().digest_size


def kept(function: Callable[..., Any], made_of: tuple[object, ...], make: Callable[[], Texts]) -> Texts:
    """Return the texts of a copy: cached, or made and cached.

    A file that other users could have written is not used. A function without a source is not cached.

    Parameters
    ----------
    function
        Formula.
    made_of
        Everything else that the copy depends on, as for `keys.key`.
    make
        Makes the texts.

    Returns
    -------
    tuple
        The texts.
    """
    from .objects import cache_folder, toolchain

    code = function.__code__
    linecache.checkcache(code.co_filename)
    lines = "".join(linecache.getlines(code.co_filename, function.__globals__))
    if not lines:
        return make()
    outside = _stable(functions.fingerprint(function))
    place = lines, code.co_firstlineno, function.__qualname__, outside
    folder, name = Kept(cache_folder() / "copies"), f"{key('copy', *place, *made_of, toolchain())}.txt"
    texts = folder.get(name, _read)
    if texts is None:
        texts = make()
        copy, text, calls = texts
        data = f"{copy}\n{' '.join(calls)}\n{text}".encode()
        with suppress(ExportError):
            folder.put(name, lambda file: file.write(hashlib.sha256(data).digest() + data))
    return texts


def _read(file: BinaryIO) -> Texts | None:
    """Texts in a file; None if it is incomplete."""
    digest, data = file.read(DIGEST), file.read()
    if hashlib.sha256(data).digest() != digest:
        return None
    name, calls, text = data.decode().split("\n", 2)
    return name, text, calls.split()


def _stable(mark: Hashable) -> str:
    """Fingerprint that is the same in every process. The code itself is in the source."""
    if isinstance(mark, tuple):
        return f"({', '.join(map(_stable, mark))})"
    if isinstance(mark, (FunctionType, type)):
        return f"{mark.__module__}.{mark.__qualname__}"
    if isinstance(mark, ModuleType):
        return mark.__name__
    return mark if isinstance(mark, str) else ""
