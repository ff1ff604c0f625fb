"""Checks of layers in ranges: islands, cups, traps, bodies and thin walls over the borders of ranges."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fracslice.cli.main import run as command

from fracslice.checks.layer_checks import check_layers, findings_of
from fracslice.cluster import ResultFolder, Shard
from fracslice.errors import SharedError
from fracslice.export.slice_run import range_size
from fracslice.formulas import box, cylinder, sphere
from fracslice.jobs.slice_checks import CheckTask, check_run
from fracslice.jobs.slices import SliceRecipe
from fracslice.scene import scene
from fracslice.scene.model import to_xml
from fracslice.slicing import SliceJob
from fracslice.work import Work

pytestmark = pytest.mark.once

pytest.importorskip("fsspec")
CAVITY = sphere(radius=0.3).translate((-0.4, 0.0, 0.0))
WELL = cylinder(radius=0.2, height=1.0).translate((0.4, 0.0, 0.4))
THING = scene(
    (box(size=(2.0, 1.0, 1.2)) - CAVITY - WELL) | sphere(radius=0.2).translate((1.4, 0.0, 0.0)), size="20mm"
)
"""A sealed cavity and a well that cross borders of ranges, and a body that begins in the middle."""
RECIPE = SliceRecipe(to_xml(THING), "thing", SliceJob(size=20.0, layer=0.25, pixel=(0.2, 0.2)), "cli")


def test_components_are_joined_over_the_borders_of_ranges(tmp_path: Path) -> None:
    shard = Shard(ResultFolder(str(tmp_path / "pieces")), 1, 1)
    run = RECIPE.run(Work(1, cluster=shard))
    assert range_size(run) == 8 < run.layers // 3
    shared, alone = check_run(run), check_layers(run.stack, work=Work(1))
    assert shared.as_dict() == alone.as_dict()
    hollow = [*alone.cups, *alone.traps, *alone.cavities, *alone.bodies]
    assert sum(last // 8 > first // 8 for first, last in (of.layers for of in hollow)) >= 3
    assert alone.cavities and alone.islands and (alone.cups or alone.traps) and alone.walls
    apart: Any = findings_of(run.slicer_with(Work(1)), range(8, 16))
    assert len(next(apart).solid) > 0, "a range by itself would begin with an island"


def test_another_shard_checks_its_ranges(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pieces, made = ResultFolder(str(tmp_path / "pieces")), list[str]()
    make = CheckTask.make
    monkeypatch.setattr(CheckTask, "make", lambda of, work: (made.append(of.name), make(of, work))[1])
    with pytest.raises(SharedError, match="shard 1 writes the report"):
        check_run(RECIPE.run(Work(1, cluster=Shard(pieces, 2, 2))))
    second = list(made)
    check_run(RECIPE.run(Work(1, cluster=Shard(pieces, 1, 2, patience=600))))
    assert second and len(made) == len(set(made)) == -(-RECIPE.run(Work(1)).layers // 8)


def test_a_page_of_a_shared_slice_is_that_of_one_machine(tmp_path: Path) -> None:
    (tmp_path / "thing.xml").write_text(to_xml(THING))
    for name, more in (("one", []), ("two", ["--shard", "1/1"])):
        (tmp_path / name).mkdir()
        out, page = tmp_path / name / "a.cli", tmp_path / name / "a.html"
        given = ["slice", str(tmp_path / "thing.xml"), "-o", str(out), "--html", str(page), "--quiet", *more]
        assert command([*given, "--layer", "0.4mm", "--pixel", "0.2mm"]) == 0
    pages = [(tmp_path / name / "a.html").read_text().replace(f"/{name}/", "/") for name in ("one", "two")]
    assert pages[0] == pages[1]


def test_layers_are_checked_by_shards(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thing.xml").write_text(to_xml(THING))
    given = [
        "check",
        str(tmp_path / "thing.xml"),
        "--layer",
        "0.4mm",
        "--pixel",
        "0.2mm",
        "--json",
        "--quiet",
    ]
    status = command(given)
    alone = capsys.readouterr().out
    assert command([*given, "--shard", "2/2"]) == 0
    assert "shard 1 writes the report" in capsys.readouterr().err
    assert any((tmp_path / ".fracslice-pieces").glob("*/checked-*"))
    assert command([*given, "--shard", "1/2"]) == status
    assert capsys.readouterr().out == alone
    assert command([*given[:2], "--shard", "1/2"]) == 2
    assert "only with --layer" in capsys.readouterr().err
