"""Upload of print files to printers: PrusaLink, and SDCP 3 of Elegoo and ChiTu boards.

A file is only stored: nothing starts a print. PrusaLink is described at
github.com/prusa3d/Prusa-Link-Web (spec/openapi.yaml), SDCP at
github.com/cbd-tech/SDCP-Smart-Device-Control-Protocol-V3.0.0.
"""

from __future__ import annotations

import hashlib
import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from http.client import HTTPConnection, HTTPException
from io import BufferedReader
from pathlib import Path
from urllib.parse import quote, urlsplit

from ..common.files import read_text, reporting_errors
from ..common.parameters import printable
from ..errors import ExportError
from ..work import Work

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
