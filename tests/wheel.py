"""The installed wheel at work, with no OpenVDB or oneTBB from outside it: ``python tests/wheel.py``."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import fracslice._native
import fracslice._vdb

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
assert report["watertight"] and report["manifold"] and report["triangles"] > 1000, report
maps = Path("/proc/self/maps")
lines = maps.read_text().splitlines() if maps.exists() else []
loaded = {line.split()[-1] for line in lines if "openvdb" in line or "libtbb" in line}
outside = {path for path in loaded if "fracslice.libs" not in path}
assert not outside, outside
print(fracslice._native.__file__, report["triangles"], "triangles", *sorted(loaded))
