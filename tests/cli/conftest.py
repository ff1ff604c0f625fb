"""What several commands are pointed at."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    """A scene file: a ball of 20 mm."""
    path = tmp_path / "ball.xml"
    path.write_text('<scene version="1"><solid size="20mm"><sphere/></solid></scene>')
    return path
