"""From a field to a printer's layers, with no mesh between."""

from .contours import Contours
from .layers import Layer, Slicer
from .printable import Changes, changed
from .stack import SliceJob, Stack, plan_stack

__all__ = ["Changes", "Contours", "Layer", "SliceJob", "Slicer", "Stack", "changed", "plan_stack"]
