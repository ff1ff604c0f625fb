"""Making an object printable, in the field, and measuring whether it is."""

from .make import printable

__all__ = ["printable"]
