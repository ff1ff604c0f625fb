"""The installed wheel at work, with no OpenVDB or oneTBB from outside it: ``python tests/wheel.py``."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import fracslice._native
import fracslice._vdb

OWN = '''from fracslice.formulas import Number, orbit
from fracslice.formulas.verbs import ball, fold


@orbit(scale=Number(-1.7, "how much each step enlarges"))
def own_box(w, c, scale):
    """A Mandelbox (Lowe 2010)."""
    return scale * ball(fold(w, 1.0), 0.5) + c
'''
SCENE = '<scene version="1"><solid size="4cm"><own_box iterations="3"/></solid></scene>'

with tempfile.TemporaryDirectory() as folder:
    program = [
        sys.executable,
        "-m",
        "fracslice.cli",
        "mesh",
        "menger-sponge",
        "--resolution",
        "48",
        "--quiet",
    ]
    subprocess.run([*program, "-o", "a.stl", "--report", "a.json"], cwd=folder, check=True)
    report = json.loads(Path(folder, "a.json").read_text())
    Path(folder, "own.py").write_text(OWN)
    Path(folder, "own.xml").write_text(SCENE)
    subprocess.run([*program[:3], "formulas", "--check", "own.py"], cwd=folder, check=True)
    own = ["mesh", "own.xml", "--formulas", "own.py", "-o", "own.stl", "--resolution", "32", "--quiet"]
    subprocess.run([*program[:3], *own], cwd=folder, check=True)
    assert Path(folder, "own.stl").stat().st_size > 10_000
assert report["watertight"] and report["manifold"] and report["triangles"] > 1000, report
maps = Path("/proc/self/maps")
lines = maps.read_text().splitlines() if maps.exists() else []
loaded = {line.split()[-1] for line in lines if "openvdb" in line or "libtbb" in line}
outside = {path for path in loaded if "fracslice.libs" not in path}
assert not outside, outside
print(fracslice._native.__file__, report["triangles"], "triangles", *sorted(loaded))
