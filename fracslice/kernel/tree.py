"""What a scene's tree needs to be a `formulas.field.Field`; `Node` calls it."""

from __future__ import annotations

from collections.abc import Sequence

from ..formulas.field import Device, Kernel, Loops, Precision
from ..formulas.registry import Node
from ..keys import key as hashed
from . import cpu
from .linker import link
from .loops import Loop


def kernel(root: Node, device: Device, precision: Precision) -> Kernel:
    """The kernel of a tree whose depths are resolved. Raises `KernelError`."""
    if device == "cpu":
        return cpu.compile_scene(root, precision)
    from . import cuda

    return cuda.compile_scene(root, precision)


def loops(root: Node, loops: Sequence[Loop], precision: Precision) -> Loops:
    """Compiled loops over a tree whose depths are resolved. Raises `KernelError`."""
    linked = link(root)
    return cpu.compile_loops(linked.source, linked.parameters.tobytes(), tuple(loops), precision)


def key(root: Node) -> str:
    """The hash of the linked text, the parameters and the facts, of the tree and of its guard."""
    parts: list[object] = []
    for node in (root, root.conservative()):
        linked = link(node)
        parts += [linked.source, linked.parameters, node.bounds]
    return hashed(*parts)
