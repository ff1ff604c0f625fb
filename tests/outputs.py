"""Hashes of many outputs, to compare before and after a change of no output: ``python -m tests.outputs``."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

from fracslice.cli.main import run

from fracslice.scene.library import names

SHAPES = [
    "mandelbulb", "julia", "menger", "mandelbox", "bristorbrot", "quaternion_mandelbrot", "jerusalem",
    "flake", "kifs_octahedron", "apollonian", "gear", "koch", "superquadric", "torus", "tetrabrot",
    "lambda_bulb",
]  # fmt: skip
"""Formulas with a size of their own."""

MESHES = [
    *((name, ".stl", "--resolution", "48") for name in SHAPES),
    ("mandelbulb", ".3mf", "--resolution", "40", "--simplify", "0.1mm"),
    ("mandelbulb", ".ply", "--resolution", "40", "--hollow", "2mm", "--drain", "3mm"),
    ("menger", ".obj", "--resolution", "40", "--base", "2mm"),
    ("julia", ".glb", "--resolution", "40", "--thickness", "1mm", "--bridge", "2mm"),
    ("julia", ".stl", "--resolution", "40", "--chord", "0.1mm"),
]
STACKS = [("mandelbulb", ".sl1"), ("menger", ".json"), ("julia", ".cli"), ("torus", ".svg"), ("koch", ".3mf")]
LAYERS = "--layer", "0.5mm", "--size", "20mm", "--printer", "sl1s"
PICTURE = "--size", "64x48", "--samples", "2"


def scene(shape: str) -> str:
    """Scene of a formula with its default values."""
    return f'<scene version="1"><solid size="40mm"><{shape}/></solid></scene>'


def hashed(command: str, name: str, ending: str, *words: str) -> str:
    """Status and hash of the output of a command, on a shipped scene or a formula."""
    with tempfile.TemporaryDirectory() as folder:
        source, output = Path(folder) / f"{name}.xml", Path(folder) / f"x{ending}"
        source.write_text(scene(name), encoding="utf-8")
        status = run(
            [command, name if command == "render" else str(source), "-o", str(output), *words, "--quiet"]
        )
        found = hashlib.sha256(output.read_bytes()).hexdigest()[:16] if output.is_file() else "no file"
    return f"{found} {status}"


def main() -> None:
    """Print the hash, the status and the words of each command."""
    os.environ["SOURCE_DATE_EPOCH"] = "1700000000"
    jobs = [
        *(("mesh", *words) for words in MESHES),
        *(("slice", *words, *LAYERS) for words in STACKS),
        *(("render", name, ".png", *PICTURE) for name in names()),
    ]
    for job in jobs:
        print(hashed(*job), *job, flush=True)


if __name__ == "__main__":
    main()
