"""Windows and pictures of meshes and scenes. No other package imports pyvista."""

from fracslice.viewer.picture import need_pyvista, picture
from fracslice.viewer.preview import previewed
from fracslice.viewer.screen import need_screen
from fracslice.viewer.viewer import fly
from fracslice.viewer.window import show

__all__ = ["fly", "need_pyvista", "need_screen", "picture", "previewed", "show"]
