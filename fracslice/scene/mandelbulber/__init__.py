"""Scenes of Mandelbulber 2: its settings files read into scenes of ours."""

from . import (  # noqa: F401
    box_formulas,
    bulb_formulas,
    cluster_formulas,
    coil_formulas,
    kleinian_formulas,
    polyhedron_formulas,
    solid_formulas,
    sponge_formulas,
    transform_formulas,
)
from .importer import Imported, import_scene
from .settings import Settings, read_settings

__all__ = ["Imported", "Settings", "import_scene", "read_settings"]
