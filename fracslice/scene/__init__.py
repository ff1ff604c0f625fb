"""Scenes: read from files, built in Python, validated and written."""

from .lengths import parse_length
from .model import Scene, scene
from .printing import Print
from .reader import read, reads
from .writer import to_xml

__all__ = ["Print", "Scene", "parse_length", "read", "reads", "scene", "to_xml"]
