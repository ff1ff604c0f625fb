"""The curve of a track in the panel of the film: values over time, dragged by their dots and handles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from trame.widgets import html
from trame.widgets import vuetify3 as v
from trame_client.widgets.core import AbstractElement

from ..animation import Timeline
from ..errors import SceneError
from . import keyframes
from .widgets import named, named_by, number_field

if TYPE_CHECKING:
    from .page import Page

Graph = dict[str, Any]
"""Curve as a page draws it; places in percent of the width and, from above, of the height."""

STEPS = 240
"""Straight pieces of a curve that is drawn."""

ARM = 0.06
"""Length of a handle in time, of that of the film."""

MARGIN = 0.12
"""Room above and below the values, of their range."""

APART = 1e-4
"""Times between which a slope is measured, of the length of the film."""

COLOURS = "#ef7d7d", "#7fc98a", "#6fb1ef", "#e8c558"
"""Of the numbers of an attribute."""


def graph_of(film: Timeline, of: str, limits: tuple[float, float] | None = None) -> Graph:
    """The curve of a track, between the limits of its values that are given, or that it has."""
    length, track = film.animation.duration, next(track for track in film.scene.tracks if track.of == of)
    times = np.linspace(0.0, length, STEPS + 1)
    values = np.array([film.numbers(of, time) for time in times.tolist()])
    if not values.size:
        return {}
    low, high = limits or _limits(values)

    def place(time: float, value: float) -> tuple[float, float]:
        return 100 * time / length, 100 * (high - value) / (high - low)

    lines = [
        " ".join(
            "{:.2f},{:.2f}".format(*place(*at)) for at in zip(times.tolist(), column.tolist(), strict=True)
        )
        for column in values.T
    ]
    sides, dots = (-1, 1) if film.curve_of(of) == "smooth" else (), []
    for time in (time for time, _ in track.keys if time <= length):
        slopes = _slopes(film, of, time)
        for part, (value, slope) in enumerate(zip(film.numbers(of, time), slopes, strict=True)):
            arms = [side * ARM * length for side in sides]
            handles = [place(time + arm, value + slope * arm) for arm in arms]
            dots.append({"time": time, "part": part, "at": place(time, value), "handles": handles})
            dots[-1] |= {"value": float(f"{value:.6g}"), "slope": float(f"{slope:.4g}")}
    return {"of": of, "low": low, "high": high, "lines": lines, "dots": dots}


def _limits(values: np.ndarray) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    room = MARGIN * (high - low) or max(abs(high), 1.0)
    return low - room, high + room


def _slopes(film: Timeline, of: str, time: float) -> list[float]:
    """Slope of each number at a time, per second."""
    length = film.animation.duration
    before, after = max(time - APART * length, 0.0), min(time + APART * length, length)
    pairs = zip(film.numbers(of, before), film.numbers(of, after), strict=True)
    return [(last - first) / (after - before) for first, last in pairs]


class CurvePanel:
    """What the curve shows and does."""

    def __init__(self, page: Page) -> None:
        self._page, self._studio, self._state = page, page.studio, page.state
        self._state.update({"graph": {}, "dot": {}, "grip": {}, "part_colours": list(COLOURS)})
        self._state.client_only("grip")
        self._held: tuple[float, float] | None = None  # limits of the values while something is dragged
        page.server.trigger("drag_curve")(self.drag)
        page.server.trigger("drop_curve")(self.drop)

    def refresh(self) -> None:
        """Draw it as it is now, between the same limits during a drag; not while the panel is closed."""
        of = self._state.graph.get("of")
        if of is None or self._studio.player.seconds is None:
            return
        with self._state as state:
            try:
                film = self._studio.film
                state.graph = graph_of(film, of, self._held) if film else {}
            except (SceneError, StopIteration):
                state.graph = {}
            dots = state.graph.get("dots", [])
            same = (dot for dot in dots if (dot["time"], dot["part"]) == self._chosen)
            state.dot = next(same, {})

    def toggle(self, of: str) -> None:
        """Show the curve of a track, or none."""
        with self._state as state:
            state.graph = {} if state.graph.get("of") == of else {"of": of}
        self.refresh()

    def choose(self, time: float, part: int) -> None:
        """Choose a dot."""
        with self._state as state:
            state.dot = {"time": time, "part": part}
        self.refresh()

    @property
    def _of(self) -> str:
        return str(self._state.graph["of"])

    @property
    def _chosen(self) -> tuple[float, int]:
        return self._state.dot.get("time", -1.0), self._state.dot.get("part", 0)

    def drag(self, kind: str, x: float, y: float) -> None:
        """Move the chosen dot (`value`) or one of its handles (`slope`) to a place, shares of the picture."""
        time, length = self._chosen[0], keyframes.duration(self._studio.document)
        low, high = self._held = self._held or (self._state.graph["low"], self._state.graph["high"])
        value, arm = high - y * (high - low), x * length - time
        if kind == "value":
            self.set_value(value)
        elif abs(arm) > APART * length:
            self.set_slope((value - self._state.dot["value"]) / arm)

    def drop(self) -> None:
        """End a drag."""
        self._held = None
        self.refresh()

    def set_value(self, value: float) -> None:
        """Change the number of the chosen dot."""
        self._page.edit(keyframes.set_number, self._studio.document, self._of, *self._chosen, value)

    def set_slope(self, slope: float) -> None:
        """Change the slope at the chosen dot, per second."""
        time, part = self._chosen
        slopes = [dot["slope"] for dot in self._state.graph["dots"] if dot["time"] == time]
        slopes[part] = slope
        self._page.edit(keyframes.set_slope, self._studio.document, self._of, time, slopes)

    def reset_slope(self) -> None:
        """Have the slope at the chosen dot chosen again."""
        self._page.edit(keyframes.set_slope, self._studio.document, self._of, self._chosen[0], None)

    def build(self) -> None:
        """Lay it out."""
        with html.Div(classes="d-flex align-center text-caption", style="height: 28px"):
            v.VBtn("Back", click=(self.toggle, "[graph.of]"), size="small", variant="text")
            html.Span("{{ graph.of }}", classes="mr-2")
            with html.Div(v_if="'value' in dot", classes="d-flex align-center"):
                html.Span("at {{ dot.time }} s: value", classes="mr-2")
                number_field(
                    "dot.value", (self.set_value, "[$event.target.value]"), named("Value of the keyframe")
                )
                with html.Div(v_if="dot.handles.length", classes="d-flex align-center"):
                    html.Span("slope", classes="mx-2")
                    number_field(
                        "dot.slope", (self.set_slope, "[$event.target.value]"), named("Slope at the keyframe")
                    )
                    v.VBtn("Smooth", click=self.reset_slope, size="small", variant="text")
        box = "$event.currentTarget.getBoundingClientRect()"
        x, y = f"($event.clientX - {box}.left) / {box}.width", f"($event.clientY - {box}.top) / {box}.height"
        at = f"[grip.kind, {x}, {y}]"
        end = "grip.kind && trigger('drop_curve'); grip = {}"
        with html.Div(
            style="position: relative; height: 96px; margin: 0 12px; touch-action: none; user-select: none",
            raw_attrs=[
                f"@pointermove=\"grip.kind && trigger('drag_curve', {at})\"",
                f'@pointerup="{end}"',
                f'@pointerleave="{end}"',
            ],
        ):
            self._lines()
            self._dots()

    def _lines(self) -> None:
        box = 'viewBox="0 0 100 100"', 'preserveAspectRatio="none"', 'aria-hidden="true"'
        with AbstractElement("svg", style="position: absolute; width: 100%; height: 100%", raw_attrs=[*box]):
            line = ':points="line"', ':stroke="part_colours[i % 4]"', 'fill="none"', 'stroke-width="1.5"'
            AbstractElement(
                "polyline",
                v_for="(line, i) in graph.lines",
                key="i",
                raw_attrs=[*line, 'vector-effect="non-scaling-stroke"'],
            )

    def _dots(self) -> None:
        place = (
            "position: absolute; width: 12px; height: 12px; border-radius: 50%; margin: -6px; min-width: 0"
        )
        with html.Template(v_for="d in graph.dots", key="d.time + '/' + d.part"):
            v.VBtn(
                click=(self.choose, "[d.time, d.part]"),
                icon=True,
                density="compact",
                style=(
                    f"`{place}; padding: 0; left: ${{d.at[0]}}%; top: ${{d.at[1]}}%; "
                    "background: ${part_colours[d.part % 4]}; "
                    "outline: ${d.time == dot.time && d.part == dot.part ? '2px solid' : 'none'}`",
                ),
                raw_attrs=[
                    *named_by("graph.of + ' ' + (d.part + 1) + ' at ' + d.time + ' s'"),
                    "@pointerdown=\"d.time == dot.time && d.part == dot.part && (grip = {kind: 'value'})\"",
                ],
            )
        html.Div(
            v_for="(h, i) in dot.handles ?? []",
            key="i",
            style=(f"`{place}; left: ${{h[0]}}%; top: ${{h[1]}}%; border: 2px solid; cursor: grab`",),
            raw_attrs=["@pointerdown.prevent=\"grip = {kind: 'slope'}\"", 'title="Slope"'],
        )
