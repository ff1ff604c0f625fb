"""Operations on models and shapes are solids of the volume that manifold3d has; `make nightly` tries 1000."""

from __future__ import annotations

import pytest

from tests.examples import stamped

from .booleans import faults

pytestmark = pytest.mark.once


@pytest.mark.parametrize("seed", stamped(range(1000), (0,)))
def test_a_random_operation_is_a_solid_of_its_volume(seed: int) -> None:
    assert faults(seed) == ()
