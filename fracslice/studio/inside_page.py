"""The panel of a page that shows the inside of a scene: mesh, layers, check, measures, print edits."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from ..errors import FracsliceError
from ..slicing.printers import PRINTERS
from .inside import MODES
from .solid import MEASURES
from .widgets import NARROW, legend, named, named_by, number_field, slider

if TYPE_CHECKING:
    from .page import Page

FINENESSES = 32, 64, 96, 128, 192, 256, 384, 512
"""Voxels along the longest side that the page offers."""

HEIGHTS = 0.02, 0.025, 0.03, 0.05, 0.1, 0.15, 0.2
"""Heights of layers that the page offers, mm."""


class InsidePanel:
    """The panel, and what its controls do."""

    def __init__(self, page: Page) -> None:
        self._page, self._inside = page, page.studio.inside
        page.state.update({"inside": self._inside.told, "looking_inside": False, "edits": self._inside.edits})

    def follow(self) -> None:
        """Bring the panel up to date."""
        told, edits = self._inside.told, self._inside.edits
        if self._page.state.inside != told or self._page.state.edits != edits:
            with self._page.state as state:
                state.inside, state.edits = told, edits

    def act(self, change: Callable[..., Any], *arguments: Any) -> None:
        """Change what is shown; what cannot be done is said."""
        self._inside.message = ""
        try:
            change(*arguments)
        except FracsliceError as error:
            self._inside.message = str(error)
        self.follow()

    def show(self, mode: str) -> None:
        """Show the field, the mesh or the layers."""
        if mode != "field":
            self._page.state.looking_inside = True
        self.act(self._inside.show, mode)

    def make_mesh(self, fineness: Any) -> None:
        """Make the mesh."""
        self.act(self._inside.make_mesh, float(fineness))

    def plan(self, printer: str | None, layer: Any) -> None:
        """Plan layers."""
        self.act(self._inside.plan, printer or "", float(layer))

    def scrub(self, index: Any) -> None:
        """Show another layer."""
        self.act(self._inside.scrub, int(index))

    def toggle(self, name: str) -> None:
        """Turn edges, measuring or the build volume on or off."""
        setattr(self._inside, name, not getattr(self._inside, name))
        self.act(self._inside.draw)

    def edit(self, name: str, value: Any) -> None:
        """Change a print edit, or the size."""
        self.act(self._inside.edit, name, "" if value is None else str(value))
        self._page.refresh()

    def modes(self) -> None:
        """Buttons that choose what is shown."""
        with v.VBtnToggle(
            model_value=("inside.mode",),
            mandatory=True,
            density="compact",
            raw_attrs=named("What is shown"),
        ):
            for mode in MODES:
                pressed = [f":aria-pressed=\"inside.mode == '{mode}'\""]
                v.VBtn(mode, value=mode, size="small", click=(self.show, f"['{mode}']"), raw_attrs=pressed)

    def build(self) -> None:
        """Lay the panel out."""
        with (
            v.VNavigationDrawer(
                v_model=("looking_inside",), location="right", width=320, mobile_breakpoint=NARROW
            ),
            v.VExpansionPanels(
                v_if="looking_inside",  # a page opens sooner without
                multiple=True,
                model_value=([0, 1, 2, 3, 4],),
                variant="accordion",
            ),
        ):
            for title, lay in (
                ("Mesh", self._mesh),
                ("Layers", self._layers),
                ("Check", self._check),
                ("Measure", self._measure),
                ("Print", self._print),
            ):
                with v.VExpansionPanel(title=title), v.VExpansionPanelText():
                    lay()

    def _mesh(self) -> None:
        with html.Div(classes="d-flex align-center"):
            v.VSelect(
                model_value=("inside.fineness",),
                items=([*FINENESSES],),
                update_modelValue=(self.make_mesh, "[$event]"),
                label="Fineness",
                density="compact",
                hide_details=True,
            )
            v.VBtn(
                "{{ inside.stale ? 'Make again' : 'Make' }}",
                click=(self.make_mesh, "[inside.fineness]"),
                size="small",
                variant="text",
                color=("inside.stale ? 'warning' : undefined",),
                raw_attrs=named("Make the mesh"),
            )
        with html.Div(classes="d-flex"):
            self._switch("edges", "Edges")
            v.VCheckbox(
                model_value=("inside.designed",),
                update_modelValue=(self.compare, "[$event]"),
                label="Before print edits",
                density="compact",
                hide_details=True,
                disabled=("!inside.edited",),
            )
        v.VSelect(
            model_value=("inside.measure",),
            items=([{"title": "no colours", "value": ""}, *({"title": m, "value": m} for m in MEASURES)],),
            update_modelValue=(self.colour, "[$event]"),
            label="Colours",
            density="compact",
            hide_details=True,
            classes="my-2",
        )
        with html.Div(v_if="inside.legend", raw_attrs=named("Legend")):
            legend("inside.legend")
        html.Div("{{ inside.hovered }}", classes="text-caption", style="min-height: 20px")
        self._table("inside.figures", "inside.other")
        v.VBtn("Make a file", click=(self.file, "['mesh']"), size="small", variant="text")

    def compare(self, designed: Any) -> None:
        """Show the mesh before print edits, or after."""
        self.act(self._inside.compare, bool(designed))

    def colour(self, measure: str | None) -> None:
        """Show a measure as colours."""
        self.act(self._inside.colour, measure or "")

    def _layers(self) -> None:
        v.VAutocomplete(
            model_value=("inside.printer || null",),
            items=(_printers(),),
            clearable=True,
            update_modelValue=(self.plan, "[$event, inside.layer]"),
            label="Printer",
            density="compact",
            hide_details=True,
        )
        with html.Div(classes="d-flex align-center my-2"):
            v.VSelect(
                model_value=("inside.layer",),
                items=([*HEIGHTS],),
                update_modelValue=(self.plan, "[inside.printer, $event]"),
                label="Height of a layer, mm",
                density="compact",
                hide_details=True,
            )
            v.VBtn(
                "{{ inside.old ? 'Plan again' : 'Plan' }}",
                click=(self.plan, "[inside.printer, inside.layer]"),
                size="small",
                variant="text",
                color=("inside.old ? 'warning' : undefined",),
                raw_attrs=named("Plan the layers"),
            )
        self._switch("bed", "Build volume in the picture", "!inside.printer")
        with html.Div(v_if="inside.count", classes="d-flex align-center"):
            slider(
                self._page.ctrl,
                "'layer'",
                "inside.index",
                (self.scrub, "[$event]"),
                named("Layer"),
                min=0,
                max=("inside.count - 1",),
                step=1,
            )
            number_field("inside.index", (self.scrub, "[$event.target.value]"), named("Layer as a number"))
        with html.Div(v_if="inside.count", classes="text-caption"):
            for colour, text in (("#ec8c32", "nothing below"), ("#d63cc8", "island"), ("#5496d6", "support")):
                html.Span("■ ", style=f"color: {colour}")
                html.Span(text, classes="mr-2")
        self._table("inside.rows")
        label = "{{ inside.printer ? 'Make a file for the printer' : 'Make a file of layers' }}"
        v.VBtn(label, v_if="inside.count", click=(self.file, "['layers']"), size="small", variant="text")

    def file(self, of: str) -> None:
        """Begin to make a file of the mesh or of the layers, in the dialog for that."""
        path, inside = self._page.studio.document.path, self._inside
        ending = f".{PRINTERS[inside.printer].file}" if inside.printer else ".svg"
        with self._page.state as state:
            if of == "mesh":
                state.resolution = inside.fineness
            state.file_name = path.with_suffix(".3mf" if of == "mesh" else ending).name
            state.making = True

    def _check(self) -> None:
        v.VBtn("Check", click=(self.act_check,), size="small", raw_attrs=named("Check the print"))
        html.Div("{{ inside.verdict }}", classes="text-subtitle-2 my-1", raw_attrs=['aria-live="polite"'])
        with (
            v.VList(density="compact", raw_attrs=named("Problems")),
            v.VListItem(
                v_for="(p, i) in inside.problems",
                key="i",
                click=(self.go_to, "[i]"),
                active=("inside.chosen === i",),
                style="min-height: 30px",
            ),
        ):
            html.Div("{{ p.text }}", classes="text-caption")
            v.VBtn(
                "{{ m[0] }} {{ m[1] }}",
                v_for="m in p.mend",
                key="m[0]",
                click=(self.edit, "[m[0], m[1]]"),
                size="x-small",
                variant="tonal",
                raw_attrs=named_by("'mend by ' + m[0]"),
            )

    def act_check(self) -> None:
        """Check the print."""
        self.act(self._inside.check)

    def go_to(self, number: Any) -> None:
        """Fly to a problem."""
        self.act(self._inside.go_to, int(number))

    def _measure(self) -> None:
        with html.Div(classes="d-flex align-center"):
            self._switch("measuring", "Click points")
            v.VBtn(
                "Clear",
                click=(self.forget,),
                size="small",
                variant="text",
                raw_attrs=named("Clear points"),
            )
        html.Div(
            "one: thickness; two: distance; three: angle, circle; more: sphere",
            classes="text-caption text-medium-emphasis",
        )
        self._table("inside.measures")

    def forget(self) -> None:
        """Forget the points."""
        self.act(self._inside.forget)

    def _print(self) -> None:
        with html.Div(v_for="e in edits", key="e.name", classes="mb-1 d-flex align-center"):
            html.Span("{{ e.name }}", title=("e.doc",), classes="text-body-2", style="width: 72px")
            slider(
                self._page.ctrl,
                "e.name",
                "e.value",
                (self.edit, "[e.name, $event ? $event + 'mm' : null]"),
                named_by("e.name"),
                v_if="!e.choices",
                min=0,
                max=("e.most",),
                step=("e.step",),
            )
            v.VTextField(
                v_if="!e.choices",
                model_value=("e.text",),
                change=(self.edit, "[e.name, $event.target.value]"),
                density="compact",
                variant="plain",
                hide_details=True,
                style="flex: 0 0 72px; margin-top: -12px",
                raw_attrs=named_by("e.name + ' as a text'"),
            )
            v.VSelect(
                v_if="e.choices",
                model_value=("e.text",),
                items=("e.choices",),
                update_modelValue=(self.edit, "[e.name, $event]"),
                density="compact",
                hide_details=True,
                raw_attrs=named_by("e.name"),
            )

    def _switch(self, name: str, label: str, off: str = "false") -> None:
        """A box that turns something of the inside on or off."""
        v.VCheckbox(
            model_value=(f"inside.{name}",),
            update_modelValue=(self.toggle, f"['{name}']"),
            label=label,
            density="compact",
            hide_details=True,
            disabled=(off,),
        )

    def _table(self, rows: str, others: str = "") -> None:
        """Names and values, and beside them values of another state."""
        with html.Table(classes="text-caption", style="width: 100%; table-layout: fixed"):
            if others:
                with html.Tr(v_if=f"{others}.length", classes="text-medium-emphasis"):
                    html.Td("", style="width: 76px")
                    html.Td("{{ inside.designed ? 'before' : 'after' }}")
                    html.Td("{{ inside.designed ? 'after' : 'before' }}")
            with html.Tr(v_for=f"(row, i) in {rows}", key="i", style="vertical-align: top"):
                html.Td("{{ row[0] }}", classes="text-medium-emphasis pr-2", style="width: 76px")
                html.Td("{{ row[1] }}")
                if others:
                    html.Td(f"{{{{ {others}[i] ? {others}[i][1] : '' }}}}", v_if=f"{others}.length")


def _printers() -> list[dict[str, str]]:
    """Printers as a page lists them."""
    return [{"title": PRINTERS[name].title, "value": name} for name in PRINTERS]
