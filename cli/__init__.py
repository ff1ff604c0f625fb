"""The command line: the only place that prints and exits."""

from .main import main

__all__ = ["main"]
