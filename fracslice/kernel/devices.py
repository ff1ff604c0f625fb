"""What computes a field: the processor or a GPU."""

from __future__ import annotations

from typing import Literal

from ..errors import DeviceError
from ..formulas.parameters import Choice, validated
from ..formulas.registry import Node
from .cpu import Compilable, Kernel
from .cpu import compile_scene as compile_for_cpu

Device = Literal["cpu", "cuda"]
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


def compile_for(device: Device, root: Node | Compilable) -> Kernel:
    """The float32 kernel of a scene on a device; of a field that is no tree of formulas, on the CPU.

    Raises `KernelError`.
    """
    if device == "cpu" or not isinstance(root, Node):
        return compile_for_cpu(root)
    from .cuda import compile_scene

    return compile_scene(root)
