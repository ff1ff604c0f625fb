"""Implementation of `formulas.field.Field` for scene trees; `Node` calls it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.keys import key as hashed
from ..formulas.field import Cells, Device, Kernel, Loops, Precision
from ..formulas.registry import Node
from . import cpu
from .enclosures import Enclosures
from .linker import link
from .loops import Loop, enclosures


def kernel(root: Node, device: Device, precision: Precision) -> Kernel:
    """Compile the kernel of a tree with resolved depths; see `Field.kernel`."""
    if device == "cpu":
        return cpu.compile_scene(root, precision)
    from . import cuda

    return cuda.compile_scene(root, precision)


def loops(root: Node, loops: Sequence[Loop], precision: Precision, device: Device = "cpu") -> Loops:
    """Compile loops over a tree with resolved depths; see `Field.loops`."""
    if device == "cpu":
        return cpu.compile_loops(link(root), tuple(loops), precision)
    from . import cuda_launching

    return cuda_launching.compile_loops(link(root), tuple(loops), precision)


def cells(root: Node, precision: Precision) -> Cells:
    """Compile proofs that a tree's field has one sign on cells; see `Field.cells`."""
    return Enclosures(cpu.compile_loops(link(root.signs()), (enclosures,), precision), np.dtype(precision))


def key(root: Node) -> str:
    """Hash the text, parameters and bounds of a tree and of its conservative field; see `Field.key`."""
    parts: list[object] = []
    for node in (root, root.conservative()):
        linked = link(node)
        parts += [linked.source, linked.parameters, node.bounds]
    return hashed(*parts)
