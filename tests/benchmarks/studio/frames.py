"""A studio at 960 x 600 on the CPU: seconds until a scene is seen, milliseconds from an input to its frame.

First picture: from opening the scene to its first draft, with kernels compiled before. Moved: from a drag to
the picture from there, as JPEG. Changed: from the value of a slider to the picture with it. Frames a second:
while the camera is turned for a time. Spacing: of a draft's pixels then.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from fracslice.studio.session import Session, jpeg

from ..runner import Row, Run, Spread

SMALLEST = {"names": ("menger-sponge",), "size": (48, 32), "inputs": 2, "seconds": 0.2}

CHANGED = {
    "mandelbulb": ("power", 8.0, 0.03),
    "menger-sponge": ("level", 4, 0),
    "geode": ("smooth", 0.08, 0.002),
}
"""Attribute of the first element, its value, and by how much it changes at each step."""

LATEST = 60.0
"""Longest time to wait for a frame, seconds."""


def rows(
    run: Run,
    names: tuple[str, ...] = ("mandelbulb", "menger-sponge", "geode"),
    size: tuple[int, int] = (960, 600),
    inputs: int = 30,
    seconds: float = 3.0,
    device: str = "cpu",
) -> Iterator[Row]:
    with TemporaryDirectory() as folder:
        for name in names:
            Session(name, Path(folder), device=device).close()  # compiles
            start = time.perf_counter()
            studio = Session(name, Path(folder), device=device)
            opened = time.perf_counter() - start
            try:
                yield {"": name, "first picture, s": opened, **used(studio, name, size, inputs, seconds)}
            finally:
                studio.close()


def used(studio: Session, name: str, size: tuple[int, int], inputs: int, seconds: float) -> Row:
    """What a person who uses a studio waits for."""
    studio.live.resize(size)
    wait(lambda: studio.shown.samples >= 1)
    moved = Spread.of([after(studio, lambda: studio.views.orbit(9, 4)) for _ in range(inputs)])
    changed = Spread.of([after(studio, change(studio, name, k)) for k in range(inputs)])
    frames, spacing = turned(studio, seconds)
    return {"moved, ms": moved, "changed, ms": changed, "frames a second": frames, "spacing": spacing}


def wait(holds: Callable[[], bool]) -> None:
    """Wait until it holds."""
    end = time.perf_counter() + LATEST
    while not holds():
        if time.perf_counter() > end:
            raise TimeoutError
        time.sleep(0.0005)


def after(studio: Session, act: Callable[[], None]) -> float:
    """Milliseconds from an input to the frame that shows it, as JPEG."""
    shown, scene, start = studio.shown, studio.live.scene, time.perf_counter()
    camera = studio.live.aim
    act()
    if studio.live.aim != camera:
        wait(lambda: studio.shown.camera == studio.live.aim)
    else:
        wait(lambda: studio.live.scene is not scene and studio.shown is not shown)
    jpeg(studio.shown.pixels, 75)
    return 1e3 * (time.perf_counter() - start)


def change(studio: Session, name: str, step: int) -> Callable[[], None]:
    """A slider of the first element at its next value."""
    attribute, value, by = CHANGED[name]
    place = studio.document.version.at
    number = value + by * (step + 1) if by else value - 1 + step % 2
    return lambda: studio.set_number(place, attribute, 0, number)


def turned(studio: Session, seconds: float) -> tuple[float, float]:
    """Frames a second while the camera turns, and the spacing of their pixels."""
    frames, start = 0, time.perf_counter()
    while time.perf_counter() < start + seconds:
        after(studio, lambda: studio.views.orbit(3, 0))
        frames += 1
    spacing = studio.live.size[0] / studio.shown.pixels.shape[1]
    return frames / (time.perf_counter() - start), spacing
