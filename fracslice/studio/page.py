"""The page of a studio: panels of trame and Vuetify beside our own frames."""

from __future__ import annotations

import asyncio
import math
import os
import secrets
import threading
import time
import webbrowser
from collections.abc import Callable
from typing import Any

from trame.app import get_server
from trame.ui.vuetify3 import VAppLayout
from trame.widgets import client, html
from trame.widgets import vuetify3 as v

from ..common.memory import return_freed_memory
from ..common.messages import format_count
from ..errors import FracsliceError, SceneError
from ..export.images import IMAGES
from . import panels
from .film_page import HEIGHT, FilmPanel
from .frames import DRAFT, PAD, Frames
from .gate import BAR, INDEX, TREE, Gate
from .inside_page import InsidePanel
from .session import FILMS, PRINT_ENDINGS, Session, jpeg
from .sheets import SheetPanel, embedded
from .tree_page import TreePanel
from .widgets import NARROW, legend, named, picture_area, slider

TICK = 1 / 60
"""Interval between two looks at the picture, seconds."""

TELLING = 0.1
"""Interval between two looks at the rest of what is shown, whose texts take a millisecond, seconds."""

STYLE = ".v-field-label, .text-medium-emphasis { opacity: 0.85 !important }"
"""Contrast of 4.5 and more, as WCAG 2 wants it, for labels of Vuetify."""

NAMED = """new MutationObserver(() =>
  document.querySelectorAll("img.image-display-area:not([alt])").forEach(i => i.alt = "Picture of the scene")
).observe(document, {childList: true, subtree: true})"""
"""Script that names the picture for those who do not see it, as the widget of the picture cannot."""

AGAIN = f"""setInterval(() => {{
  if (window.trame?.state.get("trame_error_report_msg"))
    fetch("{INDEX}").then(answer => answer.ok && location.reload()).catch(() => {{}});
}}, 1000)"""
"""Script that loads the page again once the server can be reached, after the machine of either has slept."""

SMALL = (
    f"{{width: '{panels.CELL[0]}px', height: '{panels.CELL[1]}px', flexShrink: 0, borderRadius: '4px', "
    "background: `url(${thumbnails})`, backgroundPosition: pictures[c.name]}"
)
"""Style of the small picture of a row."""

HELP = (
    ("drag", "turn around what is under the mouse"),
    ("shift or right drag", "look around"),
    ("wheel", "come nearer to what is under the mouse, go away"),
    ("double click", "walk to what is under the mouse"),
    ("X", "focus on what is under the mouse"),
    ("W S A D R F, Q E", "fly, roll"),
    ("gamepad", "fly by the sticks, climb by the triggers"),
    ("1 to 9", "pace"),
    ("V", "first view"),
    (", .", "the view before, after"),
    ("ctrl Z, ctrl Y", "undo, redo"),
    ("?", "this help"),
)

TIDYING = 10.0
"""Time between two times that memory is given back, seconds."""

AWAY = 30.0
"""Time after the last tab was closed in which another one finds the same, seconds."""


class Page:
    """The page and what it does."""

    def __init__(self, studio: Session) -> None:
        self.studio, self.token = studio, secrets.token_urlsafe(24)
        self.server = get_server(f"fracslice-{self.token[:8]}", client_type="vue3")
        self.gate = Gate(self.server, self.token, lambda: jpeg(studio.shown.pixels, DRAFT))
        self.state, self.ctrl = self.server.state, self.server.controller
        self.frames = Frames(studio, self.act)
        self.state.trame__title = f"{studio.document.path.stem} - fracslice"
        self.state.update(
            {
                "choices": panels.choices(),
                "thumbnails": embedded(panels.THUMBNAILS.read_bytes(), "webp"),
                "pictures": panels.places_of_pictures(),
                "search": "",
                "adding": False,
                "wrapping": False,
                "editing": False,
                "helping": False,
                "making": False,
                "opening": False,
                "axis": "",
                "share": 0.5,
                "scenes": studio.scenes,
                "dark": True,
                "held": {},
                "file_name": f"{studio.document.path.stem}.3mf",
                "resolution": 256,
                "samples": 64,
                "status": "",
                "job": {},
            }
        )
        self.state.client_only("held")
        self.tree = TreePanel(self)
        self.sheets = SheetPanel(self)
        self.film = FilmPanel(self)
        self.inside = InsidePanel(self)
        self.refresh()
        self.state.change("xml")(self.write)
        self.server.trigger("pad")(self.frames.bend)
        self.ctrl.on_server_ready.add(self.begin)
        self.build()

    def refresh(self) -> None:
        """Bring what the page shows of the document up to date."""
        document = self.studio.document
        with self.state as state:
            self.tree.refresh()
            state.xml = document.text
            state.problem = document.problem or self.studio.message
            state.undoes, state.redoes, state.saved = document.undoes, document.redoes, document.is_saved
            self.film.refresh()

    def edit(self, change: Callable[..., None], *arguments: Any) -> None:
        """Change the document and the page."""
        self.studio.edit(change, *arguments)
        self.refresh()

    def act(self, key: str) -> None:
        """Do what a key of the picture or of the page means, or follow what was done in the picture."""
        document = self.studio.document
        if key == "v":
            self.studio.views.home()
        elif key == "x":
            self.studio.focus_on(self.frames.mouse)
            self.refresh()
        elif key == "moved":
            self.refresh()
        elif key in (",", "."):
            self.studio.views.back(1 if key == "," else -1)
        elif key == "?":
            with self.state as state:
                state.helping = not state.helping
        elif key == "undo":
            self.edit(document.undo)
        elif key == "redo":
            self.edit(document.redo)
        elif key == "save":
            self.save()

    def save(self) -> None:
        """Save the scene."""
        try:
            self.studio.save()
        except FracsliceError as error:
            self.studio.message = str(error)
        self.refresh()

    def open(self, source: str) -> None:
        """Open another scene."""
        self.studio.message = ""
        try:
            self.studio.open(source)
        except FracsliceError as error:
            self.studio.message = str(error)
        self.shut("opening")
        self.renamed()

    def renamed(self) -> None:
        """Show the name of another scene, and all of it."""
        with self.state as state:
            state.file_name = f"{self.studio.document.path.stem}.3mf"
            state.trame__title = f"{self.studio.document.path.stem} - fracslice"
        self.refresh()

    def shut(self, *dialogs: str) -> None:
        """Close dialogs, though a page may have opened them by itself."""
        with self.state as state:
            state.update(dict.fromkeys(dialogs, False))
            state.dirty(*dialogs)

    def cut(self, axis: str, share: Any) -> None:
        """Cut the picture open, or close it."""
        with self.state as state:
            state.axis, state.share = axis, float(share)
        self.studio.cut(axis, float(share))

    def write(self, xml: str, **_: Any) -> None:
        """Take the text of the editor."""
        if xml != self.studio.document.text:
            self.edit(self.studio.document.write, xml, None, "text")

    def make(self) -> None:
        """Make the file that the page names."""
        try:
            self.studio.start(self.state.file_name, self.options)
        except FracsliceError as error:
            self.studio.message = str(error)
        self.refresh()

    @property
    def options(self) -> dict[str, Any]:
        """Options of the file that the page names."""
        if str(self.state.file_name).lower().endswith((*IMAGES, *FILMS)):
            return {"samples": int(_number(self.state.samples, "samples"))}
        if str(self.state.file_name).lower().endswith(PRINT_ENDINGS):
            return self.studio.inside.layer_options
        return {"resolution": _number(self.state.resolution, "voxels")}

    def cancel(self) -> None:
        """Cancel what is being made."""
        if self.studio.job:
            self.studio.job.cancel.set()

    def begin(self, **_: Any) -> None:
        """Begin what lasts until the server ends; asyncio itself does not keep its tasks."""
        self._tasks = [asyncio.get_running_loop().create_task(of()) for of in (self.follow, self.tidy)]

    async def follow(self) -> None:
        """Steer by the keys that are held, send frames, and say how far things are, until the server ends."""
        told = -math.inf
        while True:
            self.studio.views.steer(self.frames.input)
            self.studio.advance()
            await self.frames.send()
            self.film.follow()
            if (now := time.monotonic()) - told > TELLING:
                told = now
                self._say()
                self.inside.follow()
            await asyncio.sleep(TICK)

    async def tidy(self) -> None:
        """Give memory back, until the server ends.

        A change of the scene compiles in threads, and glibc keeps up to 32 MiB that each has freed.
        """
        while True:
            await asyncio.sleep(TIDYING)
            self._forget()
            await asyncio.to_thread(return_freed_memory)

    def _forget(self) -> None:
        """Free what was made to look at, some time after the last tab was closed."""
        inside = self.studio.inside
        if inside.has_made and self.gate.empty_for > AWAY:
            inside.release()

    def _say(self) -> None:
        """Bring the line below the picture, and that of the job, up to date."""
        shown, job = self.studio.shown, self.studio.job
        state = "draft" if shown.samples < 1 else f"{format_count(round(shown.samples), 'sample')} a pixel"
        state = state if self.studio.inside.mode == "field" else self.studio.inside.mode
        making = "   compiling ..." if self.studio.live.making else ""
        status = f"{state}   surface at {shown.distance:.2g}   pace {self.frames.controls.pace:.2g}{making}"
        told = {}
        if job:
            line = job.result or job.problem or job.stage
            told = {"line": line, "share": round(100 * job.share), "done": job.is_done}
            told["command"] = job.command
        said = self.studio.inside.message or self.studio.message
        problem = self.studio.document.problem or said or shown.problem
        changes = {"status": status, "job": told, "problem": problem}
        if any(self.state[name] != value for name, value in changes.items()):
            with self.state as state_now:
                state_now.update(changes)

    def serve(self, host: str, port: int, browser: bool, say: Callable[[str], None]) -> None:
        """Serve the page until it is interrupted; `say` is given its address."""

        def ready(**_: Any) -> None:
            address = self._address(host)
            say(address)
            if browser:
                webbrowser.open(address)

        self.ctrl.on_server_ready.add(ready)
        self._start(host, port)

    def serve_in_background(self, host: str = "127.0.0.1") -> str:
        """Serve the page in a thread while the program runs; return its address."""
        ready = threading.Event()
        self.ctrl.on_server_ready.add(lambda **_: ready.set())

        async def serve() -> None:
            await self._start(host, 0, exec_mode="coroutine", thread=True)

        # the loop of a notebook is not ours to wait in
        thread = threading.Thread(target=asyncio.run, args=(serve(),), name="fracslice studio", daemon=True)
        thread.start()
        ready.wait()
        return self._address(host)

    def _address(self, host: str) -> str:
        name = "127.0.0.1" if host in ("localhost", "0.0.0.0", "::") else host
        return f"http://{name}:{self.server.port}{self.gate.path}"

    def _start(self, host: str, port: int, **how: Any) -> Any:
        os.environ["TRAME_ARGS"] = f"--authKey={self.token}"  # instead of this program's own arguments
        os.environ["WSLINK_READY_MSG"] = ""
        return self.server.start(
            port=port,
            host=host,
            open_browser=False,
            show_connection_info=False,
            disable_logging=True,
            timeout=0,
            **how,
        )

    def build(self) -> None:
        """Lay the page out."""
        with VAppLayout(self.server, theme=("dark ? 'dark' : 'light'",)) as layout:
            self._bar()
            with v.VNavigationDrawer(permanent=True, width=TREE, raw_attrs=named("Scene")):
                self.tree.build()
            with v.VNavigationDrawer(
                v_model=("editing",),
                location="right",
                width=460,
                mobile_breakpoint=NARROW,
                raw_attrs=named("Editor"),
            ):
                self._editor()
            with v.VNavigationDrawer(
                v_model=("marking",), location="right", width=240, raw_attrs=named("Bookmarked")
            ):
                self.sheets.build_bookmarks()
            self.inside.build()
            with v.VMain(style="height: 100vh"):
                self._picture()
                self.film.build()
            self._dialogs()
            client.Style(STYLE)
            client.Script(NAMED)
            client.Script(AGAIN)
            client.Script(PAD)
        self.layout = layout

    def _bar(self) -> None:
        with v.VAppBar(density="compact"):
            v.VAppBarTitle("{{ trame__title }}{{ saved ? '' : ' *' }}", tag="h1")
            v.VBtn(icon="mdi-folder-open", click="opening = true; search = ''", raw_attrs=named("Open"))
            v.VBtn(
                icon="mdi-bookmark-multiple", click=self.sheets.toggle_bookmarks, raw_attrs=named("Bookmarks")
            )
            v.VBtn(
                icon="mdi-dice-5",
                click=self.sheets.vary,
                raw_attrs=named("Vary", "Variations of the numbers"),
            )
            for icon, label, act, off in (
                ("mdi-undo", "Undo", "undo", "undoes == 0"),
                ("mdi-redo", "Redo", "redo", "redoes == 0"),
                ("mdi-content-save", "Save", "save", "false"),
                ("mdi-home", "First view", "v", "false"),
                ("mdi-arrow-left", "View before", ",", "false"),
                ("mdi-arrow-right", "View after", ".", "false"),
                ("mdi-help", "Help", "?", "false"),
            ):
                v.VBtn(icon=icon, click=(self.act, f"['{act}']"), disabled=(off,), raw_attrs=named(label))
            v.VBtn(
                icon="mdi-camera-marker",
                click=self.keep_view,
                raw_attrs=named("Write this view into the scene"),
            )
            v.VBtn(
                icon="mdi-layers-search",
                click="looking_inside = !looking_inside",
                raw_attrs=named("Inside", "Mesh, layers, check, measures"),
            )
            v.VBtn(icon="mdi-xml", click="editing = !editing", raw_attrs=named("Text", "Text of the scene"))
            v.VBtn(icon="mdi-filmstrip", click=self.film.toggle, raw_attrs=named("Film"))
            v.VBtn(icon="mdi-cube-send", click="making = true", raw_attrs=named("Make a file", "Make a file"))
            v.VBtn(
                icon="mdi-theme-light-dark",
                click="dark = !dark",
                raw_attrs=named("Light or dark", "Light or dark"),
            )

    def keep_view(self) -> None:
        """Write the camera into the scene."""
        self.studio.keep_view()
        self.refresh()

    def _editor(self) -> None:
        html.Textarea(
            v_model=("xml",),
            raw_attrs=[*named("Text of the scene"), 'spellcheck="false"'],
            style="width: 100%; height: calc(100vh - 80px); font: 12px monospace; color: inherit",
            classes="pa-2",
        )

    def _picture(self) -> None:
        below = f"${{filming ? {BAR + HEIGHT} : {BAR}}}px"
        with html.Div(style=(f"`position: relative; background: #181a1d; height: calc(100vh - {below})`",)):
            picture_area(self.server, self.frames)
            with html.Div(
                classes="d-flex flex-wrap justify-space-between",
                style="position: absolute; left: 8px; right: 8px; top: 8px; pointer-events: none; gap: 4px",
            ):
                with html.Div(style="pointer-events: auto"):
                    self.inside.modes()
                self._cuts()
            html.Div(
                "{{ status }}",
                style="position: absolute; left: 8px; bottom: 6px; color: #eee; text-shadow: 0 0 3px #000",
                classes="text-caption",
                raw_attrs=['role="status"'],
            )
            v.VAlert(
                "{{ problem }}",
                v_if="problem",
                type="warning",
                density="compact",
                style="position: absolute; left: 8px; right: 8px; top: 56px",
            )
            with v.VCard(
                v_if="job.line",
                style="position: absolute; right: 8px; bottom: 8px; width: 340px",
                classes="pa-2",
            ):
                html.Div("{{ job.line }}", classes="text-caption")
                v.VProgressLinear(v_if="!job.done", model_value=("job.share",), raw_attrs=named("Progress"))
                html.Code("{{ job.command }}", classes="text-caption")
                v.VBtn("Cancel", v_if="!job.done", size="small", variant="text", click=self.cancel)

    def _cuts(self) -> None:
        """What cuts the picture open."""
        with html.Div(style="width: 300px; color: #eee; pointer-events: auto"):
            with html.Div(classes="d-flex align-center"):
                for axis in ("x", "y", "z"):
                    v.VBtn(
                        axis,
                        click=(self.cut, f"[axis == '{axis}' ? '' : '{axis}', share]"),
                        active=(f"axis == '{axis}'",),
                        size="small",
                        variant="text",
                        raw_attrs=named(f"Cut across {axis}"),
                    )
                slider(
                    self.ctrl,
                    "'cut'",
                    "share",
                    (self.cut, "[axis, $event]"),
                    named("Place of the cut"),
                    v_if="axis",
                    min=0,
                    max=1,
                    step=0.005,
                )
                v.VBtn(
                    icon="mdi-gradient-vertical",
                    v_if="axis && inside.mode == 'field'",
                    click=(self.inside.toggle, "['distances']"),
                    active=("inside.distances",),
                    size="small",
                    variant="text",
                    raw_attrs=named("Distances in the cut"),
                )
            with html.Div(v_if="axis && inside.face && inside.mode == 'field'", classes="text-caption"):
                legend("inside.face")

    def _dialogs(self) -> None:
        found = "choices.filter(c => (c.name + c.doc).includes(search)"
        around = f"{found} && c.kind != 'shape' && c.kind != 'part')"
        self._list("adding", "Add an element", f"{found})", (self.tree.add, "[c.name, false]"))
        self._list("wrapping", "Wrap it in", around, (self.tree.add, "[c.name, true]"))
        scenes = "scenes.filter(c => (c.name + c.doc).includes(search))"
        self._list("opening", "Open a scene", scenes, (self.open, "[c.name]"))
        self.sheets.build_variations()
        with (
            v.VDialog(v_model=("helping",), width=460, raw_attrs=named("Help")),
            v.VCard(title="Help"),
            v.VTable(),
            html.Tbody(),
        ):
            for keys, meaning in HELP:
                with html.Tr():
                    html.Td(keys)
                    html.Td(meaning)
        with (
            v.VDialog(v_model=("making",), width=460, raw_attrs=named("Make a file")),
            v.VCard(title="Make a file", classes="pa-3"),
        ):
            v.VTextField(
                v_model=("file_name",),
                label="File: .stl .3mf .obj .glb .png .jpg .mp4 .goo .sl1 .ipynb ...",
            )
            v.VTextField(v_model=("resolution",), type="number", label="Voxels along the longest side")
            v.VTextField(v_model=("samples",), type="number", label="Samples a pixel, of a picture or a film")
            v.VBtn("Make", click=(self.make_and_close,), color="primary")

    def _list(self, flag: str, title: str, rows: str, click: tuple[Callable[..., None], str]) -> None:
        """Dialog with a search and the rows `c` that it leaves: picture, name and description."""
        with v.VDialog(v_model=(flag,), width=720, raw_attrs=named(title)), v.VCard(title=title):
            v.VTextField(v_model=("search",), label="Search", autofocus=True, classes="mx-4")
            with (
                v.VList(
                    density="compact", classes="d-flex flex-wrap", style="max-height: 64vh; overflow: auto"
                ),
                v.VListItem(v_for=f"c in {rows}", key="c.name", click=click, style="width: 50%"),
                html.Div(classes="d-flex align-center"),
            ):
                html.Div(v_if="pictures[c.name]", style=(SMALL,), classes="mr-3")
                with html.Div(style="min-width: 0"):
                    html.Div("{{ c.name }}")
                    html.Div("{{ c.doc }}", classes="text-caption text-medium-emphasis")

    def make_and_close(self) -> None:
        """Make the file and close the dialog."""
        self.shut("making")
        self.make()


def _number(text: Any, of: str) -> float:
    """Number of a field that may be empty."""
    try:
        return float(text)
    except (TypeError, ValueError):
        raise SceneError(f"{of}: expected a number, not '{text or ''}'") from None
