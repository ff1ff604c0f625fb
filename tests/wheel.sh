#!/bin/sh
# wheel.sh WHEEL: installs a repaired wheel in a new venv and uses it; fails if it loads any OpenVDB from outside itself.
set -eu
wheel=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
cd "$folder"
venv/bin/pip install --quiet "$wheel"
venv/bin/fracslice mesh menger-sponge -o sponge.stl --resolution 48 --report sponge.json --quiet
venv/bin/python - <<'PY'
import json
import fracslice._native
report = json.load(open("sponge.json"))
assert report["watertight"] and report["manifold"] and report["triangles"] > 1000, report
loaded = {line.split()[-1] for line in open("/proc/self/maps") if "openvdb" in line or "libtbb" in line}
assert loaded and all("fracslice.libs" in path for path in loaded), loaded
print("the wheel works:", report["triangles"], "triangles with", *sorted(p.split("/")[-1] for p in loaded))
PY
