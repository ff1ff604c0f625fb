"""Texts in the cache of kernels: making them is most of linking."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from typing import BinaryIO

from ..common.cache_files import Kept
from ..common.keys import key
from ..errors import ExportError

DIGEST = hashlib.sha256().digest_size


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

    Returns
    -------
    str
        The text.
    """
    kept, name = _place(kind, made_of)
    text = kept.get(name, _read)
    if text is None:
        text = make()
        _put(kept, name, text)
    return text


def keep_text(kind: str, made_of: tuple[object, ...], text: str) -> None:
    """Replace a cached text; see `kept_text`."""
    _put(*_place(kind, made_of), text)


def _place(kind: str, made_of: tuple[object, ...]) -> tuple[Kept, str]:
    from ..common.cache_files import cache_folder
    from .objects import toolchain

    return Kept(cache_folder() / kind), f"{key(kind, *made_of, toolchain())}.txt"


def _put(kept: Kept, name: str, text: str) -> None:
    data = text.encode()
    with suppress(ExportError):
        kept.put(name, lambda file: file.write(hashlib.sha256(data).digest() + data))


def _read(file: BinaryIO) -> str | None:
    """Text in a file; None if it is incomplete."""
    digest, data = file.read(DIGEST), file.read()
    return data.decode() if hashlib.sha256(data).digest() == digest else None
