"""Compute devices: the CPU or a GPU."""

from __future__ import annotations

from ..errors import DeviceError
from ..formulas.field import Device
from ..formulas.parameters import Choice, validated

DEVICES = Choice("auto", "what computes", ("cpu", "cuda", "auto"))
"""Parameter of the device to compute on."""


def chosen(device: str) -> Device:
    """Select a compute device.

    Parameters
    ----------
    device
        "cpu", "cuda" or "auto"; "auto" selects the GPU if there is one.

    Returns
    -------
    str
        "cpu" or "cuda".

    Raises
    ------
    DeviceError
        If "cuda" is not available, or for any other text.
    """
    validated("device", device, DEVICES, DeviceError)
    if device == "cpu":
        return "cpu"
    from .cuda_driver import missing

    reason = missing()
    if reason and device == "cuda":
        raise DeviceError(f"device cuda: {reason}")
    return "cpu" if reason else "cuda"
