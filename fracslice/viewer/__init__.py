"""Windows and pictures of meshes and scenes. No other package imports pyvista."""

from .viewer import fly, previewed
from .window import need_pyvista, need_screen, picture, show

__all__ = ["fly", "need_pyvista", "need_screen", "picture", "previewed", "show"]
