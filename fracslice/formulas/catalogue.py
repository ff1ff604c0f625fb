"""The catalogue that `registry` fills and operators read: formulas by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .registry import Formula

FORMULAS: dict[str, Formula] = {}
"""Every registered formula by the name of its element."""
