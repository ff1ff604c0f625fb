"""One suite, stamped on every registered formula: it agrees with what is known of it."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.formulas import names

from .truths import TRUTHS

pytestmark = pytest.mark.once


def test_something_is_known_of_every_formula() -> None:
    assert {name for name, truths in TRUTHS.items() if truths} == set(names())


@pytest.mark.parametrize("name", TRUTHS)
def test_what_is_known_is_true(name: str) -> None:
    rng = np.random.default_rng(7)
    for truth in TRUTHS[name]:
        truth.verify(rng)
