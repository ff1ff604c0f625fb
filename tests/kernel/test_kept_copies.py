"""What is kept is known by everything that makes it."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from fracslice.expr import emitter, frontend, graph, runtime
from fracslice.fields import depth, growth, linker, orbit_code, steps


@pytest.mark.parametrize("module", [linker, steps, orbit_code, growth, depth, frontend, graph, emitter])
def test_what_makes_texts_is_in_their_key(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another version of it must not read what this one has kept."""
    read = list[Path]()
    monkeypatch.setattr(runtime, "texts", lambda *files: read.extend(files) or "")
    runtime.toolchain.__wrapped__()
    assert module.__file__ and Path(module.__file__) in read
