"""Mesh extraction, connected components, cleaning, checks and solids."""

from .model import Mesh

__all__ = ["Mesh"]
