"""The tree of a scene in a page, and the controls of the element that is chosen in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from trame.widgets import html
from trame.widgets import vuetify3 as v

from . import panels
from .widgets import named, named_by, number_field, slider

if TYPE_CHECKING:
    from .page import Page

GRADIENT = (
    "{width: '100%', height: '14px', borderRadius: '4px', marginBottom: '4px', "
    "background: `linear-gradient(90deg, ${[...c.stops, c.stops[0]].join(', ')})`}"
)
"""Style of the strip above the stops of a gradient, which returns to its first."""


class TreePanel:
    """What the tree and the controls show and do."""

    def __init__(self, page: Page) -> None:
        self.page, self.studio, self.state = page, page.studio, page.state
        self.state.dragged = []
        page.server.trigger("drop")(self.drop)

    def refresh(self) -> None:
        """Bring what is shown of the elements up to date."""
        document, state = self.studio.document, self.state
        tag = document.chosen
        state.rows = panels.outline(document)
        state.panel = panels.controls(self.studio.at_time(tag)) if tag else []
        state.at = list(document.version.at)
        state.tag = tag.name if tag else ""

    def turn_on(self, start: int) -> None:
        """Turn an element on again."""
        self.page.edit(self.studio.document.turn_on, start)

    def drop(self, place: list[int], onto: list[int]) -> None:
        """Move an element before the one that it is dropped on."""
        if place != onto:
            self.page.edit(self.studio.document.move, tuple(place), tuple(onto))

    def choose(self, place: list[int]) -> None:
        """Choose an element."""
        self.studio.document.choose(tuple(place))
        self.page.refresh()

    def add(self, name: str, around: bool) -> None:
        """Add an element to the chosen one, or put it around that."""
        document, at = self.studio.document, self.studio.document.version.at
        self.page.shut("adding", "wrapping")
        if any(choice["name"] == name and choice["kind"] == "part" for choice in self.state.choices):
            at = ()
        if around:
            self.page.edit(document.wrap, at, name)
        else:
            self.page.edit(document.add, at, name)

    def change(self, edit: Literal["duplicate", "unwrap", "turn_off", "remove"]) -> None:
        """Change the chosen element."""
        document = self.studio.document
        self.page.edit(getattr(document, edit), document.version.at)

    def shift(self, by: int) -> None:
        """Move the chosen element up or down among its siblings."""
        at = self.studio.document.version.at
        if at and at[-1] + by >= 0:
            self.page.edit(self.studio.document.move, at, (*at[:-1], at[-1] + by + (by > 0)))

    def set_text(self, name: str, value: str | None) -> None:
        """Give an attribute of the chosen element a text; none takes it away."""
        self.studio.set_value(self.studio.document.version.at, name, value or None)
        self.page.refresh()

    def value_of(self, name: str) -> str:
        """Text of an attribute of the chosen element, as its control shows it."""
        return str(next(control["text"] for control in self.state.panel if control["name"] == name))

    def set_number(self, name: str, index: int, value: float) -> None:
        """Give a number of an attribute a value."""
        self.studio.set_number(self.studio.document.version.at, name, int(index), float(value))
        self.page.refresh()

    def set_colour(self, name: str, index: int, value: str | None) -> None:
        """Give a colour of an attribute another value, add it behind the last, or take it away."""
        control = next(control for control in self.state.panel if control["name"] == name)
        stops = list(control["stops"])
        stops[index : index + 1] = [] if value is None else [value]
        self.set_text(name, panels.colour_text(stops))

    def build(self) -> None:
        """Lay the tree out, and the attributes of the chosen element below it."""
        self._tree()
        v.VDivider()
        self._panel()

    def _tree(self) -> None:
        with html.Div(classes="d-flex pa-1"):
            v.VBtn("Add", click="adding = true; search = ''", size="small", variant="text")
            v.VBtn("Wrap", click="wrapping = true; search = ''", size="small", variant="text")
            for icon, label, act in (
                ("mdi-arrow-up", "Move up", lambda: self.shift(-1)),
                ("mdi-arrow-down", "Move down", lambda: self.shift(1)),
                ("mdi-content-copy", "Duplicate", lambda: self.change("duplicate")),
                ("mdi-arrow-collapse", "Unwrap", lambda: self.change("unwrap")),
                ("mdi-eye-off", "Turn off", lambda: self.change("turn_off")),
                ("mdi-delete", "Delete", lambda: self.change("remove")),
            ):
                v.VBtn(icon=icon, click=act, size="small", variant="text", raw_attrs=named(label))
        with (
            v.VList(density="compact", style="max-height: 40vh; overflow: auto", raw_attrs=named("Elements")),
            v.VListItem(
                v_for="row in rows",
                key="row.start",
                click=(self.choose, "[row.place]"),
                active=("row.chosen",),
                style=("`padding-left: ${8 + 14 * row.depth}px; min-height: 30px`",),
                classes=("row.off ? 'text-disabled' : ''",),
                raw_attrs=[
                    ':draggable="!row.off"',
                    '@dragstart="dragged = row.place"',
                    "@dragover.prevent",
                    "@drop.prevent=\"trigger('drop', [dragged, row.place])\"",
                ],
            ),
        ):
            html.Span("{{ row.name }}")
            html.Span("{{ row.given }}", classes="text-caption text-medium-emphasis ml-2")
            v.VBtn(
                icon="mdi-eye",
                v_if="row.off",
                click=(self.turn_on, "[row.start]"),
                size="x-small",
                variant="text",
                raw_attrs=named_by("'turn ' + row.name + ' on'"),
            )

    def _panel(self) -> None:
        with html.Div(classes="pa-3"):
            html.Div("{{ tag }}", classes="text-h6")
            with html.Div(v_for="c in panel", key="at.join('.') + c.name", classes="mb-2"):
                with html.Div(classes="d-flex align-center"):
                    html.Span(
                        "{{ c.name }}",
                        title=("c.doc + ': ' + c.expects",),
                        classes=("c.given ? 'text-body-2 font-weight-bold' : 'text-body-2'",),
                    )
                    v.VSpacer()
                    v.VBtn(
                        "reset",
                        v_if="c.given",
                        size="x-small",
                        variant="text",
                        click=(self.set_text, "[c.name, null]"),
                        raw_attrs=named_by("'reset ' + c.name"),
                    )
                    v.VBtn(
                        v_if="filming",
                        icon="mdi-rhombus",
                        size="x-small",
                        variant="text",
                        click=(self.page.film.key_value, "[c.name]"),
                        raw_attrs=named_by("'keyframe of ' + c.name"),
                    )
                with (
                    html.Template(v_if="c.kind == 'slider'"),
                    html.Div(v_for="(value, i) in c.values", key="i", classes="d-flex align-center"),
                ):
                    slider(
                        self.page.ctrl,
                        "at.join('.') + c.name + i",
                        "value",
                        (self.set_number, "[c.name, i, $event]"),
                        named_by("c.name + ' ' + (i + 1)"),
                        min=("c.least",),
                        max=("c.most",),
                        step=("c.step",),
                    )
                    number_field(
                        "value",
                        (self.set_number, "[c.name, i, $event.target.value]"),
                        named_by("c.name + ' ' + (i + 1) + ' as a number'"),
                    )
                v.VSelect(
                    v_if="c.kind == 'choice'",
                    model_value=("c.text",),
                    items=("c.choices",),
                    update_modelValue=(self.set_text, "[c.name, $event]"),
                    density="compact",
                    hide_details=True,
                    raw_attrs=named_by("c.name"),
                )
                with html.Div(v_if="c.kind == 'colours'", classes="d-flex flex-wrap align-center"):
                    html.Div(v_if="c.stops.length > 1", style=(GRADIENT,))
                    with html.Div(v_for="(stop, i) in c.stops", key="i", classes="d-flex mr-2"):
                        html.Input(
                            type="color",
                            value=("stop",),
                            change=(self.set_colour, "[c.name, i, $event.target.value]"),
                            raw_attrs=named_by("c.name + ' ' + (i + 1)"),
                        )
                        v.VBtn(
                            v_if="c.stops.length > 1",
                            icon="mdi-close",
                            click=(self.set_colour, "[c.name, i, null]"),
                            size="x-small",
                            density="compact",
                            variant="text",
                            raw_attrs=named_by("'remove ' + c.name + ' ' + (i + 1)"),
                        )
                    v.VBtn(
                        v_if="c.stops.length < c.most",
                        icon="mdi-plus",
                        click=(self.set_colour, "[c.name, c.stops.length, c.stops[c.stops.length - 1]]"),
                        size="x-small",
                        density="compact",
                        variant="text",
                        raw_attrs=named_by("'add a stop to ' + c.name"),
                    )
                v.VTextField(
                    v_if="c.kind == 'text'",
                    model_value=("c.text",),
                    change=(self.set_text, "[c.name, $event.target.value]"),
                    density="compact",
                    hide_details=True,
                    raw_attrs=named_by("c.name"),
                )
