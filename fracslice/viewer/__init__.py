"""Windows and pictures of meshes and scenes. No other package imports pyvista."""

from .viewer import fly, previewed
from .window import Found, need_pyvista, need_screen, picture, show

__all__ = ["Found", "fly", "need_pyvista", "need_screen", "picture", "previewed", "show"]
