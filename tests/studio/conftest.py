"""Sessions of scenes that tests write."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from fracslice.studio.session import Session
from fracslice.work import Work

Begin = Callable[[str, str, tuple[int, int]], Session]
"""Opens a scene by its file name, text and size of the picture in pixels."""


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Begin]:
    """Begin sessions of scenes; they are closed after the test."""
    with ExitStack() as opened:

        def begun(name: str, text: str, size: tuple[int, int]) -> Session:
            (tmp_path / name).write_text(text)
            made = Session(str(tmp_path / name), tmp_path, Work(threads=1), "cpu")
            made.live.resize(size)
            return opened.enter_context(closing(made))

        yield begun
