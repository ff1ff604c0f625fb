"""Slicing: from a field to the layers of a printer, without a mesh."""

from ..records import SliceJob
from .contours import Contours
from .layers import SLAB, Layer, Slicer
from .planning import adapted, plan_layers, plan_stack
from .stack import Stack

__all__ = ["SLAB", "Contours", "Layer", "SliceJob", "Slicer", "Stack", "adapted", "plan_layers", "plan_stack"]
