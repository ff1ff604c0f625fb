"""The installed wheel at work, with no OpenVDB or oneTBB from outside it: ``python tests/wheel.py``."""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import fracslice._native
import fracslice._vdb

PAGE = Path(__file__).resolve().parents[1] / "docs/tasks/formula.md"
OWN = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)[:2]
"""Programs of the page on formulas: one of a field, one of a step."""

SCENE = '<scene version="1"><solid size="4cm"><{}/></solid></scene>'

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
    for name, text in zip(("coral", "own_box"), OWN, strict=True):
        Path(folder, "own.py").write_text(text)
        Path(folder, "own.xml").write_text(SCENE.format(name))
        subprocess.run([sys.executable, "own.py"], cwd=folder, check=True)
        assert Path(folder, f"{name}.stl").stat().st_size > 10_000
        Path(folder, "own.py").write_text(text.partition("\nmake_mesh(")[0])
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
