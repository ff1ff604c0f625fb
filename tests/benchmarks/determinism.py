"""Whether a scene comes out the same every time, on a machine of many cores.

`python -m tests.benchmarks.determinism [SCENE] [--runs 40] [--threads 4,8,16]`. Every run is a new process
of the command line, of one number of threads after the other. Prints how many hashes there are of each file
and exits with 1 if there is more than one.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from .tables import table

COMMAND = [sys.executable, "-c", "from fracslice.cli import main; main()"]
JOBS = {
    "mesh.stl": ("mesh", "--resolution", "256"),
    "slices.sl1": ("slice", "--size", "30mm", "--layer", "0.2mm", "--printer", "sl1s"),
    "picture.png": ("render", "--size", "320x240", "--samples", "8", "--device", "cpu"),
}


def made(scene: str, name: str, threads: int) -> str:
    """The hash of a file that a new process makes."""
    command, *options = JOBS[name]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        given = [command, scene, "-o", str(path), *options, "--threads", str(threads), "--quiet"]
        subprocess.run([*COMMAND, *given], check=True)
        return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("scene", nargs="?", default="mandelbulb")
    arguments.add_argument("--runs", type=int, default=40, help="of each number of threads")
    arguments.add_argument("--threads", default="4,8,16", help="numbers, separated by commas")
    given = arguments.parse_args()
    threads = [int(number) for number in given.threads.split(",")]
    print(f"Python {sys.version.split()[0]}, {os.cpu_count()} cores, {given.scene}, {given.runs} runs each")
    hashes = {
        (name, count): Counter(made(given.scene, name, count) for _ in range(given.runs))
        for name in JOBS
        for count in threads
    }
    rows = [
        [name, count, ", ".join(f"{times} x {key}" for key, times in found.items())]
        for (name, count), found in hashes.items()
    ]
    print(table(["file", "threads", "runs x hash"], rows))
    differ = [name for name in JOBS if len(set().union(*(hashes[name, count] for count in threads))) > 1]
    print(f"NOT THE SAME: {', '.join(differ)}" if differ else "all the same")
    sys.exit(bool(differ))


if __name__ == "__main__":
    main()
