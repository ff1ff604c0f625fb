"""All benchmarks: `python -m tests.benchmarks` lists them, and NAME --help explains one."""

from __future__ import annotations

import argparse
import ast
import importlib
import inspect
import json
import os
import platform
import sys
from dataclasses import asdict, is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from rich.console import Console
from rich.table import Table

from .runner import Row, Run, cell, columns, markdown, publish

FOLDER = Path(__file__).parent


def summaries() -> dict[str, str]:
    """The first line of every benchmark's docstring, by its name; modules with `rows` are benchmarks."""
    result = {}
    for path in sorted(FOLDER.glob("*/*.py")):
        text = path.read_text(encoding="utf-8")
        if "\ndef rows(" in text:
            lines = (ast.get_docstring(ast.parse(text)) or "").splitlines()
            result[f"{path.parent.name}.{path.stem}"] = lines[0]
    return result


def load(name: str) -> ModuleType:
    """The module of a benchmark."""
    return importlib.import_module(f"{__package__}.{name}")


def options(module: ModuleType) -> dict[str, Any]:
    """The options of a benchmark and their defaults: the keywords of its `rows`."""
    parameters = list(inspect.signature(module.rows).parameters.values())[1:]
    return {parameter.name: parameter.default for parameter in parameters}


def parser(name: str, module: ModuleType) -> argparse.ArgumentParser:
    """The command line of a benchmark."""
    made = argparse.ArgumentParser(f"tests.benchmarks {name}", description=module.__doc__)
    made.formatter_class = argparse.RawDescriptionHelpFormatter
    runs, threads = getattr(module, "RUNS", 5), getattr(module, "THREADS", [2])
    made.add_argument("--runs", type=int, default=runs, help="interleaved runs of each; %(default)s")
    made.add_argument("--threads", type=int, nargs="+", default=threads, help="%(default)s")
    made.add_argument("--json", type=Path, metavar="FILE", help="write the figures")
    made.add_argument("--write", action="store_true", help="put the table into docs/measurements.md")
    for key, value in options(module).items():
        several = isinstance(value, tuple)
        kind, count = type(value[0] if several else value), "+" if several else None
        made.add_argument(
            f"--{key}", type=kind, nargs=count, default=value, help=str(value).replace("%", "%%")
        )
    return made


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    model = platform.processor()
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        model = next((line.split(": ", 1)[1] for line in lines if line.startswith("model name")), model)
    load_average = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "processor": model,
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "load": load_average,
    }


def measure(module: ModuleType, run: Run, given: dict[str, Any]) -> list[Row]:
    """All rows of a benchmark, counted on standard error while they come."""
    result: list[Row] = []
    with Console(stderr=True).status(module.__name__) as status:
        for row in module.rows(run, **given):
            result.append(row)
            status.update(f"{module.__name__}: {len(result)} rows")
    return result


def shown(name: str, rows: list[Row]) -> Table:
    """The table of a terminal."""
    table = Table(title=name, title_justify="left")
    for k, key in enumerate(columns(rows)):
        text = any(isinstance(row.get(key), str) for row in rows)
        table.add_column(key, justify="left" if text else "right", overflow="fold", no_wrap=k == 0)
    for row in rows:
        table.add_row(*(cell(row.get(key)) for key in columns(rows)))
    return table


def main(words: list[str]) -> int:
    """Run a benchmark, or list them all; 1 if it met a fault."""
    known = summaries()
    if not words or words[0] not in known:
        table = Table("name", "what it measures", box=None)
        for name, summary in known.items():
            table.add_row(name, summary)
        Console().print(table)
        return 2 * (bool(words) and words[0] not in ("-h", "--help"))
    name, module = words[0], load(words[0])
    given = vars(parser(name, module).parse_args(words[1:]))
    run = Run(given.pop("runs"), tuple(given.pop("threads")))
    path, write = given.pop("json"), given.pop("write")
    where = machine()
    rows = measure(module, run, {key: tuple(v) if isinstance(v, list) else v for key, v in given.items()})
    Console().print(shown(name, rows), *run.faults, sep="\n")
    if path:
        how = {**given, "runs": run.runs, "threads": run.threads}
        about = {"benchmark": name, "machine": where, "options": how}
        text = json.dumps({**about, "rows": rows, "faults": run.faults}, default=_plain, indent=1)
        path.write_text(text + "\n")
    if write:
        publish(name, markdown(rows))
    return int(bool(run.faults))


def _plain(value: Any) -> Any:
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else str(value)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
