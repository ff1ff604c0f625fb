"""The transfer function of sRGB (IEC 61966-2-1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def to_linear(shown: NDArray[Any]) -> NDArray[Any]:
    """Convert display values to linear light.

    Parameters
    ----------
    shown : ndarray of float
        sRGB, from 0 to 1.

    Returns
    -------
    ndarray of float
        Linear light, from 0 to 1.
    """
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def from_linear(light: NDArray[Any]) -> NDArray[Any]:
    """Convert linear light to display values.

    Parameters
    ----------
    light : ndarray of float
        Linear light, from 0 to 1.

    Returns
    -------
    ndarray of float
        sRGB, from 0 to 1.
    """
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
