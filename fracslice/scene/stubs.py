"""Stub files: formulas as functions, from the registry."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from pathlib import Path

from .. import formulas
from ..formulas import vocabulary
from ..formulas.registry import Formula, Node, get, names
from ..formulas.signatures import docstring, signature


def stub() -> str:
    """Text of the stub file of `fracslice.formulas`: formulas as functions, all other names re-exported."""
    package = Path(formulas.__file__)
    imports = [
        n for n in ast.parse(package.read_text(encoding="utf-8")).body if isinstance(n, ast.ImportFrom)
    ]
    lines = [_HEAD]
    for node in imports:
        exported = sorted(vocabulary.NAMES) if node.module == "vocabulary" else [a.name for a in node.names]
        lines += [f"from .{node.module} import {name} as {name}" for name in exported if node.level]
    imported = {alias.name for node in imports for alias in node.names}
    made = [name for name in _shipped() if name not in imported]
    return "\n".join([*lines, *(f"\n{_function(get(name))}" for name in made)]) + "\n"


def _shipped() -> list[str]:
    """Names of the formulas of this package."""
    return [name for name in names() if get(name).function.__module__.startswith(formulas.__name__)]


def package_stub(modules: Mapping[str, str]) -> str:
    """Text of the stub file of `fracslice`: its public names, and every formula.

    Parameters
    ----------
    modules : mapping of str to str
        Module of each public name, relative to the package.
    """
    exported = {**modules, **dict.fromkeys(_shipped(), "formulas")}
    lines = sorted(f"from .{module} import {name} as {name}" for name, module in exported.items())
    return "\n".join([_MADE, *lines, ""])


_MADE = "# Made from the registry of formulas by `python docs/generate.py`; do not edit."
_HEAD = f"""\
{_MADE}
from collections.abc import Sequence
from typing import Literal, Union
"""


def _function(formula: Formula) -> str:
    """Function of a formula in the stub file."""
    text = re.sub(r"\b(?:fracslice\.formulas\.\w+|collections\.abc)\.", "", str(signature(formula, Node)))
    body = docstring(formula).replace("\n", "\n    ").replace("\n    \n", "\n\n")
    return f'def {formula.name}{text}:\n    """{body}\n    """'
