"""Fixtures of several folders."""

import pytest


@pytest.fixture
def only_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """No tetrahedra in place of samples that lose an object."""
    monkeypatch.setattr("fracslice.jobs.mesh._Job.split_up", lambda _: None)
