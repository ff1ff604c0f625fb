"""The words that the units of the renderer have beside those of the formulas; the linker gives them their
meaning."""

from __future__ import annotations


def field(x, y, z, P):  # type: ignore[no-untyped-def]
    """The scene's signed field."""
    raise NotImplementedError


GIVEN = frozenset({"field"})
