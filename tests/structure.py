"""Figures of the structure: ``python -m tests.structure``. They are no gate: a reader judges."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[1]

MESH = "mesh", "mandelbulb", "-o", "x.stl", "--resolution", "32", "--quiet"
"""The job whose ways are counted, at a resolution that changes nothing in them."""

COMPILE = """
from fracslice import mandelbulb
from fracslice.fields.cpu import compile_scene
compile_scene(mandelbulb(8, iterations=10))
"""

TRACE = """
import json, sys, threading
from pathlib import Path

root = Path(sys.argv.pop(1))
folders = str(root / "fracslice"), str(root / "cli")
entered, functions, deepest = set(), set(), [0]

def own(code):
    return code.co_filename.startswith(folders) and not code.co_name.startswith("<module")

def profile(frame, event, argument):
    if event != "call" or not own(frame.f_code):
        return
    entered.add(frame.f_code.co_filename)
    functions.add(frame.f_code)
    depth, outer = 0, frame
    while outer:
        depth += own(outer.f_code)
        outer = outer.f_back
    deepest[0] = max(deepest[0], depth)

threading.setprofile(profile)
sys.setprofile(profile)
try:
    exec(sys.argv.pop(1))
finally:
    sys.setprofile(None)
    print(json.dumps([len(entered), len(functions), deepest[0]]))
"""


def python_files() -> list[Path]:
    """Modules of the program."""
    return [path for folder in ("fracslice", "cli") for path in sorted((ROOT / folder).rglob("*.py"))]


def native_files() -> list[Path]:
    """C++ files of the program, without generated tables."""
    return [p for p in sorted((ROOT / "fracslice/native").rglob("*")) if p.suffix in (".h", ".cpp")]


def lines(paths: Iterable[Path]) -> int:
    """Number of lines of files."""
    return sum(path.read_text(encoding="utf-8").count("\n") for path in paths)


def docstring_lines() -> int:
    """Lines of docstrings of the program."""
    kinds = ast.Module, ast.ClassDef, ast.FunctionDef
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in python_files())
    nodes = (node for tree in trees for node in ast.walk(tree) if isinstance(node, kinds))
    return sum(
        (ast.get_docstring(node, clean=False) or "").count("\n") + 1
        for node in nodes
        if ast.get_docstring(node)
    )


def traced(statement: str, *arguments: str, runs: int = 1) -> tuple[int, int, int]:
    """Modules and functions of ours that a statement enters, and the depth of its stack of ours.

    Counted in the last of some runs, of which the first has an empty cache.
    """
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-c", TRACE, str(ROOT), statement, *arguments]
        settings = {**os.environ, "XDG_CACHE_HOME": folder}
        for _ in range(runs):
            run = subprocess.run(words, cwd=folder, env=settings, capture_output=True, text=True, check=True)
    modules, functions, deepest = json.loads(run.stdout.splitlines()[-1])
    return modules, functions, deepest


def main() -> None:
    """Print the figures, each with the aim."""
    command = traced("from fracslice.cli.main import run; run(sys.argv[1:])", *MESH, runs=2)
    formula = traced(COMPILE)
    rows = [
        ("Python modules", len(python_files()), "200"),
        ("Python lines", lines(python_files()), "42,000"),
        ("of these, docstrings", docstring_lines(), ""),
        ("C++ files", len(native_files()), "70"),
        ("C++ lines", lines(native_files()), "11,500"),
        (f"modules that `fracslice {MESH[0]} {MESH[1]}` enters", command[0], "60"),
        ("functions that it enters", command[1], ""),
        ("deepest stack of own functions", command[2], "25"),
        ("modules from a Mandelbulb's formula to machine code", formula[0], "15"),
        ("functions", formula[1], ""),
    ]
    for name, figure, aim in rows:
        print(f"{name:<55}{figure:>8,}" + (f"   aim {aim}" if aim else ""))


if __name__ == "__main__":
    main()
