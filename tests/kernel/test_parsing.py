"""Linking in several threads."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from fracslice.expr.graph import text
from fracslice.fields.linker import FIELD, link
from fracslice.formulas import mandelbulb, menger


@pytest.fixture
def hasty() -> Iterator[None]:
    """Threads that take turns all the time, in the middle of `ast.parse` too: while garbage is collected."""

    def collected(phase: str, info: dict[str, int]) -> None:
        for _ in range(10):
            pass

    interval, thresholds = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(50)
    gc.callbacks.append(collected)
    yield
    gc.callbacks.remove(collected)
    gc.set_threshold(*thresholds)
    sys.setswitchinterval(interval)


def test_threads_link_at_the_same_time(hasty: None) -> None:
    """CPython 3.11 and 3.12 count how deep a tree is for all threads together."""
    root = (mandelbulb(iterations=4).scale(0.5) | menger(level=2)).twist(0.3)
    with ThreadPoolExecutor(4) as threads:
        linked = list(threads.map(lambda _: text(link(root).program.functions[FIELD]), range(16)))
    assert len(set(linked)) == 1
