"""From a scene to a picture: rays marched through the field, sample after sample."""

from __future__ import annotations

from .accumulator import Accumulator, HostAccumulator
from .film import develop
from .progressive import Pass, Renderer

__all__ = ["Accumulator", "HostAccumulator", "Pass", "Renderer", "develop"]
