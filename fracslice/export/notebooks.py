"""Notebooks of Jupyter that hold a scene, and cells that look at it and make it (nbformat 4.5)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..common.files import replacing

NOTEBOOK = ".ipynb"
"""Ending of a notebook."""

CELLS = (
    "from fracslice import Studio, make_mesh, reads\n\nscene = reads({text!r}, {name!r})",
    "studio = Studio(scene)  # a page: studio.scene is the scene as it is there now\nstudio",
    "mesh = make_mesh(scene, resolution={resolution:g})\nmesh.export({mesh!r})\nmesh.report",
)
"""Cells of code."""


def write_notebook(path: Path, text: str, resolution: float) -> None:
    """Write a notebook of a scene.

    Parameters
    ----------
    path : Path
        File.
    text : str
        XML of the scene.
    resolution : float
        Voxels along the longest side of the mesh that it makes.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    given = {"text": text, "name": path.stem, "resolution": resolution, "mesh": f"{path.stem}.3mf"}
    cells = [_cell(0, "markdown", f"# {path.stem}")]
    cells += [_cell(number, "code", cell.format(**given)) for number, cell in enumerate(CELLS, 1)]
    spec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"nbformat": 4, "nbformat_minor": 5, "metadata": {"kernelspec": spec}, "cells": cells}
    with replacing(path) as file:
        file.write(json.dumps(notebook, indent=1).encode())


def _cell(number: int, kind: str, source: str) -> dict[str, Any]:
    made: dict[str, Any] = {"id": f"cell-{number}", "cell_type": kind, "metadata": {}, "source": source}
    return made if kind == "markdown" else made | {"execution_count": None, "outputs": []}
