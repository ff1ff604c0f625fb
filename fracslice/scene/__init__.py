"""Scenes: read from files, built in Python, validated and written."""

from ..common.parameters import parse_length
from ..records import Print
from .model import Scene, scene, to_xml
from .reader import read, reads

__all__ = ["Print", "Scene", "parse_length", "read", "reads", "scene", "to_xml"]
