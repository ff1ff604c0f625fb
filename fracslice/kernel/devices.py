"""Compute devices: the CPU or a GPU."""

from __future__ import annotations

from ..errors import DeviceError
from ..formulas.field import Device
from ..formulas.parameters import Choice
from ..formulas.records import validated

DEVICES = Choice("auto", "what computes", ("cpu", "cuda", "auto"))
"""Parameter of the device to compute on."""
FEWEST = 1 << 22
"""Samples of a picture below which "auto" selects the CPU: one core renders them while CUDA starts."""


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


def for_picture(device: str, size: tuple[int, int], samples: int) -> str:
    """Select the CPU for a small picture, unless a device was named.

    Parameters
    ----------
    device
        "cpu", "cuda" or "auto".
    size
        Width and height, pixels.
    samples
        Samples per pixel.

    Returns
    -------
    str
        "cpu" in place of "auto" for less than `FEWEST` samples, else the device.
    """
    return "cpu" if device == "auto" and size[0] * size[1] * samples < FEWEST else device
