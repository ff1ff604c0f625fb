"""Arguments that are compiled into kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Fixed:
    """An argument that is compiled into the kernel instead of being passed to it, because the code depends on
    it.

    Attributes
    ----------
    value : object
        The constant.
    """

    value: Any
