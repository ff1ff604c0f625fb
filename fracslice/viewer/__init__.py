"""Windows and pictures of meshes and scenes; the only importer of pyvista."""

from fracslice.viewer.cockpit import fly
from fracslice.viewer.picture import picture
from fracslice.viewer.window import show

__all__ = ["fly", "picture", "show"]
