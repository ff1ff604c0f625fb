"""Exposure and motion of resin prints."""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import read_table, read_text
from ..common.parameters import REQUIRED, Count, Label, Number, attribute, from_table, validate
from ..errors import ExportError
from ..slicing.printers import PRINTERS, Printer


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
    # rest before a layer is exposed, s
    wait: float = attribute(Number, 0.5, "seconds before each layer", least=0, most=1000)
    density: float = attribute(Number, 1.1, "g/ml", above=0, most=100)  # g/ml
    price: float = attribute(Number, 0.0, "of a litre", least=0)  # price of a litre

    def __post_init__(self) -> None:
        validate(self, ExportError)

    def exposures(self, layers: int) -> NDArray[np.float64]:
        """Exposure of each layer.

        Returns float64 [layers].
        """
        above = np.arange(layers) - self.bottom_layers + 1
        share = np.clip(above / (self.transition_layers + 1), 0, 1)
        return self.bottom_exposure + share * (self.exposure - self.bottom_exposure)

    def seconds(self, layers: int) -> float:
        """Duration of a print, without the motion of a vat that tilts by itself."""
        motion = 60 * self.lift * (1 / self.lift_speed + 1 / self.retract_speed) if self.lift > TILT else 0.0
        return float(self.exposures(layers).sum() + layers * (motion + self.wait))


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
