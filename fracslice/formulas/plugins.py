"""Formulas from outside the package: files of the user, and packages that are installed."""

from __future__ import annotations

import sys
import traceback
import warnings
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from ..errors import FracsliceError, FracsliceWarning, SceneError
from .registry import Formula, get, names

GROUP = "fracslice.formulas"
"""Group of entry points: each names a module that registers formulas."""

_FILES: dict[str, Path] = {}


def run_file(path: str) -> list[Formula]:
    """Run a Python file that registers formulas, once."""
    file = Path(path).resolve()
    module = f"formulas of {file}"
    if module not in _FILES:
        spec = spec_from_file_location(module, file)
        if spec is None or spec.loader is None or not file.is_file():
            raise SceneError(f"{path}: expected a Python file of formulas")
        loaded = sys.modules[module] = module_from_spec(spec)
        try:
            spec.loader.exec_module(loaded)
        except FracsliceError:
            raise
        except Exception as error:
            lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__, None)]
            line = getattr(error, "lineno", None) or lines[-1]
            raise SceneError(f"{path}:{line}: {type(error).__name__}: {error}") from error
        _FILES[module] = file
    return [formula for formula in map(get, names()) if formula.function.__module__ == module]


@cache
def load_installed() -> None:
    """Load the formulas of installed packages; warn of a module that cannot be loaded."""
    from importlib.metadata import entry_points  # imports an e-mail parser

    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except Exception as error:
            message = f"formulas of {entry.value} are left out: {type(error).__name__}: {error}"
            warnings.warn(message, FracsliceWarning, stacklevel=2)


def origin(formula: Formula) -> str:
    """Place that a formula is from: a package, or a file of the user."""
    module = formula.function.__module__
    return str(_FILES.get(module, module.partition(".")[0]))
