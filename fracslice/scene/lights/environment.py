"""An environment: a picture of the surroundings."""

from __future__ import annotations

from . import Kind

KIND = Kind("a picture of the surroundings", is_picture=True)
