"""The hand-written C++ peers of tests/benchmarks/cpp, built when needed; `make peers` builds them all."""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
from pathlib import Path
from typing import Any

SOURCE = Path(__file__).parent / "cpp"
BUILD = Path(__file__).parents[2] / "build/peers"
NAMES = ("kernels", "sparse", "vdb", "slices", "frame")


def program(name: str) -> Path:
    """The path of a peer's program, brought up to date.

    Raises
    ------
    SystemExit
        If it cannot be built; the message is the compiler's.
    """
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / ".lock").open("w") as lock:  # two processes do not build at the same time
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (BUILD / "build.ninja").exists():
            _quietly("cmake", "-G", "Ninja", "-S", SOURCE, "-B", BUILD)
        _quietly("cmake", "--build", BUILD, "--target", name)
    return BUILD / name


def output(name: str, *arguments: object) -> list[dict[str, Any]]:
    """Run a peer; the lines of JSON that it prints."""
    idle = {**os.environ, "OMP_WAIT_POLICY": "passive"}  # else threads that wait count as CPU seconds
    command = [program(name), *map(str, arguments)]
    printed = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=idle).stdout
    return [json.loads(line) for line in printed.splitlines()]


def _quietly(*command: object) -> None:
    ran = subprocess.run([*map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if ran.returncode:
        raise SystemExit(ran.stdout)


if __name__ == "__main__":
    for each in NAMES:
        print(program(each))
