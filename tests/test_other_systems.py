"""Systems without POSIX's modules, flags and descriptors, simulated: Windows."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HIDDEN = """
import os, subprocess, sys, types
for name in ("grp", "pwd", "fcntl", "resource"):
    sys.modules[name] = None
for name in "geteuid fchmod sysconf O_NOFOLLOW O_NONBLOCK O_DIRECTORY O_CLOEXEC".split():
    delattr(os, name)
locked = []
sys.modules["msvcrt"] = types.SimpleNamespace(LK_NBLCK=2, locking=lambda *of: locked.append(of))
real = os.open
def without_descriptors(path, flags, mode=0o777, *, dir_fd=None):
    if dir_fd is not None:
        raise NotImplementedError("dir_fd unavailable on this platform")
    if os.path.isdir(path):
        raise PermissionError(13, "Permission denied")
    return real(path, flags, mode)
os.open = without_descriptors
"""

JOB = """
from pathlib import Path
from fracslice import sphere, make_mesh
from fracslice.export.slice_run import SliceRun
from fracslice.export.layers import write_slices
from fracslice.slicing import SliceJob, plan_stack
from fracslice.slicing.raster import Screen
folder = Path(sys.argv[1])
make_mesh(sphere(), size=10, resolution=16).export(folder / "ball.stl")
stack = plan_stack(sphere(), SliceJob(size=10, layer=1, pixel=(0.5, 0.5)))
for name in ("ball.cli", "layers"):
    write_slices(SliceRun(stack, Screen(stack)), folder / name)
assert [(mode, size) for _, mode, size in locked] == [(2, 1)], locked
"""


def test_files_and_caches_without_posix(tmp_path: Path) -> None:
    """A mesh, a file and a folder of layers, caches and secrets: twice, so that the second job reads them."""
    (tmp_path / "out").mkdir()
    environment = {
        "PATH": "/usr/bin:/bin",
        "PYTHONPATH": os.environ.get("PYTHONPATH", ""),
        "FRACSLICE_CACHE": f"{tmp_path}/cache",
        "XDG_CONFIG_HOME": f"{tmp_path}/config",
    }
    results = []
    for _ in range(2):
        command = [sys.executable, "-W", "error", "-c", HIDDEN + JOB, tmp_path / "out"]
        subprocess.run(command, env=environment, check=True)
        results.append({p.name: p.read_bytes() for p in (tmp_path / "out").rglob("*") if p.is_file()})
        for path in (tmp_path / "out" / "layers").iterdir():
            path.unlink()
    assert results[0] == results[1]
    assert len(results[0]) == 2 + 11
    assert (tmp_path / "config" / "fracslice" / "secret").stat().st_size == 32
    assert any(path.suffix == ".o" for path in (tmp_path / "cache").iterdir())
