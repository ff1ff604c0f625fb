"""Parts of a film, with the margin that they need to have the samples of the whole picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.parameters import Pixels, validate_value
from ..errors import RenderError
from .accumulator import CHANNELS, COARSE

BYTES = 4 * (CHANNELS + 4 + 3)
"""Memory of a pixel: its sums, their mean and the developed picture."""
MARGIN = 16
"""Pixels around a crop that are rendered with it: errors decide on the samples of neighbours, one pixel
farther in every pass that chooses pixels."""
CROP = Pixels(None, "left, top, width and height, pixels")


@dataclass(frozen=True)
class Crop:
    """Part of a film that is rendered."""

    left: int  # the part, pixels
    top: int
    width: int
    height: int
    film: tuple[int, int]  # width and height of the film, pixels

    @classmethod
    def of(cls, film: tuple[int, int], crop: tuple[int, int, int, int] | None) -> Crop:
        """Validate a crop.

        `film` in pixels; `crop`: left and upper pixel.
        """
        if crop is None:
            return cls(0, 0, *film, film)
        x, y, width, height = validate_value("crop", crop, CROP, RenderError)
        if width < 1 or height < 1 or x + width > film[0] or y + height > film[1]:
            raise RenderError(
                f"crop={x},{y},{width},{height}: expected a part of {film[0]} x {film[1]} pixels"
            )
        return cls(x, y, width, height, film)

    @property
    def origin(self) -> tuple[int, int]:
        """Upper left pixel of the crop with its margin, in the grid of the first pass."""
        return _grid(self.left), _grid(self.top)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the crop with its margin, pixels."""
        x, y = self.origin
        right = min(self.left + self.width + MARGIN, self.film[0])
        bottom = min(self.top + self.height + MARGIN, self.film[1])
        return right - x, bottom - y

    @property
    def bytes(self) -> int:
        """Memory that its picture needs."""
        width, height = self.size
        return BYTES * width * height

    def within(self, pixels: np.ndarray) -> np.ndarray:
        """Cut the margin off.

        `pixels`: ndarray (rows, columns, ...), values of `size` pixels. Returns ndarray (height, width,
        ...).
        """
        x, y = self.origin
        rows, columns = slice(self.top - y, None), slice(self.left - x, None)
        return np.ascontiguousarray(pixels[rows, columns][: self.height, : self.width])


def _grid(first: int) -> int:
    """First pixel of the margin before a pixel."""
    return max(first - MARGIN, 0) // COARSE * COARSE
