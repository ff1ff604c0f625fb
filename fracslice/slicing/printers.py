"""Resin printers and their screens, as published; printers.csv names the sources."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..common.files import read_table
from ..common.parameters import REQUIRED, Count, Label, Number, Vector, attribute, from_table, validate
from ..errors import SliceError


@dataclass(frozen=True)
class Printer:
    """A masked resin printer."""

    name: str = attribute(Label, REQUIRED, "name in commands")  # name in commands, and name in messages
    title: str = attribute(Label, REQUIRED, "name in messages")
    # pixels of the screen along x and y of the bed
    pixels: tuple[int, int] = attribute(
        Vector, REQUIRED, "pixels along x and y", sizes=(2,), least=1, most=65_535, whole=True
    )
    # size of the screen, mm
    screen: tuple[float, float] = attribute(
        Vector, REQUIRED, "size of the screen, mm", sizes=(2,), above=0, most=10_000
    )
    # maximum height of a print, mm
    height: float = attribute(Number, REQUIRED, "highest print, mm", above=0, most=10_000)
    mirror: bool = True  # the picture is mirrored along x
    portrait: bool = False  # rows of the picture run along x of the bed
    # extension of the files that it prints; "encrypted.ctb" for those that are not written
    file: str = attribute(Label, "", "extension of the files that it prints")
    version: int = attribute(Count, 1, "version of the format", most=65_536)  # version of the format
    # lift, mm, its speed and that of the way back, mm/min, and rest before exposure, s
    motion: tuple[float, float, float, float] = attribute(
        Vector, (5.0, 65.0, 150.0, 0.5), "mm, mm/min, mm/min and s", sizes=(4,), least=0, most=10_000
    )
    # names and values of the resin settings of a printer's own file
    settings: tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        validate(self, SliceError)

    @property
    def pixel(self) -> tuple[float, float]:
        """Width and height of a pixel, mm."""
        return self.screen[0] / self.pixels[0], self.screen[1] / self.pixels[1]

    @property
    def build_volume(self) -> tuple[float, float, float]:
        """Build volume (x, y, z), mm."""
        return *self.screen, self.height


class _Printers(Mapping[str, Printer]):
    """Printers of a table, validated when they are looked up: all take a thirtieth of a small job."""

    def __init__(self, path: Path) -> None:
        lines = path.read_text(encoding="utf-8").splitlines()
        rows = csv.DictReader(line for line in lines if not line.startswith("#"))
        self._rows = {row["name"]: row for row in rows}

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __contains__(self, name: object) -> bool:
        return name in self._rows

    def __getitem__(self, name: str) -> Printer:
        row = self._rows[name]
        lift, up, down, wait = (float(row[key]) for key in ("lift", "lift_speed", "retract_speed", "wait"))
        return Printer(
            name=name,
            title=row["title"],
            pixels=(int(row["pixels_x"]), int(row["pixels_y"])),
            screen=(float(row["width"]), float(row["depth"])),
            height=float(row["height"]),
            mirror=row["mirror"] == "1",
            portrait=row["portrait"] == "1",
            file=row["file"],
            version=int(row["version"]),
            motion=(lift, up, down, wait),
        )


PRINTERS = _Printers(Path(__file__).parent / "printers.csv")


def printer(name: str) -> Printer:
    """Look up a printer."""
    if name.lower().endswith(".toml"):
        return _own(Path(name))
    if name in PRINTERS:
        return PRINTERS[name]
    import difflib

    near = difflib.get_close_matches(name.lower().replace(" ", "-"), PRINTERS, 1, 0.4)
    raise SliceError(
        f"printer {name!r}: unknown; "
        + (f"did you mean {near[0]}?" if near else f"known: {', '.join(PRINTERS)}")
    )


def _own(path: Path) -> Printer:
    """Printer of a file."""
    values = read_table(path, SliceError)
    settings = values.pop("resin", {})
    if not isinstance(settings, dict) or not all(isinstance(values.get(k, True), bool) for k in FLAGS):
        raise SliceError(f"{path}: expected a table resin, and true or false for {' and '.join(FLAGS)}")
    named: dict[str, Any] = {"name": path.stem, "title": path.stem}
    named |= {key: tuple(value) if isinstance(value, list) else value for key, value in values.items()}
    own = tuple(settings.items())
    return from_table(Printer, str(path), named, SliceError, " or a table resin", settings=own)


FLAGS = "mirror", "portrait"
