"""Functions of a layer above, imported at their first call.

Methods of shapes and meshes stand for functions of layers that import them: the kernel compiles a tree of
formulas, and exporters write a mesh.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def late(path: str) -> Any:
    """Import a name.

    Parameters
    ----------
    path
        Dotted path relative to the package, such as "kernel.tree.key".

    Returns
    -------
    Any
        The object of that name.
    """
    module, _, name = path.rpartition(".")
    return getattr(import_module(f".{module}", __package__), name)
