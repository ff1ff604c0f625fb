"""Small jobs import no more modules than they need: importing takes most of their time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

pytestmark = pytest.mark.once

BALL = '<scene version="1"><solid size="20mm"><sphere/></solid></scene>'
MODULES = """
import sys
from fracslice.cli.main import run
assert run(sys.argv[1:]) == 0
print(*sorted(sys.modules))
"""
JOBS = {
    "help": ("--help",),
    "mesh": ("mesh", "ball.xml", "-o", "ball.stl", "--resolution", "16", "--quiet"),
    "slice": ("slice", "ball.xml", "-o", "ball.sl1", "--layer", "5mm", "--printer", "sl1s", "--quiet"),
    "render": ("render", "ball.xml", "-o", "ball.png", "--size", "16x16", "--samples", "1", "--quiet"),
    "check": ("check", "plate.stl"),
}
UNUSED = {
    "help": (
        "numpy",
        "llvmlite",
        "concurrent",
        "json",
        "fracslice.scene",
        "fracslice.fields",
        "fracslice.expr",
    ),
    "mesh": (
        "scipy",
        "email",
        "importlib.metadata",
        "subprocess",
        "PIL",
        "rich",
        "json",
        "fracslice.cli.render",
    ),
    "slice": (
        "scipy",
        "importlib.metadata",
        "http",
        "ssl",
        "rich",
        "numpy.ma",
        "tomllib",
        "fracslice.mesh",
        "fracslice.printing.preparation",
        "fracslice.volume.sampler",
    ),
    "render": (
        "scipy",
        "email",
        "importlib.metadata",
        "numpy.ma",
        "subprocess",
        "rich",
        "fracslice._vdb",
        "fracslice.mesh",
    ),
    "check": (
        "scipy",
        "numba",
        "trimesh",
        "email",
        "ssl",
        "numpy.ma",
        "PIL",
        "fracslice._vdb",
        "fracslice.scene",
        "fracslice.formulas",
    ),
}
"""Packages that take long to import, by the job that has no use for them."""
MOST = {"help": 160, "mesh": 413, "slice": 465, "render": 420, "check": 365}
"""Modules that are imported; of a mesh, six more or less: of powers two, of isal five."""


@pytest.mark.parametrize("job", JOBS)
def test_a_small_job_imports_what_it_needs(job: str, tmp_path: Path) -> None:
    (tmp_path / "ball.xml").write_text(BALL)
    trimesh.creation.box((20, 20, 1)).export(tmp_path / "plate.stl")
    words = [sys.executable, "-c", MODULES, *JOBS[job]]
    for _ in range(2):  # the first one may have to compile
        run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    result = run.stdout.splitlines()[-1].split()
    for package in UNUSED[job]:
        assert not [name for name in result if name == package or name.startswith(package + ".")], package
    assert len(result) <= MOST[job]
