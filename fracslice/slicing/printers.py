"""Resin printers and their screens, as published, with exposure and motion; printers.csv names the
sources.
"""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import read_table, read_text
from ..common.parameters import REQUIRED, Count, Label, Number, Vector, attribute, from_table, validate
from ..errors import ExportError, SliceError


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


@dataclass(frozen=True)
class Resin:
    """Settings of a resin on a printer."""

    # exposure of a layer, and of a bottom layer, s
    exposure: float = attribute(Number, REQUIRED, "seconds of each layer", above=0, most=1000)
    bottom_exposure: float = attribute(Number, REQUIRED, "seconds of each bottom layer", above=0, most=1000)
    name: str = attribute(Label, "unknown", "name of the resin")  # name of the resin
    # number of layers with the bottom exposure
    bottom_layers: int = attribute(Count, 5, "bottom layers", most=200)
    # number of layers above them over which the exposure falls linearly
    transition_layers: int = attribute(Count, 5, "transition layers", most=200)
    # distance by which the platform rises after a layer, mm
    lift: float = attribute(Number, 5.0, "mm after each layer", above=0, most=100)
    lift_speed: float = attribute(Number, 65.0, "mm/min", above=0, most=10_000)  # speeds up and down, mm/min
    retract_speed: float = attribute(Number, 150.0, "mm/min", above=0, most=10_000)
    # the first two of the layers with the least area; those with more have more of the former and less of the
    # latter, down to the largest; 0 for the same of all
    small_lift: float = attribute(Number, 0.0, "mm after the smallest layer", least=0, most=100)
    small_lift_speed: float = attribute(Number, 0.0, "mm/min", least=0, most=10_000)
    # second stage of the lift, mm, and its speed, mm/min; none by default
    lift_2: float = attribute(Number, 0.0, "mm after each layer, behind lift", least=0, most=100)
    lift_speed_2: float = attribute(Number, 180.0, "mm/min", above=0, most=10_000)
    # last part of the way back, mm, and its speed, mm/min; none by default
    retract_2: float = attribute(Number, 0.0, "mm before each layer, the last of them", least=0, most=100)
    retract_speed_2: float = attribute(Number, 60.0, "mm/min", above=0, most=10_000)
    # rest before a layer is exposed, s; after it, before the lift; and after the lift
    wait: float = attribute(Number, 0.5, "seconds before each layer", least=0, most=1000)
    wait_after: float = attribute(Number, 0.0, "seconds after each layer", least=0, most=1000)
    wait_lifted: float = attribute(Number, 0.0, "seconds after the lift", least=0, most=1000)
    # working curve (Jacobs 1992): depth at which 1/e of the light is left, mm, and the exposure at which
    # resin begins to cure, s; 0 for what was not measured
    penetration: float = attribute(
        Number, 0.0, "mm, depth at which 1/e of the light is left", least=0, most=10
    )
    critical: float = attribute(Number, 0.0, "seconds until resin begins to cure", least=0, most=1000)
    density: float = attribute(Number, 1.1, "g/ml", above=0, most=100)  # g/ml
    price: float = attribute(Number, 0.0, "of a litre", least=0)  # price of a litre

    def __post_init__(self) -> None:
        validate(self, ExportError)
        least = (min(self.small_lift, self.lift) or self.lift) + self.lift_2
        if self.retract_2 > least:
            raise ExportError(
                f"retract_2 = {self.retract_2:g}: expected at most the whole lift, {least:g} mm"
            )
        if self.small_lift > self.lift:
            raise ExportError(f"small_lift = {self.small_lift:g}: expected at most lift, {self.lift:g} mm")
        if 0 < self.small_lift_speed < self.lift_speed:
            slowest = f"at least lift_speed, {self.lift_speed:g} mm/min"
            raise ExportError(f"small_lift_speed = {self.small_lift_speed:g}: expected {slowest}")

    def overexposure(self, layers: int) -> tuple[float, ...]:
        """Share that the first layers have of what bottom layers are exposed longer than others, 1 to 0."""
        first = min(self.bottom_layers + self.transition_layers, layers)
        above = np.arange(first) - self.bottom_layers + 1
        return tuple((1 - np.clip(above / (self.transition_layers + 1), 0, 1)).tolist())

    @property
    def retract(self) -> float:
        """Way back before its last part, mm."""
        return self.whole_lift - self.retract_2

    @property
    def whole_lift(self) -> float:
        """Both stages of the lift, mm."""
        return self.lift + self.lift_2

    @property
    def rest(self) -> float:
        """All rests of a layer, s: what stands before a layer in formats without the others."""
        return self.wait + self.wait_after + self.wait_lifted

    def cured_depth(self, exposure: float) -> float | None:
        """Depth to which an exposure, s, cures, mm; None if the working curve is not known."""
        if not self.penetration or not self.critical:
            return None
        return self.penetration * math.log(exposure / self.critical)

    def excess(self, layer: float) -> float | None:
        """Distance by which faces that look down are cured too deep, mm; None as for `cured_depth`.

        It is that of a face below many layers, `layer` mm high, whose doses add up.
        """
        depth = self.cured_depth(self.exposure)
        return depth and depth - self.penetration * math.log(math.expm1(layer / self.penetration))

    def check_depth(self, layer: float) -> None:
        """Raise `ExportError` for an exposure that does not reach through a layer, mm."""
        depth = self.cured_depth(self.exposure)
        if depth is not None and depth < layer:
            least = self.critical * math.exp(layer / self.penetration)
            raise ExportError(
                f"an exposure of {self.exposure:g} s cures {max(depth, 0):.2g} mm, a layer is {layer:g} mm: "
                f"expected at least {least:.3g} s"
            )

    def exposures(self, layers: int) -> NDArray[np.float64]:
        """Exposure of each layer.

        Returns float64 [layers].
        """
        above = np.arange(layers) - self.bottom_layers + 1
        share = np.clip(above / (self.transition_layers + 1), 0, 1)
        return self.bottom_exposure + share * (self.exposure - self.bottom_exposure)

    def of_layers(self, areas: NDArray[np.float64]) -> list[Resin]:
        """Settings of each layer, by its area and that of the one before, mm2, float64 [layers].

        Larger layers hold on to the film: they are lifted farther and more slowly (UVtools, "Dynamic lifts",
        by the full range of areas). Bottom layers are lifted as the largest.
        """
        normal = areas[self.bottom_layers :]
        if not (self.small_lift or self.small_lift_speed) or not len(normal):
            return [self] * len(areas)
        least, most = float(normal.min()), float(normal.max())
        share = np.maximum(areas, np.concatenate([areas[:1], areas[:-1]]))
        share = np.clip((share - least) / max(most - least, 1e-9), 0, 1)
        share[: self.bottom_layers] = 1
        lift, speed = self.small_lift or self.lift, self.small_lift_speed or self.lift_speed
        ways = np.round(lift + share * (self.lift - lift), 1).tolist()
        speeds = np.round(speed + share * (self.lift_speed - speed)).tolist()
        known = {
            both: replace(self, lift=both[0], lift_speed=both[1])
            for both in set(zip(ways, speeds, strict=True))
        }
        return [known[both] for both in zip(ways, speeds, strict=True)]

    @property
    def motion(self) -> float:
        """Duration of the motion after a layer, s; 0 for that of a vat that tilts by itself."""
        ways = (
            (self.lift, self.lift_speed),
            (self.lift_2, self.lift_speed_2),
            (self.retract, self.retract_speed),
            (self.retract_2, self.retract_speed_2),
        )
        return sum(60 * way / speed for way, speed in ways) if self.lift > TILT else 0.0

    def seconds(self, areas: NDArray[np.float64]) -> float:
        """Duration of a print of layers with these areas, mm2, float64 [layers]."""
        settings = Counter(self.of_layers(areas))
        moved = sum(count * (own.motion + own.rest) for own, count in settings.items())
        return float(self.exposures(len(areas)).sum() + moved)


def resin(name: str, printer: Printer | None, layer: float) -> Resin:
    """Look up a resin in the table, or read it from a file.

    `layer` in mm.
    """
    ending = Path(name).suffix.lower()
    if ending == ".ini":
        return _of_ini(Path(name))
    if ending == ".toml":
        return of_table(name, read_table(Path(name), ExportError))
    known = _table().get(printer.name if printer else "", {})
    if name not in known:
        import difflib

        near = difflib.get_close_matches(name, known, 1, 0.3)
        hint = f"did you mean {near[0]!r}?" if near else "expected a .toml or .ini file, or --exposure"
        title = printer.title if printer else "no printer"
        raise ExportError(f"resin {name!r}: unknown for {title}; {hint}")
    heights = known[name]
    exposure, bottom = heights[min(heights, key=lambda height: abs(height - layer))]
    return moving(Resin(exposure, bottom, name, bottom_layers=1, transition_layers=10), printer)


def default_resin(printer: Printer, layer: float) -> Resin | None:
    """Settings of the printer's own resin.

    `layer` in mm.
    """
    if printer.settings:
        return moving(of_table(printer.name, dict(printer.settings)), printer, printer.settings)
    if MAKERS in _table().get(printer.name, {}):
        return resin(MAKERS, printer, layer)
    return moving(START, printer) if printer.name in PRINTERS else None


def resin_names(printer: Printer | None) -> list[str]:
    """Names of the resins of the table for a printer, or for any."""
    tables = _table().values() if printer is None else [_table().get(printer.name, {})]
    return sorted({name for table in tables for name in table})


def moving(resin: Resin, printer: Printer | None, but: Collection[tuple[str, Any]] = ()) -> Resin:
    """Take the motion of a printer."""
    if printer is None:
        return resin
    motion: dict[str, Any] = dict(
        zip(("lift", "lift_speed", "retract_speed", "wait"), printer.motion, strict=True)
    )
    return replace(resin, **motion | dict(but))


def of_table(where: str, values: Mapping[str, Any]) -> Resin:
    """Make settings from the keys and values of a file."""
    return from_table(Resin, where, {"name": Path(where).stem, **values}, ExportError)


def _of_ini(path: Path) -> Resin:
    """Read a resin profile of PrusaSlicer: its keys, and those in its notes."""
    lines = read_text(path, ExportError, "replace").splitlines()
    pairs = (line.partition("=") for line in lines if "=" in line and not line.startswith("#"))
    values = {key.strip(): value.strip() for key, _, value in pairs}
    notes = values.get("material_notes", "").replace("\\n", "\n").replace("\\r", "\n")
    values |= dict(re.findall(r"^\s*(\w+)\s*=\s*(\S+)\s*$", notes, re.M))
    settings: dict[str, Any] = {}
    for key, (name, times) in INI.items():
        if key in values:
            try:
                settings[name] = float(values[key]) * times
            except ValueError:
                raise ExportError(f"{path}: {key} = {values[key]}: expected a number") from None
    if (layers := settings.get("transition_layers", 0.5)).is_integer():
        settings["transition_layers"] = int(layers)
    return of_table(str(path), settings)


@cache
def _table() -> dict[str, dict[str, dict[float, tuple[float, float]]]]:
    """Exposures by printer, resin and layer height."""
    table: dict[str, dict[str, dict[float, tuple[float, float]]]] = {}
    lines = (Path(__file__).parent / "resins.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        heights = table.setdefault(row["printer"], {}).setdefault(row["resin"], {})
        heights[float(row["layer_mm"])] = float(row["exposure_s"]), float(row["bottom_s"])
    return table


TILT = 0.1
"""Lift below which the vat tilts, mm: its firmware alone knows how long that takes."""

START = Resin(3.0, 30.0, bottom_layers=4, transition_layers=0)
"""Where to start with a resin that no table has: the defaults of UVtools (FileFormat.cs)."""

MAKERS = "Prusa Orange Tough"
"""Resin that is the default of its printers."""

INI = {
    "exposure_time": ("exposure", 1.0),
    "initial_exposure_time": ("bottom_exposure", 1.0),
    "faded_layers": ("transition_layers", 1.0),
    "material_density": ("density", 1.0),
    "sla_primary_lift_distance": ("lift", 1.0),
    "sla_primary_lift_speed": ("lift_speed", 1.0),
    "sla_primary_retract_speed": ("retract_speed", 1.0),
    "sla_wait_after_retract": ("wait", 1.0),
    "LIFT_DISTANCE": ("lift", 1.0),
    "LIFT_SPEED": ("lift_speed", 60.0),
    "RETRACT_SPEED": ("retract_speed", 60.0),
    "DELAY_BEFORE_EXPOSURE": ("wait", 1.0),
}
"""Keys of PrusaSlicer's profiles, and of the notes that its .pwmx writer reads (mm/s), and their units."""
