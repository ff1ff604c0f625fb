"""Every benchmark runs at its smallest size; the runner's figures are right; the documentation names them."""

from __future__ import annotations

import json
import re
import sys
from functools import partial
from pathlib import Path

import pytest

from tests.benchmarks import __main__ as benchmarks
from tests.benchmarks.jobs.scaling import serial_share
from tests.benchmarks.runner import Run, Spread, markdown, process
from tests.examples import stamped

pytestmark = pytest.mark.once

PAGE = (Path(__file__).parents[1] / "docs/measurements.md").read_text(encoding="utf-8")
NAMES = list(benchmarks.summaries())


HERE = [name for name in NAMES if not name.startswith("gpu.")]
LONG = {
    "jobs.cluster",
    "jobs.workers",
    "libraries.error",
    "mesh.thin",
    "printing.islands",
    "printing.models",
    "printing.orientations",
    "printing.supports",
    "stability.random_hybrids",
    "stability.random_scenes",
    "frame.convergence",
}


@pytest.mark.parametrize("name", stamped(HERE, {*HERE} - LONG))
def test_runs_at_its_smallest_size(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in ("jobs.cluster", "jobs.workers"):  # workers as threads, which start at once
        distributed = pytest.importorskip("distributed")
        here = partial(distributed.LocalCluster, processes=False)
        monkeypatch.setattr(distributed, "LocalCluster", here)
    module, run = benchmarks.load(name), Run(1, (1,))
    pytest.importorskip(getattr(module, "NEEDS", "numpy"))
    rows = benchmarks.measure(module, run, module.SMALLEST)
    assert rows
    assert run.faults == []
    assert markdown(rows).count("\n") == len(rows) + 1


@pytest.mark.parametrize("name", NAMES)
def test_every_benchmark_explains_itself(name: str) -> None:
    module = benchmarks.load(name)
    text = benchmarks.parser(name, module).format_help()
    assert module.__doc__.splitlines()[0] in text
    assert all(f"--{option} " in text for option in (*benchmarks.options(module), "runs", "threads", "json"))


def test_figures_are_those_of_interleaved_runs() -> None:
    order, times = [], {"a": iter([9, 1, 5, 3]), "b": iter([9, 2, 2, 2])}

    def act(name: str) -> dict[str, float]:
        order.append(name)
        return {"cpu_s": float(next(times[name]))}

    measured = Run(3).interleaved({name: lambda name=name: act(name) for name in times})
    assert order == ["a", "b"] * 4
    assert measured.spread("a", "cpu_s") == Spread(3, 1, 5)
    assert measured.ratio("a", "b", "cpu_s") == Spread(1.5, 0.5, 2.5)
    assert measured.ratio("a", ["a", "b"], "cpu_s").max == 5 / 7


def test_a_process_does_not_count_its_parent_s_memory() -> None:
    ballast = bytearray(b"1") * (300 << 20)
    figures = process([sys.executable, "-S", "-c", "sum(range(10**6))"])
    assert len(ballast) > 0
    assert 5 < figures["peak_mb"] < 60
    assert 0.005 < figures["cpu_s"] < 3


def test_the_serial_share_is_amdahl_s() -> None:
    threads = [1, 4, 16, 64]
    assert serial_share(threads, [7 * (0.2 + 0.8 / p) for p in threads]) == pytest.approx(0.2)
    assert serial_share([1], [3.0]) == 0


def test_table_json_and_exit_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.json"
    words = f"mesh.exact --scenes menger-sponge --resolution 16 --runs 2 --json {path}".split()
    assert benchmarks.main(words) == 0
    assert "menger-sponge" in capsys.readouterr().out
    written = json.loads(path.read_text())
    assert written["machine"]["cores"] >= 1
    assert written["options"]["runs"] == 2
    assert set(written["rows"][0]["ratio"]) == {"median", "min", "max"}
    assert benchmarks.main(["mesh.exakt"]) == 2


def test_every_table_names_what_prints_it() -> None:
    """Above each table: a benchmark, a test, or that it was done by hand. Marks are those of benchmarks."""
    paragraphs = [part.strip() for part in re.split(r"\n{2,}", PAGE)]
    for k, paragraph in enumerate(paragraphs):
        if "\n| --- " in paragraph or "\n|---" in paragraph:
            above = paragraphs[k - 1]
            mark = re.match(r"<!-- ([\w.]+) -->", paragraph)
            if mark:
                section = PAGE[: PAGE.index(mark[0])].rsplit("\n## ", 1)[1]
                assert f"python -m tests.benchmarks {mark[1]}" in section
            else:
                assert re.search(r"`pytest tests/|[Bb]y hand|\| Command", above + paragraph), paragraph
    named = re.findall(r"python -m tests\.benchmarks ([a-z]+\.\w+)", PAGE)
    assert set(named) <= set(NAMES)
    assert set(re.findall(r"<!-- (\w+\.\w+) -->", PAGE)) <= set(NAMES)
