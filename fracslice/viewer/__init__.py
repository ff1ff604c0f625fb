"""Windows and pictures of meshes and scenes. No other package imports pyvista."""

from .canvas import previewed
from .picture import need_pyvista, picture
from .viewer import fly
from .window import need_screen, show

__all__ = ["fly", "need_pyvista", "need_screen", "picture", "previewed", "show"]
