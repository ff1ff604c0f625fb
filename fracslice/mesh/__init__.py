"""Mesh extraction, connected components, cleaning, checks and solids."""

from fracslice.mesh.model import Mesh

__all__ = ["Mesh"]
