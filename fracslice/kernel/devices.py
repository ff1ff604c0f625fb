"""What computes a field: the processor or a GPU."""

from __future__ import annotations

from ..errors import DeviceError
from ..formulas.field import Device
from ..formulas.parameters import Choice, validated

DEVICES = Choice("auto", "what computes", ("cpu", "cuda", "auto"))


def chosen(device: str) -> Device:
    """The device to use: "cpu", "cuda", or "auto", which takes the GPU if there is one. Raises `DeviceError`
    if there is none, or for another word.
    """
    validated("device", device, DEVICES, DeviceError)
    if device == "cpu":
        return "cpu"
    from .cuda import missing

    reason = missing()
    if reason and device == "cuda":
        raise DeviceError(f"device cuda: {reason}")
    return "cpu" if reason else "cuda"
