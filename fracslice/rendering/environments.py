"""Tables of a picture of the surroundings, for `units.environment`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from .image_files import LinearImage

PIXELS = 2048 * 1024
"""Maximum number of pixels of a sky."""
SMOOTH = 1 << 13
"""Number of pixels that determine its light without shadows."""
_FACTORS = (
    (0.282095, math.pi),
    *(((0.488603, 2 * math.pi / 3),) * 3),
    *(((1.092548, math.pi / 4),) * 2),
    (0.315392, math.pi / 4),
    (1.092548, math.pi / 4),
    (0.546274, math.pi / 4),
)
"""Norm of each spherical harmonic and its factor in a convolution with a cosine, in the order of
`units.environment.irradiance`."""


@lru_cache(maxsize=2)
def environment(picture: LinearImage) -> Environment:
    """Return the environment of a picture.

    Parameters
    ----------
    picture : LinearImage
        Linear light.

    Returns
    -------
    Environment
        Its tables; the same object for the same picture.
    """
    return Environment(picture)


@dataclass(frozen=True, eq=False)
class Environment:
    """Picture of the surroundings.

    Attributes
    ----------
    picture : LinearImage
        Linear light.
    """

    picture: LinearImage

    @property
    def steps(self) -> tuple[int, ...]:
        """Binary logarithms of width and height, rounded up."""
        return tuple(math.ceil(math.log2(n)) for n in self.picture.size)

    @property
    def halves(self) -> tuple[float, ...]:
        """Largest powers of two below width and height."""
        return tuple(2.0 ** (n - 1) for n in self.steps)

    @cached_property
    def distribution(self) -> tuple[np.ndarray, np.ndarray]:
        """Distribution functions of the rows, and of the columns of each row.

        The density of a pixel is the mean of the interpolated light in it: none is zero where there is light.
        """
        grey = self.picture.light.mean(2, dtype=np.float64)
        rows = np.pad(grey, ((1, 1), (0, 0)), "edge")
        grey = 0.125 * (rows[:-2] + rows[2:]) + 0.75 * grey
        grey = 0.125 * (np.roll(grey, 1, 1) + np.roll(grey, -1, 1)) + 0.75 * grey
        grey *= _solid_angles(*grey.shape)[:, None]
        return _cumulated(grey.sum(1)), _cumulated(grey)

    def harmonics(self, turn: float) -> tuple[tuple[float, ...], ...]:
        """Factors of `units.environment.irradiance`.

        Parameters
        ----------
        turn : float
            Rotation about the z axis, full turns.

        Returns
        -------
        tuple of tuple of float
            Nine factors each for red, green and blue.
        """
        light = self.picture.within(SMOOTH)
        height, width, _ = light.shape
        theta = (np.arange(height) + 0.5) * np.pi / height
        phi = ((np.arange(width) + 0.5) / width - 0.5 - turn) * 2 * np.pi
        z, sine = np.cos(theta)[:, None], np.sin(theta)[:, None]
        x, y = sine * np.sin(phi), sine * np.cos(phi)
        bases = (1 + 0 * x, y, z + 0 * x, x, x * y, y * z, 3 * z * z - 1 + 0 * x, x * z, x * x - y * y)
        light = light * _solid_angles(height, width)[:, None, None]
        sums = [
            np.tensordot(base, light, 2) * norm * norm * factor / np.pi
            for base, (norm, factor) in zip(bases, _FACTORS, strict=True)
        ]
        return tuple(tuple(map(float, channel)) for channel in np.transpose(sums))


def _solid_angles(height: int, width: int) -> np.ndarray:
    """Solid angle of a pixel of each row."""
    z = np.cos(np.linspace(0, np.pi, height + 1))
    return np.asarray((z[:-1] - z[1:]) * 2 * np.pi / width)


def _cumulated(weights: np.ndarray) -> np.ndarray:
    """Distribution functions along the last axis; uniform where all weights are zero."""
    total = weights.sum(-1, keepdims=True)
    share = np.where(total > 0, weights, 1) / np.where(total > 0, total, weights.shape[-1])
    sums = np.cumsum(share, -1)
    sums[..., -1] = 1
    return np.concatenate([np.zeros_like(total), np.minimum(sums, 1)], -1)
