"""The area of the picture in a page: frames go out, and what mouse, keys and a gamepad do comes in."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..rendering.live import CameraInput
from ..viewer.viewer import MOVES, PACES, Controls
from .session import Session, jpeg

DRAFT, STILL = 75, 92
"""Quality of JPEG frames, of drafts and of pictures at rest."""

CONTROL = {"z": "undo", "y": "redo"}
"""What keys do with ctrl."""

ACTIONS = ("v", "x", ",", ".", "?")
"""Keys of the picture that do something once."""

TWICE, NEAR = 0.35, 5.0
"""Longest time between the clicks of a double click, seconds, and their distance, pixels."""

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
        handle, live = self._studio.handle, self._studio.live
        if around and handle and handle.is_at(self.mouse, live.camera, live.size):
            self._drag = self._drag_handle
            return
        if inside.is_flat:
            self._drag = inside.drag
            return
        self._drag = views.orbit if around else views.look_around
        if around:
            views.grip(self.mouse)

    def _drag_handle(self, *_: float) -> None:
        """Move the light that is chosen to the mouse."""
        self._studio.drag_handle(self.mouse)
        self._act("moved")

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
        shown, inside, handle = self._studio.shown, self._studio.inside, self._studio.handle
        now = shown, inside.overlay, handle
        if now == self._sent or self._streamer is None:
            return
        self._sent = now
        loop = asyncio.get_running_loop()
        pixels = await loop.run_in_executor(None, inside.over, shown, handle)
        data = await loop.run_in_executor(None, jpeg, pixels, STILL if shown.samples else DRAFT)
        rows, columns, _ = pixels.shape
        meta = {"type": "image/jpeg", "codec": "", "w": columns, "h": rows, "st": 0, "key": "key"}
        self._streamer.push_content(AREA, meta, data)
