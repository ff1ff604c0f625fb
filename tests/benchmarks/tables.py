"""Tables of measurements, printed and, with `--write`, put into docs/measurements.md at their marks."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs/measurements.md"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def publish(name: str, text: str) -> None:
    """Prints a text; with `--write` it replaces what is between the page's marks `name`."""
    print(text)
    if "--write" in sys.argv[1:]:
        start, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        page = PAGE.read_text(encoding="utf-8")
        before, rest = page.split(start)
        PAGE.write_text(before + start + text + "\n" + end + rest.split(end)[1], encoding="utf-8")
