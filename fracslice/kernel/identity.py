"""What a field is known by."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..formulas.registry import Node
from ..keys import key
from .cpu import Compilable
from .linker import link


@dataclass(frozen=True)
class Known:
    """A scene tree that is equal to those of the same field, whatever became of its formulas since."""

    node: Node = field(compare=False)
    key: str = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", field_key(self.node))


def field_key(root: Node | Compilable) -> str:
    """The key of all that a field's values, and what is known of them, follow from.

    Of the scene itself and of its conservative: the linked text, the parameters and the facts. Depths must be
    resolved; raises `KernelError`.
    """
    if not isinstance(root, Node):
        return root.key
    parts: list[object] = []
    for node in (root, root.conservative()):
        linked = link(node)
        parts += [linked.source, linked.parameters, node.bounds]
    return key(*parts)
