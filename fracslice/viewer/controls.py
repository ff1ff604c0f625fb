"""Keys and pointer of the flight window, as camera input."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from ..rendering.steering import CameraInput

MOVES = {
    "w": ("forward", 1.0),
    "s": ("forward", -1.0),
    "d": ("right", 1.0),
    "a": ("right", -1.0),
    "r": ("up", 1.0),
    "f": ("up", -1.0),
    "right": ("yaw", 1.0),
    "left": ("yaw", -1.0),
    "up": ("pitch", 1.0),
    "down": ("pitch", -1.0),
    "e": ("roll", 1.0),
    "q": ("roll", -1.0),
}
"""Axis and direction of each key that moves or turns the camera while it is held."""
PACES = {str(digit): 2.0 ** (digit - 5) for digit in range(1, 10)}
"""Pace of each speed key: 5 is 1, and the next one is twice as fast."""
SLOWEST = 2.0**-10
"""Slowest pace; the fastest one is its inverse."""
RELEASE = 0.05
"""Delay, in seconds, after which a key release counts: key repeat sends releases and presses continuously."""


@dataclass
class Controls:
    """Keys that are held, pace, and pointer.

    Attributes
    ----------
    pace : float
        Speed, in distances to the surface per second.
    locked : bool
        True if the camera must not move.
    looking : bool
        True if the camera follows the pointer without a button.
    grip : tuple of int or None
        Pointer position up to which a drag or a look has been followed, pixels.
    """

    pace: float = 1.0
    locked: bool = False
    looking: bool = False
    grip: tuple[int, int] | None = None
    _held: dict[str, float | None] = field(default_factory=dict)

    def press(self, key: str) -> None:
        """Hold a key of `MOVES`, or choose the pace of a key of `PACES`.

        Parameters
        ----------
        key : str
            Key symbol, lower case.
        """
        self.pace = PACES.get(key, self.pace)
        if key in MOVES:
            self._held[key] = None

    def hurry(self, factor: float) -> None:
        """Multiply the pace, within `SLOWEST` and its inverse."""
        self.pace = min(max(self.pace * factor, SLOWEST), 1 / SLOWEST)

    def let_go(self) -> None:
        """Release all keys at once."""
        self._held.clear()

    def release(self, key: str) -> None:
        """Release a key once `RELEASE` seconds pass without a press.

        Parameters
        ----------
        key : str
            Key symbol, lower case.
        """
        if key in self._held:
            self._held[key] = time.monotonic()

    @property
    def input(self) -> CameraInput:
        """Camera input of the keys that are held."""
        late = time.monotonic() - RELEASE
        self._held = {key: since for key, since in self._held.items() if since is None or since > late}
        axes: dict[str, float] = {}
        for key in () if self.locked else self._held:
            axis, direction = MOVES[key]
            axes[axis] = axes.get(axis, 0.0) + direction
        return CameraInput(**axes, pace=self.pace)

    def turn(self, to: tuple[int, int], degrees: float) -> tuple[float, float]:
        """Follow the pointer.

        While a button drags, the picture follows the pointer; while looking, the camera does.

        Parameters
        ----------
        to : tuple of int
            Pointer position, pixels from the lower left.
        degrees : float
            Angle of a pixel, degrees.

        Returns
        -------
        yaw, pitch : float
            Angles to turn to the right and up, degrees.
        """
        if self.locked or self.grip is None:
            self.grip = to if self.looking else None
            return 0.0, 0.0
        x, y = (b - a for a, b in zip(self.grip, to, strict=True))
        self.grip = to
        factor = degrees if self.looking else -degrees
        return factor * x, factor * y
