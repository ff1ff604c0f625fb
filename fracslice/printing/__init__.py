"""Field edits that make an object printable, and printability checks of solids."""

from .make import printable

__all__ = ["printable"]
