"""Widgets, and attributes of widgets, that all panels of a page share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from trame.widgets import html
from trame.widgets import vuetify3 as v
from trame_client.widgets.core import AbstractElement
from trame_rca import module as rca

NARROW = 900
"""Width of a page below which panels at the right cover the picture, pixels."""

PENDING = 2
"""Frames that a page may have to fetch still before others are left out."""


def picture_area(server: Any, frames: Any) -> None:
    """Area that shows frames and tells of mouse and keys; `frames` is what trame-rca calls its adapter.

    The widget of trame-rca itself loads VTK, a third of what the studio imports.
    """
    server.enable_module(rca)
    style = "{width: '100%', height: '100%', objectFit: 'contain'}"
    shown = f'name="{frames.area_name}"', 'display="image"', f':image-style="{style}"'
    events = ':send-mouse-move="true"', ':event-throttle-ms="15"'
    AbstractElement("remote-controlled-area", raw_attrs=[*shown, *events])

    def register(**_: Any) -> None:
        server.protocol_call("trame.rca.drop", frames.area_name, PENDING)
        server.controller.rc_area_register(frames)

    server.controller.on_server_ready.add(register)


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


FOLLOWED = 500
"""Time for which a slider shows where it was moved to, whatever the server says, milliseconds."""


def slider(
    controller: Any, key: str, value: str, change: tuple[Callable[..., Any], str], name: list[str], **how: Any
) -> None:
    """Slider of a number, an expression of the page, each of whose steps begins where the last one ended.

    By itself, a slider waits for the server after each of them: keys that are held would be lost. `key` is an
    expression that no other slider has, `how` more attributes. The page has the state `held`, of each tab.
    """
    act, arguments = change
    held = f"{{of: {key}, value: $event, until: Date.now() + {FOLLOWED}}}"
    v.VSlider(
        model_value=(f"held.of === {key} && held.until > Date.now() ? held.value : {value}",),
        update_modelValue=f"held = {held}; trigger('{controller.trigger_name(act)}', {arguments})",
        density="compact",
        hide_details=True,
        raw_attrs=name,
        **how,
    )


def legend(of: str) -> None:
    """Colours of a legend, an expression of the page, with its limits and unit."""
    html.Div(style=(f"`height: 12px; background: ${{{of}.colours}}`",))
    with html.Div(classes="d-flex justify-space-between text-caption"):
        html.Span(f"{{{{ {of}.low }}}}")
        html.Span(f"{{{{ {of}.unit }}}}")
        html.Span(f"{{{{ {of}.high }}}}")
