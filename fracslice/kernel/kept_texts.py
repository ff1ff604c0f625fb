"""Texts in the cache of kernels: making them is most of linking."""

from __future__ import annotations

from collections.abc import Callable

from ..common.cache_files import Kept, cache_folder
from ..common.keys import key
from .host import toolchain


def kept_text(kind: str, made_of: tuple[object, ...], make: Callable[[], str]) -> str:
    """Return a text: cached, or made and cached.

    A file that other users could have written is not used.

    Parameters
    ----------
    kind
        Kind of text; the name of its folder.
    made_of
        Everything that the text depends on besides this package's compiler, as for `keys.key`.
    make
        Makes the text.
    """
    kept, name = _place(kind, made_of)
    return kept.cached(name, lambda: make().encode()).decode()


def keep_text(kind: str, made_of: tuple[object, ...], text: str) -> None:
    """Replace a cached text; see `kept_text`."""
    kept, name = _place(kind, made_of)
    kept.put_checked(name, text.encode())


def _place(kind: str, made_of: tuple[object, ...]) -> tuple[Kept, str]:
    return Kept(cache_folder() / kind), f"{key(kind, *made_of, toolchain())}.txt"
