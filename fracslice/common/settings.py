"""Files of settings that a user writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def read_text(path: Path, fail: type[Exception], errors: str = "strict") -> str:
    """Read a text file.

    `errors`: treatment of invalid bytes.
    """
    try:
        return path.read_text(encoding="utf-8", errors=errors)
    except OSError as error:
        raise fail(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise fail(f"{path}: expected text in UTF-8") from None


def read_table(path: Path, fail: type[Exception]) -> dict[str, Any]:
    """Read a TOML file."""
    import tomllib  # of a user's own files

    try:
        return tomllib.loads(read_text(path, fail))
    except tomllib.TOMLDecodeError as error:
        raise fail(f"{path}: not a TOML file: {error}") from None
