"""Slicing: from a field to the layers of a printer, without a mesh."""

from .adaptive import adapted
from .contours import Contours
from .layers import SLAB, Layer, Slicer
from .stack import SliceJob, Stack, plan_stack

__all__ = ["SLAB", "Contours", "Layer", "SliceJob", "Slicer", "Stack", "adapted", "plan_stack"]
