"""Kinds of numbers that intervals are computed with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..formulas import vocabulary

Bound = Any
"""Lanes or NumPy array."""


TINY = {32: 1e-36, 64: 1e-290}
"""Smallest magnitude that has a sign, by the width of floats."""


@dataclass(frozen=True)
class Numbers:
    """Kind of the bounds.

    Attributes
    ----------
    functions
        Module with the functions of the vocabulary.
    unit
        Distance from 1 to the next number.
    huge, tiny
        Largest magnitude, and the smallest that has a sign.
    constant
        Function of a bound and a number that returns the number in the form of the bound.
    """

    functions: Any
    unit: float
    huge: float
    tiny: float
    constant: Callable[[Bound, float], Bound]


ARRAYS = Numbers(vocabulary, 2.0**-52, 1e300, TINY[64], np.full_like)
