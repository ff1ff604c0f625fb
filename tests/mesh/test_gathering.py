"""Rows of arrays gathered by threads."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.mesh.shells import gather_rows

pytestmark = pytest.mark.once


@pytest.mark.parametrize("size", [1, 5, 1 << 17])
@pytest.mark.parametrize("shape", [(0,), (23,), (7, 6)])
def test_gathering_is_indexing(size: int, shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fracslice.mesh.shells.ROWS", size)
    rng = np.random.default_rng(1)
    table, rows = rng.random((9, 3)), rng.integers(9, size=shape).astype(np.int32)
    for values in (table, table[:, 0] > 0.5):
        np.testing.assert_array_equal(gather_rows(values, rows, 3), values[rows])
