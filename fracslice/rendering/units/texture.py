"""Textures."""

from __future__ import annotations

from ...formulas.vocabulary import floor, where
from .environment import between, bounded


def repeated(u, v, light, width, height, P):
    """Return a picture that is repeated across and down.

    Parameters
    ----------
    u, v : float
        Coordinates, pictures.
    light : float
        Index of its table in P.
    """
    a = width * (u - floor(u)) - 0.5
    b = height * (v - floor(v)) - 0.5
    column = floor(a)
    row = floor(b)
    left = bounded(where(column < 0.0, width - 1.0, column), width)
    upper = bounded(where(row < 0.0, height - 1.0, row), height)
    right = where(left > width - 1.5, 0.0, left + 1.0)
    lower = where(upper > height - 1.5, 0.0, upper + 1.0)
    return between(light, width, left, right, a - column, upper, lower, b - row, P)


def triplanar(x, y, z, nx, ny, nz, light, width, height, tile, P):
    """Return a picture seen along the three axes, weighted by the fourth power of the normal.

    Geiss 2007, "Generating Complex Procedural Terrains Using the GPU", in GPU Gems 3.

    Parameters
    ----------
    light : float
        Index of the picture's table in P.
    tile : float
        Width of the picture, scene units.

    Returns
    -------
    r, g, b : float
        Linear light. Walls show it upright, floors with its top towards +y.
    """
    across = 1.0 / tile
    down = -across * width / height
    ar, ag, ab = repeated(across * y, down * z, light, width, height, P)
    br, bg, bb = repeated(across * x, down * z, light, width, height, P)
    cr, cg, cb = repeated(across * x, down * y, light, width, height, P)
    a = nx * nx * nx * nx
    b = ny * ny * ny * ny
    c = nz * nz * nz * nz
    over = 1.0 / (a + b + c)
    return (
        over * (a * ar + b * br + c * cr),
        over * (a * ag + b * bg + c * cg),
        over * (a * ab + b * bb + c * cb),
    )
