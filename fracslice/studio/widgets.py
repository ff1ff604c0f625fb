"""Widgets, and attributes of widgets, that all panels of a page share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

NARROW = 900
"""Width of a page below which panels at the right cover the picture, pixels."""


def named(label: str, title: str = "") -> list[str]:
    """Attributes that name a control, for those who see it and those who do not."""
    return [f'aria-label="{label}"', f'title="{title or label}"']


def named_by(expression: str) -> list[str]:
    """The same of an expression of the page."""
    return [f':aria-label="{expression}"']


def number_field(value: str, change: tuple[Callable[..., Any], str], label: list[str]) -> None:
    """Field of a number, an expression of the page, that keeps what is typed until it is entered.

    A plain `<input>` would not: whatever else changes in the page writes its value again. `change` has the
    number as its last argument; an empty field changes nothing.
    """
    act, arguments = change

    def entered(*given: Any) -> None:
        if given[-1] != "":
            act(*given[:-1], float(given[-1]))

    v.VTextField(
        model_value=(value,),
        change=(entered, arguments),
        type="number",
        density="compact",
        variant="plain",
        hide_details=True,
        style="flex: 0 0 84px; margin-top: -12px",
        raw_attrs=[*label, 'step="any"'],
    )


def legend(of: str) -> None:
    """Colours of a legend, an expression of the page, with its limits and unit."""
    html.Div(style=(f"`height: 12px; background: ${{{of}.colours}}`",))
    with html.Div(classes="d-flex justify-space-between text-caption"):
        html.Span(f"{{{{ {of}.low }}}}")
        html.Span(f"{{{{ {of}.unit }}}}")
        html.Span(f"{{{{ {of}.high }}}}")
