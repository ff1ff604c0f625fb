"""Every block of Python in the README and the manual runs as it stands there, in small.

The blocks of a page are one script, as they would be the cells of one notebook. A block that a test cannot
run has the line ``<!-- not run: REASON -->`` above it.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.once

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^(?:<!-- not run: (?P<reason>[^\n]+) -->\n+)?```python\n(?P<code>.*?)^```$", re.M | re.S)
REASONS = {"needs a GPU", "needs a window", "needs a cluster", "needs SLURM", "needs Kubernetes"}
SMALL = [
    (r"\bresolution=\d+", "resolution=32"),
    (r"\bsamples=\d+", "samples=1"),
    (r"\bsize=\(\d+, \d+\)", "size=(32, 24)"),
    (r"\bperiod=\d+", "period=20"),
    (r"\bshell(=|\()[\d.]+", r"shell\g<1>6"),
]


def script(page: str) -> str:
    """The code of a page on the lines that it has there, all else empty."""
    lines = [""] * page.count("\n")
    for block in BLOCK.finditer(page):
        if not block["reason"]:
            first = page.count("\n", 0, block.start("code"))
            code = block["code"].splitlines()
            lines[first : first + len(code)] = code
    text = "\n".join(lines)
    for pattern, small in SMALL:
        text = re.sub(pattern, small, text)
    return text


def with_code() -> list[Path]:
    return [page for page in PAGES if script(page.read_text(encoding="utf-8")).strip()]


@pytest.mark.parametrize("page", with_code(), ids=lambda page: page.name)
def test_what_a_page_shows_runs(page: Path, tmp_path: Path) -> None:
    code = tmp_path / page.with_suffix(".py").name
    code.write_text(script(page.read_text(encoding="utf-8")), encoding="utf-8")
    command = [sys.executable, code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    made = {path.name for path in tmp_path.iterdir()} - {code.name}
    shown = set(re.findall(r'"([\w-]+\.(?:stl|3mf|ply|png|npy|vdb))"', code.read_text(encoding="utf-8")))
    assert made == shown
    assert all((tmp_path / name).stat().st_size > 500 for name in made)


def test_blocks_are_found_where_they_are() -> None:
    page = (
        "a\n\n```python\nb = 1\n```\nc\n<!-- not run: needs a GPU -->\n```python\nd = 2\n```\n```xml\n```\n"
    )
    assert script(page) == "\n" * 3 + "b = 1" + "\n" * 8
    assert ROOT / "README.md" in with_code()


def test_blocks_that_do_not_run_say_why() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert {block["reason"] for block in BLOCK.finditer(text)} - {None} <= REASONS
    assert len(BLOCK.findall(text)) == text.count("```python") + text.count("```py\n")
