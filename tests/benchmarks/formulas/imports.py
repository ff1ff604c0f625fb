"""Mandelbulber's scenes: how many of a folder are imported without a missing formula, and what is missing.

The folder is that of the examples in a checkout of github.com/buddhi1980/mandelbulber2, such as
mandelbulber2/deploy/share/mandelbulber2/examples; without one, small files of our own.
"""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from pathlib import Path

from fracslice.scene.mandelbulber.importer import unknown
from tests.benchmarks.runner import Row, Run

OWN = {"known": "formula_1 8;", "unknown": "formula_1 1619;", "default": "N 20;"}
"""Settings of files of our own."""

EXPLICIT = re.compile(r"^formula_\d ", re.MULTILINE)
NUMBER = re.compile(r"formula_\d (\d+ \(\w+\))")

SMALLEST = {"most": 2}


def rows(run: Run, folder: str = "", most: int = 12) -> list[Row]:
    """Shares of the files, and the formulas that most files lack."""
    with tempfile.TemporaryDirectory() as own:
        for name, line in OWN.items():
            Path(own, f"{name}.fract").write_text(f"# version 2.33\n[main_parameters]\n{line}\n")
        files = sorted(Path(folder or own).rglob("*.fract"))
        explicit = [file for file in files if EXPLICIT.search(file.read_text(errors="replace"))]
        messages = [message for file in explicit if (message := unknown(file))]
    known = len(explicit) - len(messages)
    table: list[Row] = [
        {"": "files with a formula", "files": len(explicit), "share": "100 %"},
        {"": "imported without a missing one", "files": known, "share": f"{known / len(explicit):.1%}"},
    ]
    lacking = Counter(match[1] for message in messages if (match := NUMBER.search(message)))
    table += [{"": f"lack {name}", "files": count, "share": ""} for name, count in lacking.most_common(most)]
    return table
