"""Marks that only this user can make: who carries one was not written by anybody else."""

from __future__ import annotations

import hashlib
import secrets
from functools import cache

from .files import Kept, users_folder, warn

SIZE = 32


def seal(text: str) -> str:
    """The mark of a text: its hash, keyed by this user's secret."""
    return hashlib.blake2b(text.encode(), key=_secret(), digest_size=16).hexdigest()


@cache
def _secret() -> bytes:
    """The same in every process of this user, kept in the user's configuration folder."""
    kept = Kept(users_folder("XDG_CONFIG_HOME", "~/.config"))
    found = kept.get("secret", lambda file: file.read())
    if found is None or len(found) != SIZE:
        found = secrets.token_bytes(SIZE)
        try:
            kept.put("secret", lambda file: file.write(found))
        except OSError as error:
            warn(f"{kept.folder}: {error.strerror}: interrupted jobs will not go on")
    return found
