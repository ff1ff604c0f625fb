"""Upload of print files to printers: PrusaLink, and SDCP 3 of Elegoo and ChiTu boards.

A file is only stored: nothing starts a print. PrusaLink is described at
github.com/prusa3d/Prusa-Link-Web (spec/openapi.yaml), SDCP at
github.com/cbd-tech/SDCP-Smart-Device-Control-Protocol-V3.0.0.
"""

from __future__ import annotations

import hashlib
import json
import os
import uuid
from collections.abc import Iterator
from functools import partial
from http.client import HTTPConnection, HTTPException, HTTPResponse
from io import BufferedReader
from pathlib import Path
from urllib.parse import quote, urlsplit

from ..common.files import reporting_errors
from ..common.settings import read_text
from ..errors import ExportError
from ..work import Work

PACKET = 1 << 20
"""Bytes of a packet of SDCP."""

TIMEOUT = 30.0
"""Seconds without an answer after which a printer counts as unreachable."""

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
        connection = HTTPConnection(host, port, timeout=TIMEOUT)
        try:
            upload(connection, Path(path).name, file, os.fstat(file.fileno()).st_size, work)
        except (OSError, HTTPException) as error:
            raise ExportError(f"{address}: {getattr(error, 'strerror', None) or error}") from None
        except ExportError as error:
            raise ExportError(f"{address}: {error}") from None
        finally:
            connection.close()
    return f"{Path(path).name} is on {host}"


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


def _packets(file: BufferedReader, size: int, work: Work) -> Iterator[bytes]:
    """Contents of a file in packets."""
    sent = 0
    while packet := file.read(PACKET):
        work.check()
        yield packet
        sent += len(packet)
        work.progress("sending", sent / size)


def _prusalink(
    storage: str, connection: HTTPConnection, name: str, file: BufferedReader, size: int, work: Work
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
    connection.request("PUT", url, _packets(file, size, work), headers)
    status = _read_response(connection.getresponse()).status
    if status in (401, 403):
        raise ExportError("the printer refuses the key")
    if status == 404:
        raise ExportError(f"the printer has no storage {storage}; expected another, such as /local or /usb")
    if status == 409:
        raise ExportError(f"the printer has a file {name}, or is busy")
    if status not in (200, 201):
        raise ExportError(f"the printer refuses the file with status {status}")


def _sdcp(connection: HTTPConnection, name: str, file: BufferedReader, size: int, work: Work) -> None:
    """Store a file on a printer with SDCP, packet by packet."""
    digest = hashlib.file_digest(file, "md5").hexdigest()
    file.seek(0)
    common = {"S-File-MD5": digest, "Check": "1", "Uuid": uuid.uuid4().hex, "TotalSize": str(size)}
    offset = 0
    for packet in _packets(file, size, work):
        body, kind = _form({**common, "Offset": str(offset)}, name, packet)
        connection.request("POST", "/uploadFile/upload", body, {"Content-Type": kind})
        response = connection.getresponse()
        text = response.read()
        try:
            done = json.loads(text)
        except ValueError:
            done = {}
        if response.status != 200 or not isinstance(done, dict) or not done.get("success"):
            raise ExportError(f"the printer refuses the file at byte {offset}: {_reason(done)}")
        offset += len(packet)


def _read_response(response: HTTPResponse) -> HTTPResponse:
    """A response whose contents have been read."""
    response.read()
    return response


def _reason(answer: object) -> str:
    """Message of an answer of SDCP."""
    messages = answer.get("messages") if isinstance(answer, dict) else None
    first = messages[0] if isinstance(messages, list) and messages else {}
    return f"{first.get('message', 'no reason')}" if isinstance(first, dict) else "no reason"


def _form(fields: dict[str, str], name: str, packet: bytes) -> tuple[bytes, str]:
    """Multipart form with a file, and its content type (RFC 7578)."""
    boundary = uuid.uuid4().hex
    begin = f"--{boundary}\r\nContent-Disposition: form-data; name="
    head = "".join(f'{begin}"{key}"\r\n\r\n{value}\r\n' for key, value in fields.items())
    safe = name.replace('"', "%22")
    head += f'{begin}"File"; filename="{safe}"\r\nContent-Type: application/octet-stream\r\n\r\n'
    body = head.encode() + packet + f"\r\n--{boundary}--\r\n".encode()
    return body, f"multipart/form-data; boundary={boundary}"
