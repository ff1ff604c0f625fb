"""Scenes of Mandelbulber 2: its settings files read into scenes of ours."""

from . import box_formulas, bulb_formulas, sponge_formulas, transform_formulas  # noqa: F401
from .importer import Imported, import_scene
from .settings import Settings, read_settings

__all__ = ["Imported", "Settings", "import_scene", "read_settings"]
