"""Marks that only this user can make. A text with a valid mark was written by this user."""

from __future__ import annotations

import hashlib
import secrets
from functools import cache

from ..errors import ExportError
from .cache_files import Kept, users_folder, warn

SIZE = 32
"""Length of the secret, bytes."""


def seal(text: str) -> str:
    """Return the mark of a text: its hash, keyed by this user's secret.

    Returns
    -------
    str
        BLAKE2b digest of 16 bytes, hexadecimal.
    """
    return hashlib.blake2b(text.encode(), key=_secret(), digest_size=16).hexdigest()


@cache
def _secret() -> bytes:
    """Secret of this user, the same in every process, stored in the user's configuration folder."""
    kept = Kept(users_folder("XDG_CONFIG_HOME", "~/.config"))
    secret = kept.get("secret", lambda file: file.read())
    if secret is None or len(secret) != SIZE:
        secret = secrets.token_bytes(SIZE)
        try:
            kept.put("secret", lambda file: file.write(secret))
        except ExportError as error:
            warn(f"{error}: interrupted jobs will not go on")
    return secret
