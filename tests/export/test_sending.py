"""Uploads, against small servers on the loopback that speak the printers' protocols."""

from __future__ import annotations

import hashlib
import json
import re
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.errors import Cancelled, ExportError
from fracslice.export import sending
from fracslice.work import Work


class PrusaLink(BaseHTTPRequestHandler):
    """PrusaLink: stores a file under a key, never over another."""

    files: dict[str, bytes]
    usb: str | None = "usb"

    def do_PUT(self) -> None:
        data = self.rfile.read(int(self.headers["Content-Length"]))
        status = 201
        if self.headers["X-Api-Key"] != "secret":
            status = 401
        elif "/usb/" in self.path and self.usb is None:
            status = 404
        elif self.path in self.files:
            status = 409
        else:
            assert (self.headers["Print-After-Upload"], self.headers["Overwrite"]) == ("?0", "?0")
            self.files[self.path] = data
        self.send_response(status)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


class Sdcp(PrusaLink):
    """SDCP 3: takes packets of a form in order, and checks the digest of the whole."""

    def do_POST(self) -> None:
        assert self.path == "/uploadFile/upload"
        body = self.rfile.read(int(self.headers["Content-Length"]))
        boundary = self.headers["Content-Type"].partition("boundary=")[2].encode()
        fields: dict[str, bytes] = {}
        for part in body.split(b"--" + boundary)[1:-1]:
            head, _, value = part.partition(b"\r\n\r\n")
            name = re.search(rb' name="([^"]*)"', head)
            assert name
            fields[name[1].decode()] = value[:-2]
            if b"filename" in head:
                title = head.split(b'filename="')[1].partition(b'"')[0].decode()
        stored = self.files.setdefault(title, b"")
        good = int(fields["Offset"]) == len(stored) and len(fields["File"]) <= 1 << 20
        self.files[title] = stored + fields["File"]
        if len(self.files[title]) == int(fields["TotalSize"]):
            good &= hashlib.md5(self.files[title]).hexdigest().encode() == fields["S-File-MD5"]
        answer = {"code": "000000", "messages": None, "data": {}, "success": True}
        if not good:
            messages = [{"field": "common_field", "message": -2}]
            answer = {"code": "111111", "messages": messages, "data": None, "success": False}
        data = json.dumps(answer).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)


@contextmanager
def printer(protocol: type[PrusaLink], **files: bytes) -> Iterator[tuple[int, dict[str, bytes]]]:
    """A printer on the loopback: its port and its files."""
    handler = type("Handler", (protocol,), {"files": files})
    with HTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        try:
            yield server.server_address[1], files
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture
def job(tmp_path: Path) -> Path:
    path = tmp_path / "my job.goo"
    path.write_bytes(bytes(range(256)) * 10_000)  # three packets
    return path


def test_prusalink_stores_the_file_and_starts_nothing(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRACSLICE_KEY", "secret")
    with printer(PrusaLink) as (port, files):
        address = f"prusalink://127.0.0.1:{port}"
        assert sending.send(job, address, Work()) == "my job.goo is on 127.0.0.1"
        assert files == {"/api/v1/files/usb/my%20job.goo": job.read_bytes()}
        with pytest.raises(ExportError, match="or is busy"):
            sending.send(job, address, Work())
        monkeypatch.setenv("FRACSLICE_KEY", "wrong")
        with pytest.raises(ExportError, match="refuses the key"):
            sending.send(job, address, Work())


def test_the_key_is_in_the_environment_or_a_file(
    job: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FRACSLICE_KEY", raising=False)
    with pytest.raises(ExportError, match="PrusaLink needs a key"):
        sending.printer_address("prusalink://here")
    for key in ("two\nlines", "ключ"):
        monkeypatch.setenv("FRACSLICE_KEY", key)
        with pytest.raises(ExportError, match="expected ASCII in one line") as failure:
            sending.printer_address("prusalink://here")
        assert key not in str(failure.value)
    monkeypatch.delenv("FRACSLICE_KEY")
    (tmp_path / "key").write_text("secret\n")
    monkeypatch.setenv("FRACSLICE_KEY_FILE", str(tmp_path / "key"))
    with printer(PrusaLink) as (port, files):
        sending.send(job, f"prusalink://127.0.0.1:{port}/local", Work())
        assert list(files) == ["/api/v1/files/local/my%20job.goo"]


def test_a_storage_that_the_printer_lacks(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRACSLICE_KEY", "secret")
    monkeypatch.setattr(PrusaLink, "usb", None)
    with printer(PrusaLink) as (port, _), pytest.raises(ExportError, match=r"has no storage usb; .*/local"):
        sending.send(job, f"prusalink://127.0.0.1:{port}", Work())


def test_sdcp_stores_the_packets_in_order(job: Path) -> None:
    with printer(Sdcp) as (port, files):
        shares = []
        work = Work(progress=lambda _, share: shares.append(share))
        sending.send(job, f"sdcp://127.0.0.1:{port}", work)
        assert files == {"my job.goo": job.read_bytes()}
        assert len(shares) == 3 and shares[-1] == 1
    with (
        printer(Sdcp, **{"my job.goo": b"other"}) as (port, _),
        pytest.raises(ExportError, match="byte 0: -2"),
    ):
        sending.send(job, f"sdcp://127.0.0.1:{port}", Work())


def test_no_printer_is_one_line(job: Path) -> None:
    with printer(Sdcp) as (port, _):
        pass
    with pytest.raises(ExportError, match=f"sdcp://127.0.0.1:{port}: Connection refused"):
        sending.send(job, f"sdcp://127.0.0.1:{port}", Work())
    for text in (
        "http://here",
        "sdcp://",
        "sdcp://here/folder",
        "sdcp://me:key@here",
        "sdcp://here:port",
        f"sdcp://{70 * 'a'}",
    ):
        with pytest.raises(
            ExportError, match="expected prusalink://HOST, prusalink://HOST/local or sdcp://HOST"
        ):
            sending.printer_address(text)


class Hostile(Sdcp):
    """Answers each packet as it likes, byte after byte."""

    begin, more = b"", b""

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        with suppress(OSError):
            self.wfile.write(self.begin)
            while self.more:
                self.wfile.write(self.more)
                time.sleep(0.001)


@pytest.mark.parametrize(
    ("begin", "more", "message"),
    [
        (b"", b"HTTP/1.1 100 Continue\r\n\r\n", "no complete answer within 0.3 s"),
        (b"", b"H", "no complete answer within 0.3 s|got more than"),
        (b"HTTP/1.1 200 OK\r\n\r\n", b"{", "no complete answer within 0.3 s"),
        (b"HTTP/1.1 200 OK\r\n\r\n", b"[" * (1 << 20), "answer is longer than"),
        (b"HTTP/1.1 200 OK\r\n\r\n" + b"[" * 100_000, b"", "at byte 0: no reason"),
        (b'HTTP/1.1 200 OK\r\n\r\n{"messages": [{"message": "\\u001b[2J"}]}', b"", r"at byte 0: \?\[2J"),
        (b"\x1b[31m nothing\r\n", b"", r"\?\[31m nothing"),
    ],
)
def test_a_printer_that_says_anything_is_one_line(
    begin: bytes, more: bytes, message: str, job: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sending, "PATIENCE", 0.3)
    hostile = type("Hostile", (Hostile,), {"begin": begin, "more": more})
    with printer(hostile) as (port, _), pytest.raises(ExportError, match=message):
        sending.send(job, f"sdcp://127.0.0.1:{port}", Work())


def test_cancellation_ends_a_wait_for_the_printer(job: Path) -> None:
    hostile, work = type("Hostile", (Hostile,), {"more": b"HTTP/1.1 100 Continue\r\n\r\n"}), Work()
    threading.Timer(0.2, work.cancel.set).start()
    with printer(hostile) as (port, _), pytest.raises(Cancelled):
        sending.send(job, f"sdcp://127.0.0.1:{port}", work)


def test_cancellation_ends_a_wait_for_a_connection(job: Path) -> None:
    with ExitStack() as stack:
        busy, work = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0)), Work()
        for _ in range(3):  # fill the queue of the server, which accepts nothing
            waiting = stack.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(busy.getsockname())
        threading.Timer(0.2, work.cancel.set).start()
        began = time.monotonic()
        with pytest.raises(Cancelled):
            sending.send(job, f"sdcp://127.0.0.1:{busy.getsockname()[1]}", work)
    assert time.monotonic() - began < 5


def test_slice_sends_with_the_flag_only(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    ball = tmp_path / "ball.xml"
    ball.write_text('<scene version="1"><solid size="20mm"><sphere/></solid></scene>')
    out = ball.with_name("ball.goo")
    options = "--layer", "4mm", "--printer", "mars-5", "--exposure", "2", "20"
    with printer(Sdcp) as (port, files):
        assert run(["slice", str(ball), "-o", str(out), *options]) == 0
        assert files == {}
        assert run(["slice", str(ball), "-o", str(out), *options, "--send", f"sdcp://127.0.0.1:{port}"]) == 0
        assert files == {"ball.goo": out.read_bytes()}
    assert capfd.readouterr().out.endswith("ball.goo is on 127.0.0.1\n")
    svg = str(ball.with_name("ball.svg"))
    assert run(["slice", str(ball), "-o", svg, "--send", "sdcp://here"]) == 2
    assert "--send is for printers' files" in capfd.readouterr().err
