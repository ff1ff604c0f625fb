"""``python -m tests.studio_film docs/figures/studio-film.webp``: a film of the studio, by clicks in a page.

To be run when the page looks different, on a machine that does nothing else.
"""

from __future__ import annotations

import io
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page

from tests.studio.serving import chromium, served

SIZE = 1120, 630
"""Window, pixels."""

SCALED = 800, 450
"""Size of the film, pixels."""

INTERVAL = 0.15
"""Least time between frames, seconds."""

QUALITY = 45

POINTER = """const dot = document.createElement("div");
dot.style = "position: fixed; width: 14px; height: 14px; margin: -7px; border-radius: 7px; z-index: 9999; " +
  "background: #ffb300cc; pointer-events: none";
document.body.append(dot);
for (const kind of ["mousemove", "mousedown", "mouseup"])
  addEventListener(kind, e => {
    dot.style.left = e.clientX + "px";
    dot.style.top = e.clientY + "px";
    dot.style.transform = e.buttons ? "scale(1.6)" : "";
  }, true);"""
"""Script that shows where the mouse is, as pictures of a page do not."""


class Camera:
    """Takes pictures of a page while something is done in it."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.frames: list[tuple[float, Image.Image]] = []

    def take(self) -> None:
        """Take a picture, if it is time."""
        now = time.monotonic()
        if self.frames and now - self.frames[-1][0] < INTERVAL:
            return
        picture = Image.open(io.BytesIO(self.page.screenshot(type="jpeg", quality=90)))
        self.frames.append((now, picture.resize(SCALED, Image.Resampling.LANCZOS)))

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.take()
            self.page.wait_for_timeout(20)

    def until(self, holds: Callable[[], bool]) -> None:
        """Let time pass until something holds."""
        while not holds():
            self.wait(0.1)

    def drag(self, start: tuple[float, float], by: tuple[float, float], seconds: float) -> None:
        """Drag with the mouse."""
        mouse, began = self.page.mouse, time.monotonic()
        mouse.move(*start)
        mouse.down()
        while (share := (time.monotonic() - began) / seconds) < 1:
            mouse.move(start[0] + share * by[0], start[1] + share * by[1])
            self.take()
        mouse.up()
        self.wait(0.8)

    def save(self, path: Path) -> None:
        """Write the film."""
        times = [at for at, _ in self.frames]
        lengths = [round(1000 * (b - a)) for a, b in pairwise(times)] + [2000]
        pictures = [picture for _, picture in self.frames]
        options = {"duration": lengths, "loop": 0, "quality": QUALITY, "method": 4}
        pictures[0].save(path, save_all=True, append_images=pictures[1:], **options)


def play(page: Page, camera: Camera) -> None:
    """From a shipped scene to a file for a printer."""
    page.get_by_role("list", name="Elements").get_by_text("mandelbulb", exact=True).click()
    camera.wait(1.5)
    camera.drag((740, 330), (160, 40), 2.5)
    for _ in range(5):
        page.mouse.move(700, 300)
        page.mouse.wheel(0, -100)
        camera.wait(0.25)
    camera.wait(1)
    thumb = page.locator(".v-slider-thumb").first.bounding_box()
    assert thumb
    camera.drag((thumb["x"] + 10, thumb["y"] + 10), (-44, 0), 2.5)
    page.get_by_label("Undo").click()
    camera.wait(1)
    page.get_by_label("First view").click()
    camera.wait(1)
    page.get_by_label("Cut across y").click()
    camera.wait(1)
    page.get_by_label("Distances in the cut").click()
    camera.wait(1.5)
    camera.drag((740, 330), (120, -20), 2)
    page.get_by_label("Cut across y").click()
    page.get_by_label("Inside", exact=True).click()
    panel = page.locator(".v-navigation-drawer", has_text="Layers")
    panel.get_by_label("Make the mesh").click()
    camera.until(lambda: panel.get_by_text("closed, manifold").count() > 0)
    camera.wait(1)
    panel.locator(".v-select", has_text="Colours").click()
    camera.wait(0.5)
    page.get_by_role("option", name="thickness").click()
    camera.until(lambda: panel.get_by_label("Legend").count() > 0)
    camera.drag((640, 330), (-120, 30), 2)
    page.get_by_role("button", name="layers", exact=True).click()
    layer = panel.get_by_label("Layer", exact=True)
    camera.until(lambda: layer.count() > 0)
    camera.wait(1)
    for index in range(100, 1000, 90):
        number = panel.get_by_label("Layer as a number")
        number.fill(str(index))
        number.press("Enter")
        camera.wait(0.25)
    page.get_by_role("button", name="field", exact=True).click()
    page.get_by_label("Inside", exact=True).click()
    page.get_by_label("Make a file").click()
    page.get_by_label("File:").fill("bulb.3mf")
    camera.wait(1)
    page.get_by_role("button", name="Make", exact=True).click()
    camera.until(lambda: page.get_by_text("bulb.3mf: ").count() > 0)
    camera.wait(2)


def main(path: Path) -> None:
    """Make the film."""
    with (
        tempfile.TemporaryDirectory() as folder,
        chromium() as browser,
        served(browser, "mandelbulb", Path(folder), SIZE) as studio,
    ):
        studio.page.evaluate(POINTER)
        camera = Camera(studio.page)
        play(studio.page, camera)
    camera.save(path)
    print(f"{path}: {len(camera.frames)} frames, {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
