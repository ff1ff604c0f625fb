"""The README's Python, as it stands there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"
CODE = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("code", CODE, ids=lambda code: code.split("write(")[1][:12])
def test_what_the_readme_shows_makes_a_mesh(code: str, tmp_path: Path) -> None:
    small = re.sub(r"resolution=\d+", "resolution=32", code)
    script = tmp_path / "script.py"
    script.write_text(small, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    (made,) = (path for path in tmp_path.iterdir() if path != script)
    assert made.stat().st_size > 10_000
