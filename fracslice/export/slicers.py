"""Command lines of slicers for filament printers: PrusaSlicer, OrcaSlicer, Bambu Studio and CuraEngine.

Arguments as documented: PrusaSlicer and CuraEngine (CommandLine.cpp) by their sources, OrcaSlicer by
github.com/OrcaSlicer/OrcaSlicer/wiki (cli_actions, cli_misc), Bambu Studio by
github.com/bambulab/BambuStudio/wiki/Command-Line-Usage.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..common.files import check_target, read_text, temporary_folder
from ..errors import ExportError
from ..work import Work

Command = Callable[[str, Sequence[str], Path, Path], list[str]]
"""Command line from the program, the profiles, the model and the file to write."""

POLL = 0.2
"""Seconds between two checks for cancellation."""

SECONDS = 320 / 830_556
"""Time of PrusaSlicer 2.5 per triangle, measured on a Menger sponge; others are similar."""

GUARD = """
import os, signal, subprocess, sys, threading
child = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
def end():
    sys.stdin.read()
    os.killpg(0, signal.SIGKILL) if hasattr(os, "killpg") else child.kill()
threading.Thread(target=end, daemon=True).start()
status = child.wait()
os._exit(status if status >= 0 else 128 - status)
"""
"""Program that runs a command, and ends it with all that it started when the pipe from this process closes:
when the work is cancelled, and when this process is killed.
"""

_WARNING = re.compile(r"\b(warning|error)\b", re.IGNORECASE)
_LOG = re.compile(r"^\[[^]]*\]\s*\[[^]]*\]\s*\[(\w+)\]\s*")
"""Time, thread and severity before a message of PrusaSlicer."""


@dataclass(frozen=True)
class FilamentSlicer:
    """A slicer with a command line."""

    title: str  # name in messages
    programs: tuple[str, ...]  # names of the program
    model: str  # extensions of the file that it reads and of the one that it writes
    output: str
    command: Command  # makes its command line

    @property
    def program(self) -> str:
        """Path of the program."""
        for name in self.programs:
            if path := shutil.which(name):
                return path
        raise ExportError(
            f"{self.title} is not installed: no program {' or '.join(self.programs)} on the path"
        )

    def check(self, profiles: Sequence[str]) -> None:
        """Check that the program is installed and its profiles can be passed to it."""
        self.command(self.program, profiles, Path(self.model), Path(self.output))

    def slice(self, model: Path, profiles: Sequence[str], path: Path, work: Work) -> list[str]:
        """Slice a model."""
        program, target = self.program, check_target(path)
        with temporary_folder(target.parent) as folder:
            made = folder / target.name
            output = _run_program(self.command(program, profiles, model, made), work, self.title)
            if not made.exists():
                raise ExportError(f"{self.title} wrote no file: {_last(output)}")
            os.replace(made, target)
        return _warnings(output)


def _run_program(command: Sequence[str], work: Work, title: str) -> list[str]:
    """Run a program; return the lines that it prints."""
    guarded, pipe = [sys.executable, "-I", "-S", "-c", GUARD, *command], subprocess.PIPE
    with tempfile.TemporaryFile() as output:
        with subprocess.Popen(
            guarded, stdin=pipe, stdout=output, stderr=output, start_new_session=True
        ) as process:
            while True:
                try:
                    status = process.wait(POLL)
                    break
                except subprocess.TimeoutExpired:
                    work.check()
        output.seek(0)
        lines = output.read().decode(errors="replace").splitlines()
    if status:
        raise ExportError(f"{title} failed with status {status}: {_last(lines)}")
    return lines


def _last(lines: Sequence[str]) -> str:
    """Last line that is not empty."""
    return next((line.strip() for line in reversed(lines) if line.strip()), "it says nothing")


def _warnings(lines: Sequence[str]) -> list[str]:
    """Lines that warn, without time and thread, each once."""
    return list(dict.fromkeys(_LOG.sub(r"\1: ", line.strip()) for line in lines if _WARNING.search(line)))


def _prusa(program: str, profiles: Sequence[str], model: Path, path: Path) -> list[str]:
    loads = [text for profile in profiles for text in ("--load", profile)]
    return [program, "--export-gcode", *loads, "--output", str(path), str(model)]


def _orca(program: str, profiles: Sequence[str], model: Path, path: Path) -> list[str]:
    """Printer and process are one list, filaments another; result.json goes to the output folder, too."""
    filaments = [profile for profile in profiles if _kind(profile) == "filament"]
    settings = [profile for profile in profiles if profile not in filaments]
    lists = ("--load-settings", settings), ("--load-filaments", filaments)
    loads = [text for option, files in lists if files for text in (option, ";".join(files))]
    output = ["--outputdir", str(path.parent), "--export-3mf", path.name]
    return [program, *loads, "--arrange", "1", "--slice", "0", *output, str(model)]


def _kind(profile: str) -> object:
    """Type of a profile of OrcaSlicer or Bambu Studio: machine, process or filament."""
    try:
        values = json.loads(read_text(Path(profile), ExportError))
    except (ValueError, RecursionError) as error:
        raise ExportError(f"{profile}: expected a .json profile: {error}") from None
    kind = values.get("type") if isinstance(values, dict) else None
    if kind not in ("machine", "process", "filament"):
        raise ExportError(f"{profile}: type {kind!r}: expected machine, process or filament")
    return kind


def _cura(program: str, profiles: Sequence[str], model: Path, path: Path) -> list[str]:
    definitions = [text for profile in profiles for text in ("-j", profile)]
    return [program, "slice", *definitions, "-o", str(path), "-l", str(model)]


SLICERS = {
    "prusa": FilamentSlicer("PrusaSlicer", ("prusa-slicer", "PrusaSlicer"), ".3mf", ".gcode", _prusa),
    "orca": FilamentSlicer("OrcaSlicer", ("orca-slicer", "OrcaSlicer"), ".3mf", ".3mf", _orca),
    "bambu": FilamentSlicer("Bambu Studio", ("bambu-studio", "BambuStudio"), ".3mf", ".3mf", _orca),
    "cura": FilamentSlicer("CuraEngine", ("CuraEngine", "curaengine"), ".stl", ".gcode", _cura),
}
"""Slicers by name in commands."""
