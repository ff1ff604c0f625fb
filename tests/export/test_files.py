"""Files are whole or not there, whatever happens on the way."""

from __future__ import annotations

import errno
import os
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from fracslice.common.files import (
    check_target,
    flushing,
    link_or_copy,
    replacing,
    temporary_folder,
    write_small_file,
)
from fracslice.errors import ExportError
from fracslice.formats import write
from tests.mesh.shapes import cube


def test_a_file_that_has_the_name_already_leaves_no_other(tmp_path: Path) -> None:
    piece, path = tmp_path / "piece", tmp_path / "cube.stl"
    piece.write_bytes(b"whole")
    for _ in range(2):
        link_or_copy(str(piece), path)
        assert path.read_bytes() == b"whole"
        assert sorted(tmp_path.iterdir()) == [path, piece]


def test_replaces_what_was_there_and_keeps_its_permissions(tmp_path: Path) -> None:
    path = tmp_path / "cube.stl"
    path.write_text("old")
    path.chmod(0o640)
    write(cube(), path)
    assert path.stat().st_size == 84 + 12 * 50
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert list(tmp_path.iterdir()) == [path]


def test_new_files_get_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    path = write(cube(), tmp_path / "cube.stl")
    assert path.stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_links_stay_links(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.stl"
    link.symlink_to(tmp_path / "there" / "real.stl")
    write(cube(), link)
    assert link.is_symlink()
    assert (tmp_path / "there" / "real.stl").stat().st_size == 84 + 12 * 50


def fail_half_way(path: Path, stop: type[BaseException]) -> None:
    with replacing(path) as file:
        file.write(b"half")
        raise stop


def test_a_file_is_flushed_while_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flushed = threading.Event()
    monkeypatch.setattr("os.fsync", lambda _: flushed.set())
    monkeypatch.setattr("fracslice.common.files.FLUSH_S", 0.001)
    with replacing(tmp_path / "large") as file, flushing(file):
        assert flushed.wait(10)


@pytest.mark.skipif(os.name != "posix", reason="an open file cannot be replaced")
def test_another_thread_releases_a_large_file_that_was_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, released, close = tmp_path / "large", list[threading.Thread](), os.close
    path.write_bytes(b"old")

    def noted(handle: int) -> None:
        if os.path.samestat(os.fstat(handle), old):
            released.append(threading.current_thread())
        close(handle)

    old = path.stat()
    monkeypatch.setattr("os.close", noted)
    monkeypatch.setattr("fracslice.common.files.LARGE", 3)
    with replacing(path) as file:
        file.write(b"new")
    for thread in threading.enumerate():
        if thread.name.endswith("(noted)"):
            thread.join(10)
    assert path.read_bytes() == b"new"
    assert len(released) == 1 and released[0] is not threading.main_thread()


def test_an_error_of_flushing_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    failed = threading.Event()

    def fail(_: int) -> None:
        failed.set()
        raise OSError(errno.EIO, "Input/output error")

    def write_slowly() -> None:
        with replacing(tmp_path / "large") as file, flushing(file):
            assert failed.wait(10)
            monkeypatch.setattr("os.fsync", lambda _: None)  # the system reports it once

    monkeypatch.setattr("os.fsync", fail)
    monkeypatch.setattr("fracslice.common.files.FLUSH_S", 0.001)
    with pytest.raises(ExportError, match="large: Input/output error"):
        write_slowly()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError, MemoryError])
def test_any_error_leaves_the_old_file_alone(tmp_path: Path, stop: type[BaseException]) -> None:
    path = tmp_path / "kept"
    path.write_text("old")
    with pytest.raises(stop):
        fail_half_way(path, stop)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "disk is full"),
        (errno.EDQUOT, "disk is full"),
        (errno.EROFS, "not allowed"),
        (errno.EIO, "error"),
    ],
)
def test_what_the_file_system_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, words: str
) -> None:
    def refuse(_: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(ExportError, match=words) as failure:
        write(cube(), tmp_path / "cube.stl")
    assert "\n" not in str(failure.value)
    assert list(tmp_path.iterdir()) == []


def write_to_full_disk(path: Path) -> None:
    with replacing(path), open("/dev/full", "wb", buffering=0) as full:
        full.write(b"x")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_an_error_of_the_device_itself(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="disk is full"):
        write_to_full_disk(tmp_path / "model.stl")
    assert list(tmp_path.iterdir()) == []


def test_folders_that_cannot_be_written_to(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="does not exist"):
        write(cube(), tmp_path / "missing" / "cube.stl")
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(ExportError, match="is a folder"):
        write(cube(), tmp_path / "folder.stl")
    with pytest.raises(ExportError, match="does not exist"):
        check_target(tmp_path / "missing" / "cube.stl")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_pipe_or_a_device_is_not_replaced(tmp_path: Path) -> None:
    """As root, a link to /dev/null would cost the machine its /dev/null."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "cube.stl").symlink_to(tmp_path / "pipe")
    with pytest.raises(ExportError, match="is a device or a pipe"):
        write(cube(), tmp_path / "cube.stl")
    assert (tmp_path / "pipe").is_fifo() and len(list(tmp_path.iterdir())) == 2


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_is_not_writable(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(ExportError, match="not writable"):
        write(cube(), tmp_path / "cube.stl")


def test_kill_in_mid_write_leaves_no_broken_file(tmp_path: Path) -> None:
    path = tmp_path / "model.stl"
    path.write_text("old")
    code = (
        "import sys, time; from fracslice.common.files import replacing\n"
        "with replacing(sys.argv[1]) as file:\n"
        "    file.write(b'half' * 100000); file.flush(); print('writing', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code, path], stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"writing\n"
        time.sleep(0.1)
        write(cube(), tmp_path / "other.stl")
        assert len(os.listdir(tmp_path)) == 3, "a file that is being written is left alone"
        child.send_signal(signal.SIGKILL)
    assert path.read_text() == "old"
    write(cube(), path)
    assert path.stat().st_size == 84 + 12 * 50
    assert sorted(os.listdir(tmp_path)) == ["model.stl", "other.stl"]


def test_folders_of_killed_processes_are_removed(tmp_path: Path) -> None:
    (tmp_path / ".fracslice~killed").mkdir()
    (tmp_path / ".fracslice~killed" / "piece").write_text("half")
    (tmp_path / ".fracslice~link").symlink_to(tmp_path)
    with temporary_folder(tmp_path) as folder:
        (folder / "piece").write_text("mine")
        with replacing(tmp_path / "model.stl") as file:
            file.write(b"whole")
        assert {*os.listdir(tmp_path)} == {folder.name, "model.stl", ".fracslice~link"}
    assert {*os.listdir(tmp_path)} == {"model.stl", ".fracslice~link"}


def test_a_file_that_was_taken_for_a_leftover_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By another process, before it was locked."""
    make, made = tempfile.mkstemp, list[str]()

    def swept(*where: Any) -> tuple[int, str]:
        handle, part = make(*where)
        made.append(part)
        if len(made) < 3:
            os.unlink(part)
        return handle, part

    monkeypatch.setattr(tempfile, "mkstemp", swept)
    write(cube(), tmp_path / "cube.stl")
    assert len(made) == 3
    assert os.listdir(tmp_path) == ["cube.stl"]


def test_a_file_is_put_however_little_the_system_takes_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "layer"
    path.write_text("longer than what comes")
    real = os.write
    monkeypatch.setattr(os, "write", lambda handle, data: real(handle, data[:3]))
    write_small_file(f"{path}", b"a picture")
    assert path.read_bytes() == b"a picture"
