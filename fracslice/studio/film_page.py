"""Panel of the film below the picture: time, keyframes of all that moves, the record of a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trame.widgets import html
from trame.widgets import vuetify3 as v

from ..scene.view import CURVES
from . import keyframes
from .curve_page import CurvePanel
from .widgets import named, named_by, number_field, slider

if TYPE_CHECKING:
    from .page import Page

HEIGHT = 188
"""Of the panel, pixels."""


def at(seconds: str, style: str) -> str:
    """Style of what stands at a time of the film, an expression of the page."""
    return f"`position: absolute; left: ${{100 * {seconds} / length}}%; {style}`"


class FilmPanel:
    """What the panel of the film shows and does."""

    def __init__(self, page: Page) -> None:
        self.page, self.studio, self.state = page, page.studio, page.state
        self.state.update(
            {
                "filming": False,
                "seconds": 0.0,
                "length": keyframes.LENGTH,
                "playing": False,
                "recording": False,
                "tracks": [],
                "key": {},
                "curves": list(CURVES),
            }
        )
        self._curve = CurvePanel(page)

    def refresh(self) -> None:
        """Bring what is shown of the film up to date."""
        document, state = self.studio.document, self.state
        state.tracks = keyframes.rows(document)
        state.length = keyframes.duration(document) or keyframes.LENGTH
        if not any(self.state.key.get("of") == row["of"] for row in state.tracks):
            state.key = {}
        self._curve.refresh()

    def follow(self) -> None:
        """Show where the film is, while it plays."""
        player = self.studio.player
        if player.seconds is not None and round(player.seconds, 3) != self.state.seconds:
            with self.state as state:
                state.seconds = round(player.seconds, 3)
        if self.state.playing != player.is_playing:
            with self.state as state:
                state.playing = player.is_playing
            if not player.is_playing:
                self.page.refresh()

    def toggle(self) -> None:
        """Open the panel at the beginning of the film, or close it."""
        with self.state as state:
            state.filming = not state.filming
        self.seek(0.0 if self.state.filming else None)

    def seek(self, seconds: Any) -> None:
        """Look at a time."""
        self.studio.seek(None if seconds is None else max(float(seconds), 0.0))
        self.page.refresh()

    def play(self) -> None:
        """Play, or stop."""
        player = self.studio.player
        if player.is_playing:
            self.seek(player.seconds)
        else:
            player.play(keyframes.duration(self.studio.document))

    def key_view(self) -> None:
        """Set keyframes of the view at this time."""
        self.page.edit(keyframes.key_view, self.studio.document, self._seconds, self.studio.views.camera)

    def key_value(self, attribute: str) -> None:
        """Set a keyframe of an attribute of the chosen element at this time."""
        document = self.studio.document
        tag = document.chosen
        if tag:
            of = keyframes.path_of(document, tag, attribute)
            value = self.page.tree.value_of(attribute)
            self.page.edit(keyframes.set_keys, document, self._seconds, {of: value})

    def choose(self, of: str, seconds: float) -> None:
        """Choose a keyframe and look at its time."""
        with self.state as state:
            state.key = {"of": of, "seconds": seconds}
        self.seek(seconds)

    def remove_key(self) -> None:
        """Remove the chosen keyframe."""
        self.page.edit(
            keyframes.remove_key, self.studio.document, self.state.key["of"], self.state.key["seconds"]
        )
        with self.state as state:
            state.key = {}

    def move_key(self, to: float) -> None:
        """Move the chosen keyframe to another time."""
        key = self.state.key
        self.page.edit(keyframes.move_key, self.studio.document, key["of"], key["seconds"], to)
        self.choose(key["of"], to)

    def set_length(self, seconds: float) -> None:
        """Set the length of the film."""
        self.page.edit(keyframes.begin, self.studio.document, seconds)

    def set_curve(self, of: str, curve: str) -> None:
        """Choose the curve of a track."""
        self.page.edit(keyframes.set_curve, self.studio.document, of, curve)

    def record(self) -> None:
        """Begin to record a flight, or end it."""
        self.studio.record()
        with self.state as state:
            state.recording = self.studio.player.is_recording
        self.page.refresh()

    def make(self) -> None:
        """Ask for the file of the film."""
        with self.state as state:
            state.file_name = f"{self.studio.document.path.stem}.mp4"
            state.making = True

    @property
    def _seconds(self) -> float:
        return self.studio.player.seconds or 0.0

    def build(self) -> None:
        """Lay the panel out."""
        with html.Div(
            v_if="filming",
            style=f"height: {HEIGHT}px; overflow: auto",
            classes="pa-2",
            raw_attrs=['role="region"', 'aria-label="Film"'],
        ):
            with html.Div(classes="d-flex align-center"):
                v.VBtn(
                    icon=("playing ? 'mdi-pause' : 'mdi-play'",),
                    click=self.play,
                    size="small",
                    variant="text",
                    raw_attrs=named_by("playing ? 'Pause' : 'Play'"),
                )
                slider(
                    self.page.ctrl,
                    "'seconds'",
                    "seconds",
                    (self.seek, "[$event]"),
                    named("Time"),
                    min=0,
                    max=("length",),
                    step=0.01,
                )
                html.Span("{{ seconds.toFixed(2) }} s of", classes="text-caption mx-2")
                number_field(
                    "length", (self.set_length, "[$event.target.value]"), named("Length of the film, seconds")
                )
                for label, act in (("Key view", self.key_view), ("Make", self.make)):
                    v.VBtn(label, click=act, size="small", variant="text", classes="ml-2")
                v.VBtn(
                    "{{ recording ? 'End flight' : 'Record flight' }}",
                    click=self.record,
                    color=("recording ? 'error' : undefined",),
                    size="small",
                    variant="text",
                )
            with html.Div(v_if="graph.of"):
                self._curve.build()
            with html.Div(v_else=True):
                self._tracks()

    def _tracks(self) -> None:
        with html.Div(v_if="key.of", classes="d-flex align-center text-caption"):
            html.Span("{{ key.of }} at", classes="mr-2")
            number_field(
                "key.seconds", (self.move_key, "[$event.target.value]"), named("Time of the keyframe")
            )
            v.VBtn("Remove key", click=self.remove_key, size="small", variant="text")
        with html.Div(
            v_for="row in tracks", key="row.of", classes="d-flex align-center", style="height: 28px"
        ):
            v.VBtn(
                "{{ row.of }}",
                click=(self._curve.toggle, "[row.of]"),
                size="small",
                variant="text",
                classes="text-none justify-start px-0",
                style="width: 150px; overflow: hidden",
                raw_attrs=named_by("'curve of values of ' + row.of"),
            )
            v.VSelect(
                model_value=("row.curve",),
                items=("curves",),
                update_modelValue=(self.set_curve, "[row.of, $event]"),
                density="compact",
                variant="plain",
                hide_details=True,
                style="max-width: 104px; margin-top: -12px",
                raw_attrs=named_by("'curve of ' + row.of"),
            )
            with html.Div(style="position: relative; flex: 1; height: 100%; margin: 0 12px"):
                html.Div(style="position: absolute; top: 13px; width: 100%; border-top: 1px solid #8888")
                html.Div(style=(at("seconds", "top: 2px; height: 24px; border-left: 1px solid #e55"),))
                v.VBtn(
                    v_for="time in row.times",
                    key="time",
                    icon="mdi-rhombus",
                    size="x-small",
                    variant="text",
                    density="compact",
                    color=("key.of == row.of && key.seconds == time ? 'primary' : undefined",),
                    click=(self.choose, "[row.of, time]"),
                    style=(at("time", "top: 4px; margin-left: -10px"),),
                    raw_attrs=named_by("row.of + ' at ' + time + ' s'"),
                )
