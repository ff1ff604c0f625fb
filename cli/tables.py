"""Tables of meshes: a .csv file with a row for each output."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .inputs import BadInput

if TYPE_CHECKING:
    from fracslice.jobs.report import Report

KEY = "file"
"""First column: the output of the row."""


def table_rows(path: str) -> dict[str, dict[str, Any]]:
    """Rows of a table by their output; none if there is no file.

    Raises `BadInput` for a file that is no table of meshes.
    """
    import csv

    try:
        table = csv.DictReader(Path(path).read_text("utf-8").splitlines())
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError):
        raise BadInput(f"{path}: cannot be read as a table") from None
    if KEY not in (table.fieldnames or ()):
        raise BadInput(f"{path}: expected a table of meshes, with a column {KEY!r}, or a new file")
    return {row[KEY]: {name: value for name, value in row.items() if name} for row in table}


def write_row(path: str, output: str, settings: Sequence[str], report: Report) -> None:
    """Write the settings and numbers of a mesh to its row of a table; the rows of other outputs stay."""
    import csv

    from fracslice.export import replacing

    numbers = {name: value for name, value in report.as_dict().items() if isinstance(value, int | float)}
    values = dict(setting.split("=", 1) for setting in settings)
    own = {KEY: output, **values, **numbers, "problems": "; ".join(report.problems)}
    rows = {**table_rows(path), output: own}
    text = io.StringIO()
    table = csv.DictWriter(text, list(dict.fromkeys(name for row in rows.values() for name in row)))
    table.writeheader()
    table.writerows(rows.values())
    with replacing(path) as file:
        file.write(text.getvalue().encode())
