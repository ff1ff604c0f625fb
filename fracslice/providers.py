"""Modules of upper layers that lower layers call: a lower layer names a role, and the package its module.

Methods of shapes and meshes stand for functions of layers that import them: a compiler of trees, the analysis
of orbits, distances at points, and the writer of files.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_MODULES: dict[str, str] = {}


def register(**modules: str) -> None:
    """Set the modules of roles."""
    _MODULES.update(modules)


def provider(role: str) -> Any:
    """Return the module of a role."""
    return import_module(_MODULES[role])
