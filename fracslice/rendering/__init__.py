"""Scene to picture: progressive ray marching of the field."""

from __future__ import annotations

from .accumulator import Accumulator, HostAccumulator, develop, picture
from .progressive import Pass, Renderer

__all__ = ["Accumulator", "HostAccumulator", "Pass", "Renderer", "develop", "picture"]
