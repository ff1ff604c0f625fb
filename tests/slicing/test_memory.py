"""The memory of slabs, where memory is short."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.once

SOURCES = Path(__file__).parents[2] / "fracslice" / "native" / "slices"


@pytest.mark.nightly
def test_tiles_are_given_back_without_memory(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """A slab's destructor does so: what it threw would end the process."""
    program = tmp_path / "memory"
    own = (SOURCES / f"{name}.cpp" for name in ("slab", "coverage", "marching_squares"))
    sources = [Path(__file__).with_name("memory.cpp"), *own]
    compiler = os.environ.get("CXX", "g++")
    subprocess.run([compiler, "-std=c++20", "-I", SOURCES, *sources, "-o", program], check=True)
    subprocess.run([program], check=True)
