"""Closed bricks from dense arrays, for tests that need fields no scene would make."""

from __future__ import annotations

import numpy as np

from fracslice.volume.bricks import INSIDE, OUTSIDE, Bricks


def bricks_of(
    field: np.ndarray, origin: tuple[float, float, float] = (0, 0, 0), voxel: float = 1.0, dense: bool = False
) -> Bricks:
    """The bricks of a field on a grid, as few of them as closure allows, or all of them if `dense`.

    The grid's sides are multiples of 8, and its border is outside.
    """
    size = tuple(n // 8 for n in field.shape)
    parts = field.reshape(size[0], 8, size[1], 8, size[2], 8).transpose(0, 2, 4, 1, 3, 5)
    inside = (parts < 0).reshape(*size, 512)
    index = np.where(inside.all(axis=3), INSIDE, OUTSIDE).astype(np.int32)
    sampled = crossed(field < 0, size) | dense
    ijk = np.argwhere(sampled).astype(np.int32) * np.int32(8)
    index[sampled] = np.arange(len(ijk))
    values = np.ascontiguousarray(parts[sampled].reshape(-1, 512), np.float32)
    return Bricks(origin, voxel, ijk, values, index)


def crossed(inside: np.ndarray, size: tuple[int, ...]) -> np.ndarray:
    """Which bricks have an end of a grid edge with a sign change."""
    ends = np.zeros(inside.shape, bool)
    for axis in range(3):
        low = tuple(slice(None, -1) if k == axis else slice(None) for k in range(3))
        high = tuple(slice(1, None) if k == axis else slice(None) for k in range(3))
        change = inside[low] != inside[high]
        ends[low] |= change
        ends[high] |= change
    return ends.reshape(size[0], 8, size[1], 8, size[2], 8).any(axis=(1, 3, 5))


def noise(seed: int, side: int = 16, spread: float = 0.0) -> np.ndarray:
    """White noise, every case of signs in it, outside at the border.

    spread: decades between large and small values, which puts crossings close to grid points.
    """
    rng = np.random.default_rng(seed)
    field = np.ones((side, side, side))
    values = rng.choice([-1.0, 1.0], (side - 2,) * 3) * 10 ** (-spread * rng.random((side - 2,) * 3))
    field[1:-1, 1:-1, 1:-1] = values
    return field


def blobs(seed: int, side: int = 40, blur: int = 5) -> np.ndarray:
    """Smooth noise: large inside and outside regions, which sparse bricks leave out."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfftn(rng.normal(size=(side,) * 3))
    k = np.fft.fftfreq(side)
    square = k[:, None, None] ** 2 + k[None, :, None] ** 2 + np.fft.rfftfreq(side)[None, None, :] ** 2
    field = np.fft.irfftn(
        spectrum * np.exp(-square * (2 * np.pi * blur / 2) ** 2), s=(side,) * 3, axes=(0, 1, 2)
    )
    field /= np.abs(field).max()
    field[[0, -1]] = field[:, [0, -1]] = field[:, :, [0, -1]] = 1
    return field


def grid_points(
    side: int, half: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[float, float, float], float]:
    """x, y, z on the points of a grid over [-half, half]^3, its origin and its voxel."""
    voxel = 2 * half / (side - 1)
    axis = -half + voxel * np.arange(side)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    return x, y, z, (-half, -half, -half), voxel
