"""Profiles of printers that slicers ship, by the slicers' own names: found where a slicer is installed, with
what they inherit, and written as files that its command line takes.

PrusaSlicer has a bundle of sections for each vendor (PresetBundle.cpp), OrcaSlicer and Bambu Studio a file
for each profile. The process and the filament are those that the printer names as its defaults.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from ..common.files import open_regular
from ..common.messages import hint
from ..errors import ExportError

Settings = dict[str, Any]

DEEPEST = 32
"""Most profiles that inherit from each other."""
OWN = {"inherits", "renamed_from", "compatible_printers_condition", "compatible_prints_condition"}
"""What a profile does not hand down, and what its use does not need."""
LIBRARY = "OrcaFilamentLibrary"
"""Vendor whose filaments others inherit."""


class Shipped(NamedTuple):
    """Profiles of an installed slicer."""

    title: str  # name of the slicer
    printers: Mapping[str, Callable[[Path], list[Path]]]  # writes the profiles of a printer to a folder

    def write(self, name: str, folder: Path) -> list[Path]:
        """Write the profiles of a printer. Raises ExportError for an unknown one."""
        if name in self.printers:
            return self.printers[name](folder)
        if not self.printers:
            raise ExportError(f"printer {name!r}: {self.title} has no profiles here; expected --profile")
        near = f"{hint(name, list(self.printers))}; --printer list shows {len(self.printers)}"
        raise ExportError(f"printer {name!r}: no such printer of {self.title}; {near}")


def shipped(title: str, names: Sequence[str], program: str) -> Shipped:
    """Profiles of a slicer.

    `names`: of its folders; `program`: path of the program.
    """
    found: dict[str, Callable[[Path], list[Path]]] = {}
    for folder in _folders(names, Path(program)):
        for bundle in sorted(folder.glob("*.ini")):
            found |= {name: _writer(bundle, name) for name in _printers(bundle) if name not in found}
        for file in sorted(folder.glob("*/machine/**/*.json")):
            if file.stem not in found and not file.stem.startswith("fdm_"):
                found[file.stem] = _tree_writer(folder, file)
    return Shipped(title, found)


def _folders(names: Sequence[str], program: Path) -> Iterator[Path]:
    """Folders in which a slicer may have profiles: beside its program, of the system, and of the user."""
    home, config = Path.home(), Path(os.environ.get("XDG_CONFIG_HOME", Path.home() / ".config"))
    start = program.resolve().parent
    near = [start / "resources", start.parent / "resources", start.parent / "Resources"]
    near += [start.parent / "share" / name for name in names] + [Path("/usr/share") / name for name in names]
    yield from (folder / "profiles" for folder in near if (folder / "profiles").is_dir())
    users = [config, home / "Library" / "Application Support" if sys.platform == "darwin" else config]
    for base in dict.fromkeys(users):
        for folder in (base / name / end for name in names for end in ("vendor", "system")):
            if folder.is_dir():
                yield folder


@lru_cache(maxsize=16)
def _bundle(path: Path) -> dict[str, Settings]:
    """Sections of a bundle, by kind and name."""
    sections: dict[str, Settings] = {}
    own: Settings = {}
    for line in _text(path).splitlines():
        if line.startswith("[") and line.rstrip().endswith("]"):
            own = sections.setdefault(line.strip()[1:-1], {})
        elif "=" in line and not line.startswith(("#", ";")):
            key, _, value = line.partition("=")
            own[key.strip()] = value.strip()
    return sections


def _text(path: Path) -> str:
    """Text of a file of a slicer."""
    try:
        with open_regular(path) as file:
            return file.read().decode("utf-8", "replace")
    except OSError as error:
        raise ExportError(f"{path}: {error.strerror or error}") from None


def _printers(bundle: Path) -> Iterator[str]:
    """Names of the printers of a bundle for filament."""
    for section, own in _bundle(bundle).items():
        kind, _, name = section.partition(":")
        if kind == "printer" and not name.startswith("*") and own.get("printer_technology") != "SLA":
            yield name


def _inherited(sections: Mapping[str, Settings], kind: str, name: str, depth: int = 0) -> Settings:
    """Settings of a section with those that it inherits."""
    if depth > DEEPEST or (own := sections.get(f"{kind}:{name}")) is None:
        raise ExportError(f"{kind} {name!r}: expected a profile of the slicer that is whole")
    result: Settings = {}
    for parent in filter(None, (word.strip() for word in own.get("inherits", "").split(";"))):
        result |= _inherited(sections, kind, parent, depth + 1)
    return result | {key: value for key, value in own.items() if key not in OWN}


def _writer(bundle: Path, name: str) -> Callable[[Path], list[Path]]:
    """Writes a printer of a bundle, its process and its filament as one file."""

    def write(folder: Path) -> list[Path]:
        sections = _bundle(bundle)
        printer = _inherited(sections, "printer", name)
        if printer.get("printer_technology") == "SLA":
            raise ExportError(f"printer {name!r}: expected one for filament")
        whole: Settings = {}
        for kind in ("print", "filament"):
            default = printer.get(f"default_{kind}_profile", "").split(";")[0].strip().strip('"')
            if f"{kind}:{default}" in sections:
                whole |= _inherited(sections, kind, default) | {f"{kind}_settings_id": default}
        whole |= printer | {"printer_settings_id": name}
        file = folder / "printer.ini"
        file.write_text("".join(f"{key} = {value}\n" for key, value in whole.items()), "utf-8")
        return [file]

    return write


def _profile(folder: Path, vendor: str, kind: str, name: str, depth: int = 0) -> Settings:
    """Settings of a profile in a file of its own, with those that it inherits."""
    tried = [*folder.glob(f"{vendor}/{kind}/**/*.json"), *folder.glob(f"{LIBRARY}/{kind}/**/*.json")]
    file = next((one for one in tried if one.stem == name), None)
    if file is None or depth > DEEPEST:
        raise ExportError(f"{kind} {name!r}: expected a profile of the slicer that is whole")
    own = _json(file)
    parent = own.pop("inherits", "")
    return (_profile(folder, vendor, kind, str(parent), depth + 1) if parent else {}) | own


def _json(file: Path) -> Settings:
    """Object of a JSON file."""
    try:
        values = json.loads(_text(file))
    except (ValueError, RecursionError) as error:
        raise ExportError(f"{file}: expected a .json profile: {error}") from None
    if not isinstance(values, dict):
        raise ExportError(f"{file}: expected a .json profile, an object")
    return values


def _tree_writer(folder: Path, machine: Path) -> Callable[[Path], list[Path]]:
    """Writes a printer of a folder of vendors, its process and its filament as a file each."""

    def write(target: Path) -> list[Path]:
        vendor = machine.relative_to(folder).parts[0]
        name = machine.stem
        if _json(machine).get("type") == "machine_model":
            name = f"{name} 0.4 nozzle"
        printer = _profile(folder, vendor, "machine", name)
        profiles = {"machine": printer}
        for kind, key in (("process", "default_print_profile"), ("filament", "default_filament_profile")):
            default = printer.get(key, "")
            default = default[0] if isinstance(default, list) and default else default
            if default:
                profiles[kind] = _profile(folder, vendor, kind, str(default))
        files = []
        for kind, values in profiles.items():
            files.append(target / f"{kind}.json")
            files[-1].write_text(json.dumps(values | {"type": kind}, indent=1), "utf-8")
        return files

    return write
