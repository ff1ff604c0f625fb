"""Owen-scrambled random numbers in [0, 1): integer arithmetic on one sample, for loops over samples."""

from __future__ import annotations


def reversed_bits(a):
    """Reverse the bits of a 32-bit integer."""
    a = ((a >> 1) & 0x55555555) | ((a & 0x55555555) << 1)
    a = ((a >> 2) & 0x33333333) | ((a & 0x33333333) << 2)
    a = ((a >> 4) & 0x0F0F0F0F) | ((a & 0x0F0F0F0F) << 4)
    a = ((a >> 8) & 0x00FF00FF) | ((a & 0x00FF00FF) << 8)
    return ((a >> 16) & 0x0000FFFF) | ((a & 0x0000FFFF) << 16)


def hashed(a):
    """Hash a 32-bit integer (Wellons 2018, lowbias32)."""
    a = ((a ^ (a >> 16)) * 0x7FEB352D) & 0xFFFFFFFF
    a = ((a ^ (a >> 15)) * 0x846CA68B) & 0xFFFFFFFF
    return a ^ (a >> 16)


def scrambled(a, seed):
    """Owen-scramble a 32-bit fraction; see `fracslice.rendering.sequence`.

    `a`: bits reversed.
    """
    a = (a ^ (a * 0x3D20ADEA)) & 0xFFFFFFFF
    a = (a + seed) & 0xFFFFFFFF
    a = (a * ((seed >> 16) | 1)) & 0xFFFFFFFF
    a = (a ^ (a * 0x05526C56)) & 0xFFFFFFFF
    a = (a ^ (a * 0x53A22864)) & 0xFFFFFFFF
    return reversed_bits(a)


def seeded(pixel, dimension):
    """Return the seed of a pixel's dimension."""
    return hashed((pixel * 64 + (pixel >> 26) * 0x9E3779B9 + dimension) & 0xFFFFFFFF)


def sample(a, pixel, dimension):
    """Return one coordinate of a sequence point, scrambled for a pixel.

    Parameters
    ----------
    a : int
        Coordinate, bits reversed.
    pixel : int
        Pixel, ``y << 16 | x``.
    dimension : int
        Dimension of the coordinate.
    """
    return (scrambled(a & 0xFFFFFFFF, seeded(pixel, dimension)) >> 8) * 5.9604644775390625e-08


def centred(a, pixel, dimension):
    """Like `sample`, digitally shifted so that the first point of the sequence is 1/2, the pixel's centre.

    `a`: bits reversed.
    """
    seed = seeded(pixel, dimension)
    shifted = scrambled(a & 0xFFFFFFFF, seed) ^ scrambled(0, seed) ^ 0x80000000
    return (shifted >> 8) * 5.9604644775390625e-08
