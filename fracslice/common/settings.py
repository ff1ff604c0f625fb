"""Files of settings that a user writes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .files import open_regular

LARGEST, LONGEST, DEEPEST = 1 << 20, 1 << 14, 8
"""Most bytes of such a file, characters of a TOML file, whose long keys take quadratic time, and tables and
arrays within each other."""


def read_text(path: Path, fail: type[Exception], errors: str = "strict") -> str:
    """Read a text file.

    `errors`: treatment of invalid bytes.
    """
    try:
        with open_regular(path) as file:
            data = file.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise fail(f"{path}: expected at most {LARGEST >> 20} MB of settings")
        return data.decode("utf-8", errors)
    except OSError as error:
        raise fail(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise fail(f"{path}: expected text in UTF-8") from None


def read_table(path: Path, fail: type[Exception]) -> dict[str, Any]:
    """Read a TOML file."""
    import tomllib  # of a user's own files

    text = read_text(path, fail)
    if len(text) > LONGEST:
        raise fail(f"{path}: expected at most {LONGEST >> 10} kB of settings")
    try:
        table = tomllib.loads(text)
        if _nested(table, DEEPEST):
            raise RecursionError
    except RecursionError:
        raise fail(f"{path}: expected at most {DEEPEST} tables and arrays within each other") from None
    except ValueError as error:  # of a number of thousands of digits, too
        raise fail(f"{path}: not a TOML file: {error}") from None
    return table


def _nested(value: Any, levels: int) -> bool:
    """True if tables and arrays lie within each other more than so many levels deep."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return bool(inner) and (not levels or any(_nested(part, levels - 1) for part in inner))
