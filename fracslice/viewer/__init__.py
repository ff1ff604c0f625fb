"""Meshes on the screen and in pictures; the only importer of pyvista."""

from fracslice.viewer.picture import picture
from fracslice.viewer.window import show

__all__ = ["picture", "show"]
