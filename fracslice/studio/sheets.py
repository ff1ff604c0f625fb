"""Sheets of pictures to choose from: variations of a scene, and its bookmarks."""

from __future__ import annotations

import asyncio
import base64
from dataclasses import replace
from typing import TYPE_CHECKING

from trame.widgets import html
from trame.widgets import vuetify3 as v

from ..errors import FracsliceError
from ..formulas import Node
from .session import jpeg
from .widgets import named, named_by, slider

if TYPE_CHECKING:
    from .page import Page

QUALITY = 90
"""Quality of JPEG of a variation."""


def embedded(picture: bytes, kind: str = "jpeg") -> str:
    """Address of a picture that holds it."""
    return f"data:image/{kind};base64,{base64.b64encode(picture).decode()}"


class SheetPanel:
    """What the sheets show and do."""

    def __init__(self, page: Page) -> None:
        self.page, self.studio, self.state = page, page.studio, page.state
        self._roots: list[Node] = []  # of the variations that are shown
        self._first = self.studio.document.scene  # from which is mixed
        self.state.update(
            {
                "varying": False,
                "sheet": [],
                "spread": 0.3,
                "marking": False,
                "bookmarks": [],
                "mix": "",
                "mixed": 0.0,
            }
        )

    async def vary(self) -> None:
        """Show a sheet of variations of the scene, one after the other."""
        self._roots = []
        with self.state as state:
            state.varying, state.sheet = True, []
        made, loop = self.studio.variations(float(self.state.spread)), asyncio.get_running_loop()
        sheet = self._roots
        try:
            while (one := await loop.run_in_executor(None, next, made, None)) and sheet is self._roots:
                sheet.append(one[0])
                with self.state as state:
                    state.sheet = [*state.sheet, embedded(jpeg(one[1], QUALITY))]
        except FracsliceError as error:
            self.studio.message = str(error)

    def surprise(self) -> None:
        """Open something that nobody has seen yet."""
        self.studio.surprise()
        self.page.renamed()

    def toggle_bookmarks(self) -> None:
        """Show the bookmarks, or close them."""
        with self.state as state:
            state.marking = not state.marking
        self.list_bookmarks()

    def list_bookmarks(self) -> None:
        """Show the bookmarks that there are."""
        with self.state as state:
            state.mix = ""
            state.bookmarks = [
                {"name": name, "picture": embedded(self.studio.bookmarks.picture(name))}
                for name in self.studio.bookmarks.names
            ]

    def bookmark(self) -> None:
        """Keep the scene as it is and is seen."""
        self.studio.bookmark()
        self.list_bookmarks()

    def go_to(self, name: str) -> None:
        """Return to a bookmark."""
        self.studio.go_to(name)
        self.page.refresh()

    def drop(self, name: str) -> None:
        """Remove a bookmark."""
        self.studio.bookmarks.remove(name)
        self.list_bookmarks()

    def begin_mix(self, name: str) -> None:
        """Have a slider from what stands to a bookmark."""
        document = self.studio.document
        self._first = replace(document.scene, view=replace(document.scene.view, camera=self.studio.live.aim))
        with self.state as state:
            state.mix, state.mixed = name, 0.0

    def set_mix(self, share: float) -> None:
        """Show what lies between."""
        with self.state as state:
            state.mixed = float(share)
        self.studio.mix(self._first, self.state.mix, float(share))
        self.page.refresh()

    async def take(self, number: int) -> None:
        """Go on from a variation of the sheet."""
        self.studio.take(self._roots[number])
        self.page.refresh()
        await self.vary()

    def build_variations(self) -> None:
        """Lay the dialog of the variations out."""
        with (
            v.VDialog(v_model=("varying",), width=700, raw_attrs=named("Variations")),
            v.VCard(title="Variations: click to go on from one"),
        ):
            with html.Div(classes="d-flex flex-wrap justify-center", style="min-height: 480px"):
                html.Img(
                    v_for="(image, i) in sheet",
                    key="i",
                    src=("image",),
                    click=(self.take, "[i]"),
                    style="width: 216px; margin: 3px; cursor: pointer",
                    raw_attrs=[":alt=\"'variation ' + (i + 1)\""],
                )
            with html.Div(classes="d-flex align-center mx-4"):
                v.VSlider(
                    v_model=("spread",),
                    min=0.02,
                    max=1,
                    step=0.02,
                    label="Size of changes",
                    hide_details=True,
                )
                v.VBtn("Others", click=self.vary, variant="text")
                v.VBtn("Surprise me", click=self.surprise, variant="text")

    def build_bookmarks(self) -> None:
        """Lay what is beside the picture out."""
        with html.Div(classes="pa-2"):
            v.VBtn("Add this one", click=self.bookmark, variant="text")
            slider(
                self.page.ctrl,
                "'mix'",
                "mixed",
                (self.set_mix, "[$event]"),
                [],
                v_if="mix",
                min=0,
                max=1,
                step=0.01,
                label=("'to ' + mix",),
            )
            with v.VCard(v_for="b in bookmarks", key="b.name", variant="tonal", classes="ma-1"):
                html.Img(
                    src=("b.picture",),
                    click=(self.go_to, "[b.name]"),
                    style="width: 100%; display: block; cursor: pointer",
                    raw_attrs=[":alt=\"'bookmark ' + b.name\""],
                )
                with html.Div(classes="d-flex align-center text-caption px-2"):
                    html.Span("{{ b.name }}")
                    v.VSpacer()
                    v.VBtn("Mix", click=(self.begin_mix, "[b.name]"), size="x-small", variant="text")
                    v.VBtn(
                        icon="mdi-delete",
                        click=(self.drop, "[b.name]"),
                        size="x-small",
                        variant="text",
                        raw_attrs=named_by("'remove bookmark ' + b.name"),
                    )
