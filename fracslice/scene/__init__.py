"""Scenes: read from files, built in Python, validated and written."""

from ..common.parameters import parse_length
from ..records import Print
from .model import Scene, scene
from .reader import read, reads
from .writer import to_xml

__all__ = ["Print", "Scene", "parse_length", "read", "reads", "scene", "to_xml"]
