"""The page of a studio: panels of trame and Vuetify beside our own frames."""

from __future__ import annotations

import asyncio
import math
import os
import secrets
import threading
import time
import webbrowser
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any, Literal

from aiohttp import web
from trame.app import get_server
from trame.ui.vuetify3 import VAppLayout
from trame.widgets import client, html, rca
from trame.widgets import vuetify3 as v

from ..common.messages import format_count
from ..errors import FracsliceError
from ..export.images import IMAGES
from ..rendering.live import CameraInput
from ..viewer.viewer import MOVES, PACES, Controls
from . import panels
from .film_page import HEIGHT, FilmPanel
from .inside_page import InsidePanel
from .session import FILMS, PRINT_ENDINGS, Session, jpeg
from .sheets import SheetPanel, embedded
from .widgets import NARROW, named, named_by, number_field

TICK = 1 / 60
"""Interval between two looks at the picture, seconds."""

QUALITIES = 75, 92
"""Quality of JPEG frames, of drafts and of pictures at rest."""

PENDING = 2
"""Frames that a page may have to fetch still before others are left out."""

GRADIENT = (
    "{width: '100%', height: '14px', borderRadius: '4px', marginBottom: '4px', "
    "background: `linear-gradient(90deg, ${[...c.stops, c.stops[0]].join(', ')})`}"
)
"""Style of the strip above the stops of a gradient, which returns to its first."""

STYLE = ".v-field-label, .text-medium-emphasis { opacity: 0.85 !important }"
"""Contrast of 4.5 and more, as WCAG 2 wants it, for labels of Vuetify."""

NAMED = """new MutationObserver(() =>
  document.querySelectorAll("img.image-display-area:not([alt])").forEach(i => i.alt = "Picture of the scene")
).observe(document, {childList: true, subtree: true})"""
"""Script that names the picture for those who do not see it, as the widget of the picture cannot."""

PAD = """let still = true;
setInterval(() => {
  const pad = [...navigator.getGamepads()].find(p => p);
  if (!pad) return;
  const bent = pad.axes.slice(0, 4).map(a => Math.abs(a) < 0.12 ? 0 : a);
  const axes = [...bent, (pad.buttons[7]?.value ?? 0) - (pad.buttons[6]?.value ?? 0)];
  const rests = axes.every(a => a === 0);
  if (!rests || !still) window.trame.trigger("pad", [axes]);
  still = rests;
}, 33)"""
"""Script that tells of a gamepad: both sticks, and the shoulder buttons that are pressed by degrees."""

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

CONTROL = {"z": "undo", "y": "redo"}
"""What keys do with ctrl."""

ACTIONS = ("v", "x", ",", ".", "?")
"""Keys of the picture that do something once."""

TWICE, NEAR = 0.35, 5.0
"""Longest time between the clicks of a double click, seconds, and their distance, pixels."""

BAR = 48
"""Height of the bar above the picture, pixels."""

AWAY = 30.0
"""Time after the last tab was closed in which another one finds the same, seconds."""

AREA = "picture"


class Frames:
    """The area of the picture: sends frames, receives sizes and what the mouse and the keys do."""

    area_name = AREA

    def __init__(self, studio: Session, act: Callable[[str], None]) -> None:
        self._studio, self._act = studio, act
        self._streamer: Any = None
        self._sent: object = None
        self._pressed, self._pressed_at = 0.0, (0.0, 0.0)
        self._drag: Callable[[float, float], None] | None = None
        self.mouse = 0.0, 0.0  # pixels from the upper left corner
        self._pad = CameraInput()
        self.controls = Controls()

    def set_streamer(self, streamer: Any) -> None:
        """Have the streamer of a page; called by trame-rca."""
        self._streamer, self._sent = streamer, None

    def update_size(self, _: str, size: dict[str, Any]) -> None:
        """Follow the size of the area, pixels of the page."""
        self._studio.live.resize((max(int(size.get("w", 0)), 16), max(int(size.get("h", 0)), 16)))
        self._sent = None

    def reset(self) -> None:
        """Send the picture once more."""
        self._sent = None

    def on_interaction(self, _: str, event: dict[str, Any]) -> None:
        """Do what an event of the mouse or a key says."""
        kind, views, inside = event.get("type", ""), self._studio.views, self._studio.inside
        if kind in ("KeyDown", "KeyPress", "KeyUp"):
            self.key(str(event.get("key", "")).lower(), kind != "KeyUp", bool(event.get("controlKey")))
            return
        x, y = self.mouse
        if "x" in event:
            self.mouse = float(event["x"]), self._studio.live.size[1] - float(event["y"])
        if kind.endswith("ButtonPress"):
            self._press(kind == "LeftButtonPress" and not event.get("shiftKey"))
        elif kind.endswith("ButtonRelease"):
            self._drag = None
            if inside.measuring and math.dist(self.mouse, self._pressed_at) < NEAR:
                inside.pick(self.mouse)
        elif kind == "MouseMove" and self._drag:
            self._drag(self.mouse[0] - x, self.mouse[1] - y)
        elif kind == "MouseMove":
            inside.hover(self.mouse)
        elif kind == "MouseWheel":
            nearer = 1.0 if event.get("spinY", 0) < 0 else -1.0
            if inside.is_flat:
                inside.zoom(nearer)
            else:
                views.approach(nearer, self.mouse)

    def _press(self, around: bool) -> None:
        """Begin a drag around the point under the mouse or in place; a second click walks there."""
        views, inside, now = self._studio.views, self._studio.inside, time.monotonic()
        still = inside.is_flat or inside.measuring
        if not still and now - self._pressed < TWICE and math.dist(self.mouse, self._pressed_at) < NEAR:
            views.walk_to(self.mouse)
            return
        self._pressed, self._pressed_at = now, self.mouse
        if inside.is_flat:
            self._drag = inside.drag
            return
        self._drag = views.orbit if around else views.look_around
        if around:
            views.grip(self.mouse)

    def key(self, key: str, down: bool, control: bool = False) -> None:
        """Press or release a key."""
        if control:
            if down and key in CONTROL:
                self._act(CONTROL[key])
        elif not down:
            self.controls.release(key)
        elif key in MOVES or key in PACES:
            self.controls.press(key)
        elif key in ACTIONS:
            self._act(key)

    def bend(self, axes: list[float]) -> None:
        """Fly as a gamepad says: right and back, turn right and down, climb; -1 to 1 each."""
        right, back, yaw, down, climb = map(float, axes)
        self._pad = CameraInput(forward=-back, right=right, up=climb, yaw=yaw, pitch=-down)

    @property
    def input(self) -> CameraInput:
        """What keys and a gamepad want of the camera."""
        keys, pad = self.controls.input, self._pad
        axes = "forward", "right", "up", "yaw", "pitch"
        both = {axis: max(-1.0, min(1.0, getattr(keys, axis) + getattr(pad, axis))) for axis in axes}
        return replace(keys, **both)

    async def send(self) -> None:
        """Send the picture if there is a new one, and a page to send it to."""
        shown, inside = self._studio.shown, self._studio.inside
        now = shown, inside.overlay
        if now == self._sent or self._streamer is None:
            return
        self._sent = now
        still = shown.samples > 0
        loop = asyncio.get_running_loop()
        pixels = await loop.run_in_executor(None, inside.over, shown)
        data = await loop.run_in_executor(None, jpeg, pixels, QUALITIES[still])
        rows, columns, _ = pixels.shape
        meta = {"type": "image/jpeg", "codec": "", "w": columns, "h": rows, "st": 0, "key": "key"}
        self._streamer.push_content(AREA, meta, data)


class Page:
    """The page and what it does."""

    def __init__(self, studio: Session) -> None:
        self.studio, self.token = studio, secrets.token_urlsafe(24)
        self.server = get_server(f"fracslice-{self.token[:8]}", client_type="vue3")
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
                "dragged": [],
                "axis": "",
                "share": 0.5,
                "scenes": studio.scenes,
                "dark": True,
                "file_name": f"{studio.document.path.stem}.3mf",
                "resolution": 256,
                "samples": 64,
                "status": "",
                "job": {},
            }
        )
        self.sheets = SheetPanel(self)
        self.film = FilmPanel(self)
        self.inside = InsidePanel(self)
        self.refresh()
        self.state.change("xml")(self.write)
        self._tabs, self._left = 0, 0.0
        self.server.trigger("drop")(self.drop)
        self.server.trigger("pad")(self.frames.bend)
        self.ctrl.on_server_bind.add(self.guard)
        self.ctrl.on_server_ready.add(lambda **_: asyncio.get_running_loop().create_task(self.follow()))
        self.build()

    def refresh(self) -> None:
        """Bring what the page shows of the document up to date."""
        document = self.studio.document
        tag = document.chosen
        with self.state as state:
            state.rows = panels.outline(document)
            state.panel = panels.controls(self.studio.at_time(tag)) if tag else []
            state.at = list(document.version.at)
            state.tag = tag.name if tag else ""
            state.xml = document.text
            state.problem = document.problem or self.studio.message
            state.undoes, state.redoes, state.saved = document.undoes, document.redoes, document.is_saved
            self.film.refresh()

    def edit(self, change: Callable[..., None], *arguments: Any) -> None:
        """Change the document and the page."""
        self.studio.edit(change, *arguments)
        self.refresh()

    def act(self, key: str) -> None:
        """Do what a key of the picture or of the page means."""
        document = self.studio.document
        if key == "v":
            self.studio.views.home()
        elif key == "x":
            self.studio.focus_on(self.frames.mouse)
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

    def turn_on(self, start: int) -> None:
        """Turn an element on again."""
        self.edit(self.studio.document.turn_on, start)

    def drop(self, place: list[int], onto: list[int]) -> None:
        """Move an element before the one that it is dropped on."""
        if place != onto:
            self.edit(self.studio.document.move, tuple(place), tuple(onto))

    def choose(self, place: list[int]) -> None:
        """Choose an element."""
        self.studio.document.choose(tuple(place))
        self.refresh()

    def add(self, name: str, around: bool) -> None:
        """Add an element to the chosen one, or put it around that."""
        document, at = self.studio.document, self.studio.document.version.at
        self.shut("adding", "wrapping")
        if any(choice["name"] == name and choice["kind"] == "part" for choice in self.state.choices):
            at = ()
        if around:
            self.edit(document.wrap, at, name)
        else:
            self.edit(document.add, at, name)

    def change(self, edit: Literal["duplicate", "unwrap", "turn_off", "remove"]) -> None:
        """Change the chosen element."""
        document = self.studio.document
        self.edit(getattr(document, edit), document.version.at)

    def shift(self, by: int) -> None:
        """Move the chosen element up or down among its siblings."""
        at = self.studio.document.version.at
        if at and at[-1] + by >= 0:
            self.edit(self.studio.document.move, at, (*at[:-1], at[-1] + by + (by > 0)))

    def set_text(self, name: str, value: str | None) -> None:
        """Give an attribute of the chosen element a text; none takes it away."""
        self.studio.set_value(self.studio.document.version.at, name, value or None)
        self.refresh()

    def value_of(self, name: str) -> str:
        """Text of an attribute of the chosen element, as its control shows it."""
        return str(next(control["text"] for control in self.state.panel if control["name"] == name))

    def set_number(self, name: str, index: int, value: Any) -> None:
        """Give a number of an attribute a value."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            return
        self.studio.set_number(self.studio.document.version.at, name, int(index), number)
        self.refresh()

    def set_colour(self, name: str, index: int, value: str | None) -> None:
        """Give a colour of an attribute another value, add it behind the last, or take it away."""
        control = next(control for control in self.state.panel if control["name"] == name)
        stops = list(control["stops"])
        stops[index : index + 1] = [] if value is None else [value]
        self.set_text(name, panels.colour_text(stops))

    def write(self, xml: str, **_: Any) -> None:
        """Take the text of the editor."""
        if xml != self.studio.document.text:
            self.edit(self.studio.document.write, xml, None, "text")

    def make(self) -> None:
        """Make the file that the page names."""
        name, options = self.state.file_name, self.options
        try:
            self.studio.start(name, options)
        except FracsliceError as error:
            self.studio.message = str(error)
        self.refresh()

    @property
    def options(self) -> dict[str, Any]:
        """Options of the file that the page names."""
        if str(self.state.file_name).lower().endswith((*IMAGES, *FILMS)):
            return {"samples": int(self.state.samples)}
        if str(self.state.file_name).lower().endswith(PRINT_ENDINGS):
            return self.studio.inside.layer_options
        return {"resolution": float(self.state.resolution)}

    def cancel(self) -> None:
        """Cancel what is being made."""
        if self.studio.job:
            self.studio.job.cancel.set()

    async def follow(self) -> None:
        """Steer by the keys that are held, send frames, and say how far things are, until the server ends."""
        while True:
            self.studio.views.steer(self.frames.input)
            self.studio.advance()
            await self.frames.send()
            self.film.follow()
            self._say()
            self.inside.follow()
            self._forget()
            await asyncio.sleep(TICK)

    def _count_tabs(self, more: int) -> None:
        """Note that a tab was opened, or closed, or nothing of either."""
        self._tabs, self._left = self._tabs + more, time.monotonic()

    def _forget(self) -> None:
        """Free what was made to look at, some time after the last tab was closed."""
        inside = self.studio.inside
        if self._tabs == 0 and inside.has_made and time.monotonic() - self._left > AWAY:
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

    def guard(self, server: Any) -> None:
        """Refuse requests that were made to another host, or by the page of another site; count tabs."""

        @web.middleware
        async def refuse(
            request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
        ) -> web.StreamResponse:
            port = server.get_port()
            known = {f"{name}:{port}" for name in ("127.0.0.1", "localhost", "[::1]", server.host)}
            origin = request.headers.get("Origin")
            if request.host not in known or (origin and origin.partition("//")[2] not in known):
                raise web.HTTPForbidden(text="expected the address that fracslice studio has printed")
            is_tab = request.headers.get("Upgrade", "").lower() == "websocket"
            self._count_tabs(is_tab)
            try:
                return await handler(request)
            finally:
                self._count_tabs(-is_tab)

        server.app.middlewares.append(refuse)

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
        return f"http://{name}:{self.server.port}/index.html?secret={self.token}"

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
            with v.VNavigationDrawer(permanent=True, width=360, raw_attrs=named("Scene")):
                self._tree()
                v.VDivider()
                self._panel()
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
                        click=(self.film.key_value, "[c.name]"),
                        raw_attrs=named_by("'keyframe of ' + c.name"),
                    )
                with (
                    html.Template(v_if="c.kind == 'slider'"),
                    html.Div(v_for="(value, i) in c.values", key="i", classes="d-flex align-center"),
                ):
                    v.VSlider(
                        model_value=("value",),
                        update_modelValue=(self.set_number, "[c.name, i, $event]"),
                        min=("c.least",),
                        max=("c.most",),
                        step=("c.step",),
                        density="compact",
                        hide_details=True,
                        raw_attrs=named_by("c.name + ' ' + (i + 1)"),
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
            area = rca.RemoteControlledArea(
                name=AREA,
                display="image",
                send_mouse_move=True,
                event_throttle_ms=15,
                image_style=("{ width: '100%', height: '100%', objectFit: 'contain' }",),
            )
            area.set_drop_frames_pending_network_limit(PENDING)
            area.add_view_handler(self.frames)
            with html.Div(
                classes="d-flex align-center",
                style="position: absolute; right: 8px; top: 8px; width: 300px; color: #eee",
            ):
                for axis in ("x", "y", "z"):
                    v.VBtn(
                        axis,
                        click=(self.cut, f"[axis == '{axis}' ? '' : '{axis}', share]"),
                        active=(f"axis == '{axis}'",),
                        size="small",
                        variant="text",
                        raw_attrs=named(f"Cut across {axis}"),
                    )
                v.VSlider(
                    v_if="axis",
                    model_value=("share",),
                    update_modelValue=(self.cut, "[axis, $event]"),
                    min=0,
                    max=1,
                    step=0.005,
                    hide_details=True,
                    density="compact",
                    raw_attrs=named("Place of the cut"),
                )
            with html.Div(style="position: absolute; left: 8px; top: 8px"):
                self.inside.modes()
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

    def _dialogs(self) -> None:
        found = "choices.filter(c => (c.name + c.doc).includes(search)"
        around = f"{found} && c.kind != 'shape' && c.kind != 'part')"
        self._list("adding", "Add an element", f"{found})", (self.add, "[c.name, false]"))
        self._list("wrapping", "Wrap it in", around, (self.add, "[c.name, true]"))
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
                v_model=("file_name",), label="File: .stl .3mf .ply .obj .glb .png .jpg .mp4 .goo .sl1 ..."
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
