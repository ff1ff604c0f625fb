"""Random hybrids of all orbits: none loses an inside sample against a dense grid. `make nightly`."""

from __future__ import annotations

from collections.abc import Iterator

from tests.stability.random_hybrids import lost, random_hybrid

from ..runner import Row, Run

SMALLEST = {"count": 1, "resolution": 16.0}


def rows(run: Run, count: int = 200, first: int = 0, resolution: float = 64.0) -> Iterator[Row]:
    faulty = 0
    for seed in range(first, first + count):
        result = sum(lost(random_hybrid(seed), resolution, proved) for proved in (False, True))
        if result:
            faulty += 1
            run.faults.append(f"{seed}: {result} samples lost\n    {random_hybrid(seed)}")
            yield {"": str(seed), "lost": str(result)}
    yield {"": "all", "hybrids": str(count), "faults": str(faulty)}
