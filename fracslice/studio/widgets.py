"""Attributes of widgets that all panels of a page share."""

from __future__ import annotations


def named(label: str, title: str = "") -> list[str]:
    """Attributes that name a control, for those who see it and those who do not."""
    return [f'aria-label="{label}"', f'title="{title or label}"']


def named_by(expression: str) -> list[str]:
    """The same of an expression of the page."""
    return [f':aria-label="{expression}"']
