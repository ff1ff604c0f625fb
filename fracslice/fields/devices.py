"""Compute devices: the CPU or a GPU."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..common.cache import warn
from ..common.parameters import Choice, File, validate_value
from ..errors import DeviceError
from .field import Device

if TYPE_CHECKING:
    from .node import Node

DEVICES = Choice("auto", "what computes", ("cpu", "cuda", "auto"))
"""Parameter of the device to compute on."""
FEWEST = 1 << 22
"""Samples of a picture below which "auto" selects the CPU: one core renders them while CUDA starts."""


def choose_device(device: str) -> Device:
    """Select a compute device."""
    validate_value("device", device, DEVICES, DeviceError)
    if device == "cpu":
        return "cpu"
    from ..expr.cuda_driver import missing

    reason = missing()
    if reason and device == "cuda":
        raise DeviceError(f"device cuda: {reason}")
    return "cpu" if reason else "cuda"


def for_field(root: Node, device: Device) -> Device:
    """Select the CPU for a field with a model or outline, which lies in its memory, with one warning."""
    if device == "cpu":
        return device
    for node in root.solids():
        if any(isinstance(kind, File) and kind.inside for kind in node.formula.parameters.values()):
            warn(f"a scene with a <{node.formula.name}> is computed on the CPU, in whose memory that is")
            return "cpu"
    return device


def for_picture(device: str, size: tuple[int, int], samples: int) -> str:
    """Select the CPU for a small picture, unless a device was named.

    `size` in pixels; `samples`: samples per pixel.
    """
    return "cpu" if device == "auto" and size[0] * size[1] * samples < FEWEST else device
