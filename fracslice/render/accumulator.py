"""What a picture is made of while it is being made: sums over samples, every sample with the same weight."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..errors import RenderError
from .waves import CHANNELS

TRUSTED = 8
"""Samples that a pixel has before its spread is believed."""


@dataclass(eq=False)
class Accumulator:
    """sums: [height * width, 6] of the kernel's float type, see `waves.CHANNELS`. passes: how many are in
    it. key: of what it is a picture; only the same scene, view, size and precision can go on with it."""

    width: int
    height: int
    sums: np.ndarray
    key: str
    passes: int = 0

    @classmethod
    def empty(cls, width: int, height: int, dtype: np.dtype, key: str) -> Accumulator:
        return cls(width, height, np.zeros((width * height, CHANNELS), dtype), key)

    @property
    def counts(self) -> np.ndarray:
        """Samples of each pixel, [height, width]."""
        return self.sums[:, 5].reshape(self.height, self.width)

    def mean(self) -> np.ndarray:
        """The picture so far: float32 [height, width, 3], linear light; black where there is no sample."""
        counts = self.sums[:, 5:6]
        colours = (self.sums[:, :3] / np.maximum(counts, 1)).reshape(self.height, self.width, 3)
        return np.asarray(colours, np.float32)

    def errors(self) -> np.ndarray:
        """The standard error of each pixel's brightness, as shown: float32 [height, width]; infinite below 2
        samples."""
        n = self.sums[:, 5].astype(np.float64)
        mean = self.sums[:, 3] / np.maximum(n, 1)
        spread = np.maximum(self.sums[:, 4] / np.maximum(n, 1) - mean * mean, 0)
        error = np.where(n < 2, np.inf, np.sqrt(spread / np.maximum(n - 1, 1)))
        return np.asarray(error.reshape(self.height, self.width), np.float32)

    def unfinished(self, tolerance: float) -> np.ndarray:
        """Whether a pixel's error or a neighbour's is above the tolerance, or its samples too few: bool
        [height, width]."""
        error = self.errors()
        error[self.counts < TRUSTED] = np.inf
        padded = np.pad(error, 1, mode="edge")
        worst = np.max(
            [padded[j : j + self.height, i : i + self.width] for j in range(3) for i in range(3)], 0
        )
        return np.asarray(worst > tolerance)

    def save(self, file: BinaryIO) -> None:
        """Writes it as an .npz file, from which rendering goes on as if it had not stopped."""
        shape = np.array([self.width, self.height, self.passes])
        np.savez(file, sums=self.sums, shape=shape, key=np.array(self.key))

    @classmethod
    def load(cls, path: str | Path, key: str) -> Accumulator:
        """Reads what `save` wrote. Raises `RenderError` if it is of another picture, or no such file."""
        try:
            with np.load(path, allow_pickle=False) as stored:
                width, height, passes = map(int, stored["shape"])
                found = cls(width, height, np.ascontiguousarray(stored["sums"]), str(stored["key"]), passes)
        except (OSError, ValueError, KeyError) as error:
            raise RenderError(f"{path}: expected a picture in the making: {error}") from None
        if found.key != key or found.sums.shape != (width * height, CHANNELS):
            raise RenderError(f"{path}: is of another scene, view, size or version")
        return found
