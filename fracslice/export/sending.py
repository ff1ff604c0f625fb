"""What prints a file: uploads to printers (PrusaLink, SDCP 3 of Elegoo and ChiTu boards), and commands of
slicers (PrusaSlicer, OrcaSlicer, Bambu Studio, CuraEngine).

A file is only stored: nothing starts a print. PrusaLink is described at
github.com/prusa3d/Prusa-Link-Web (spec/openapi.yaml), SDCP at
github.com/cbd-tech/SDCP-Smart-Device-Control-Protocol-V3.0.0.

Arguments as documented: PrusaSlicer and CuraEngine (CommandLine.cpp) by their sources, OrcaSlicer by
github.com/OrcaSlicer/OrcaSlicer/wiki (cli_actions, cli_misc), Bambu Studio by
github.com/bambulab/BambuStudio/wiki/Command-Line-Usage.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import uuid
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from http.client import HTTPConnection, HTTPException
from io import BufferedReader
from pathlib import Path
from typing import IO, NamedTuple
from urllib.parse import quote, urlsplit

from ..common.files import check_target, read_text, reporting_errors, temporary_folder
from ..common.parameters import printable
from ..errors import ExportError
from ..work import Work
from .slicer_profiles import Shipped, shipped

PACKET = 1 << 20
"""Bytes of a packet of SDCP."""

TIMEOUT = 30.0
"""Seconds without a byte after which a printer counts as unreachable."""
PATIENCE, LONGEST = 120.0, 1 << 20
"""Most seconds that a packet and its answer take, and most bytes of an answer."""

PORTS = {"prusalink": 80, "sdcp": 3030}
STORAGES = {"prusalink": ("", "/", "/usb", "/local"), "sdcp": ("", "/")}
"""Paths of addresses: the storages of PrusaLink, of which printers have one or both."""
KEY, KEY_FILE = "FRACSLICE_KEY", "FRACSLICE_KEY_FILE"
"""Environment variables: the key of PrusaLink, or the name of a file that holds it."""


def printer_address(text: str) -> tuple[str, str, int, str]:
    """Parse the address of a printer."""
    try:
        url = urlsplit(text)
        host, port = url.hostname, url.port
        (host or "").encode("idna")
    except ValueError:
        host, port = None, None
    if not host or url.path not in STORAGES.get(url.scheme, ()) or url.username:
        raise ExportError(f"{text}: expected prusalink://HOST, prusalink://HOST/local or sdcp://HOST")
    if url.scheme == "prusalink":
        _key()
    return url.scheme, host, port or PORTS[url.scheme], url.path.strip("/") or "usb"


def send(path: str | Path, address: str, work: Work) -> str:
    """Upload a file to a printer."""
    protocol, host, port, storage = printer_address(address)
    upload = partial(_prusalink, storage) if protocol == "prusalink" else _sdcp
    with reporting_errors(Path(path)), open(path, "rb") as file:
        connection = _Connection(host, port)
        try:
            with connection.watched(work):
                upload(connection, Path(path).name, file, os.fstat(file.fileno()).st_size, work)
        except (OSError, HTTPException) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise ExportError(f"{address}: {printable(reason[:200])}") from None
        except ExportError as error:
            raise ExportError(f"{address}: {error}") from None
        finally:
            connection.close()
    return f"{Path(path).name} is on {host}"


class _Connection(HTTPConnection):
    """A connection that ends when a packet and its answer take too long, or the job is cancelled.

    A limit of the socket is for each byte alone, and a signal does not end a wait for the next one.
    """

    _end, _late = 0.0, False
    _socket: socket.socket | None = None

    def connect(self) -> None:
        """Connect by a socket that is watched while it waits; a response may take it over later."""
        for family, kind, protocol, _, place in socket.getaddrinfo(
            self.host, self.port, 0, socket.SOCK_STREAM
        ):
            self._socket = self.sock = socket.socket(family, kind, protocol)
            self.sock.settimeout(TIMEOUT)
            try:
                self.sock.connect(place)
                self.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return
            except OSError as error:
                failure = error
                self.close()
        raise failure

    @contextmanager
    def watched(self, work: Work) -> Iterator[None]:
        """Watch the time and the cancellation of what is done within."""
        done = threading.Event()
        self.renew()
        watch = threading.Thread(target=self._watch, args=(work, done), daemon=True)
        watch.start()
        try:
            yield
        except (OSError, HTTPException, ExportError):
            if not self._late:
                raise
        finally:
            done.set()
            watch.join()
        if self._late:
            work.check()
            raise ExportError(f"no complete answer within {PATIENCE:g} s")

    def renew(self) -> None:
        """Begin the time of the next packet."""
        self._end = time.monotonic() + PATIENCE

    def answer(self) -> tuple[int, bytes]:
        """Status and contents of the response."""
        response = self.getresponse()
        contents = response.read(LONGEST + 1)
        if len(contents) > LONGEST:
            raise ExportError(f"the printer's answer is longer than {LONGEST} bytes")
        return response.status, contents

    def _watch(self, work: Work, done: threading.Event) -> None:
        while not done.wait(0.05):
            self._late |= work.cancel.is_set() or time.monotonic() > self._end
            if self._late and self._socket is not None:
                with suppress(OSError):  # not connected any more
                    self._socket.shutdown(socket.SHUT_RDWR)


def _key() -> str:
    """Key of PrusaLink."""
    key, name = os.environ.get(KEY), os.environ.get(KEY_FILE)
    if not key and not name:
        raise ExportError(
            f"PrusaLink needs a key: expected it in {KEY}, or the name of a file with it in {KEY_FILE}"
        )
    key = key or read_text(Path(str(name)), ExportError).strip()
    if not (key.isascii() and key.isprintable()):
        raise ExportError(f"the key of PrusaLink, in {KEY} or {KEY_FILE}: expected ASCII in one line")
    return key


def _packets(connection: _Connection, file: BufferedReader, size: int, work: Work) -> Iterator[bytes]:
    """Contents of a file in packets."""
    sent = 0
    while packet := file.read(PACKET):
        work.check()
        connection.renew()
        yield packet
        sent += len(packet)
        work.progress("sending", sent / size)


def _prusalink(
    storage: str, connection: _Connection, name: str, file: BufferedReader, size: int, work: Work
) -> None:
    """Store a file on a printer with PrusaLink; an existing one stays."""
    headers = {
        "X-Api-Key": _key(),
        "Content-Type": "application/octet-stream",
        "Content-Length": str(size),
        "Overwrite": "?0",
        "Print-After-Upload": "?0",
    }
    url = f"/api/v1/files/{storage}/{quote(name)}"
    connection.request("PUT", url, _packets(connection, file, size, work), headers)
    status, _ = connection.answer()
    if status in (401, 403):
        raise ExportError("the printer refuses the key")
    if status == 404:
        raise ExportError(f"the printer has no storage {storage}; expected another, such as /local or /usb")
    if status == 409:
        raise ExportError(f"the printer has a file {name}, or is busy")
    if status not in (200, 201):
        raise ExportError(f"the printer refuses the file with status {status}")


def _sdcp(connection: _Connection, name: str, file: BufferedReader, size: int, work: Work) -> None:
    """Store a file on a printer with SDCP, packet by packet."""
    digest = hashlib.file_digest(file, "md5").hexdigest()
    file.seek(0)
    common = {"S-File-MD5": digest, "Check": "1", "Uuid": uuid.uuid4().hex, "TotalSize": str(size)}
    offset = 0
    for packet in _packets(connection, file, size, work):
        body, kind = _form({**common, "Offset": str(offset)}, name, packet)
        connection.request("POST", "/uploadFile/upload", body, {"Content-Type": kind})
        status, text = connection.answer()
        try:
            done = json.loads(text)
        except (ValueError, RecursionError):
            done = {}
        if status != 200 or not isinstance(done, dict) or not done.get("success"):
            raise ExportError(f"the printer refuses the file at byte {offset}: {_reason(done)}")
        offset += len(packet)


def _reason(answer: object) -> str:
    """Message of an answer of SDCP."""
    messages = answer.get("messages") if isinstance(answer, dict) else None
    first = messages[0] if isinstance(messages, list) and messages else {}
    return printable(str(first.get("message", "no reason"))[:200]) if isinstance(first, dict) else "no reason"


def _form(fields: dict[str, str], name: str, packet: bytes) -> tuple[bytes, str]:
    """Multipart form with a file, and its content type (RFC 7578)."""
    boundary = uuid.uuid4().hex
    begin = f"--{boundary}\r\nContent-Disposition: form-data; name="
    head = "".join(f'{begin}"{key}"\r\n\r\n{value}\r\n' for key, value in fields.items())
    safe = name.replace('"', "%22")
    head += f'{begin}"File"; filename="{safe}"\r\nContent-Type: application/octet-stream\r\n\r\n'
    body = head.encode() + packet + f"\r\n--{boundary}--\r\n".encode()
    return body, f"multipart/form-data; boundary={boundary}"


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
_SETTING = re.compile(r"""[;\s,{-]*([\w.]+\s*=|["'][\w. ]+["']\s*[=:])""")
"""A setting, such as error_limit = 3 or "error": 3."""
LONGEST_LINE = 300
"""Most characters of a line that is passed on."""
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
    folders: tuple[str, ...] = ()  # names of folders in which its profiles may be

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

    def shipped(self) -> Shipped:
        """Profiles of the printers that it knows."""
        return shipped(self.title, self.folders, self.program)

    def slice(
        self, model: Path, profiles: Sequence[str], path: Path, work: Work
    ) -> tuple[list[str], Figures]:
        """Slice a model. Returns warnings, and what the file says of the print."""
        program, target = self.program, check_target(path)
        with temporary_folder(target.parent) as folder:
            made = folder / target.name
            output = _run_program(self.command(program, profiles, model, made), work, self.title)
            if not made.exists():
                raise ExportError(f"{self.title} wrote no file: {_last(output)}")
            figures = read_figures(made)
            os.replace(made, target)
        return _warnings(output), figures


class Figures(NamedTuple):
    """What a slicer says of a print; None for what it does not."""

    seconds: float | None = None
    grams: float | None = None
    cost: float | None = None
    metres: float | None = None


EDGE = 1 << 18
"""Bytes at either end of G-code in which the comments on the whole print are."""
_TIMES = (
    re.compile(rb"^; estimated printing time \(normal mode\) = (.+)$", re.M),  # PrusaSlicer, OrcaSlicer
    re.compile(rb"^;.* total estimated time: (.+)$", re.M),  # Bambu Studio
    re.compile(rb"^;TIME:([\d.]+)\s*$", re.M),  # CuraEngine
)
_GRAMS = re.compile(rb"^; total filament (?:used \[g\] =|weight \[g\] ?:)(.+)$", re.M)
_COST = re.compile(rb"^; total filament cost =(.+)$", re.M)
_LENGTHS = (
    (0.001, re.compile(rb"^; (?:filament used \[mm\] =|total filament length \[mm\] ?:)(.+)$", re.M)),
    (1.0, re.compile(rb"^;Filament used:(.+)$", re.M)),
)
_UNITS = {b"d": 86400, b"h": 3600, b"m": 60, b"s": 1, b"": 1}


def read_figures(path: Path) -> Figures:
    """Read what G-code says of a print: that of a file, or of all plates of a project."""
    if path.suffix.lower() != ".3mf":
        with reporting_errors(path), open(path, "rb") as file:
            return _figures(file)
    try:
        with zipfile.ZipFile(path) as archive:
            names = [name for name in archive.namelist() if name.endswith(".gcode")]
            plates = [_figures(archive.open(name)) for name in names]
    except (OSError, zipfile.BadZipFile):
        return Figures()
    sums = zip(*plates, strict=True) if plates else ()
    return Figures(*(None if None in some else sum(filter(None, some)) for some in sums))


def _figures(file: IO[bytes]) -> Figures:
    """Figures in the comments at both ends of G-code."""
    text = file.read(EDGE)
    rest = b""
    while more := file.read(1 << 20):
        rest = (rest + more)[-EDGE:]
    text += b"\n" + rest
    time = next((match[1] for pattern in _TIMES if (match := pattern.search(text))), None)
    grams, cost = (_sum(match[1]) if (match := of.search(text)) else None for of in (_GRAMS, _COST))
    length = next((unit * (_sum(m[1]) or 0) for unit, of in _LENGTHS if (m := of.search(text))), None)
    return Figures(None if time is None else _seconds(time), grams or None, cost or None, length or None)


def _sum(text: bytes) -> float | None:
    """Sum of the numbers of each filament, such as 1.5, 2.0 or 1.5m."""
    return sum(map(float, re.findall(rb"\d+\.?\d*", text))) or None


def _seconds(text: bytes) -> float | None:
    """Seconds of a time such as 1d 2h 3m 4s."""
    parts = re.findall(rb"(\d+\.?\d*)([dhms]?)", text)
    return sum(float(number) * _UNITS[unit] for number, unit in parts) or None


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
    """Lines that warn, without time and thread, each once and shortened; settings are none."""
    told = (_LOG.sub(r"\1: ", line.strip()) for line in lines if _WARNING.search(line))
    return list(dict.fromkeys(printable(line[:LONGEST_LINE]) for line in told if not _SETTING.match(line)))


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
    "prusa": FilamentSlicer(
        "PrusaSlicer", ("prusa-slicer", "PrusaSlicer"), ".3mf", ".gcode", _prusa, ("PrusaSlicer",)
    ),
    "orca": FilamentSlicer(
        "OrcaSlicer", ("orca-slicer", "OrcaSlicer"), ".3mf", ".3mf", _orca, ("OrcaSlicer",)
    ),
    "bambu": FilamentSlicer(
        "Bambu Studio", ("bambu-studio", "BambuStudio"), ".3mf", ".3mf", _orca, ("BambuStudio",)
    ),
    "cura": FilamentSlicer("CuraEngine", ("CuraEngine", "curaengine"), ".stl", ".gcode", _cura),
}
"""Slicers by name in commands."""
