"""Machine code that is kept: its name says all that it was made of, and nobody else's is run."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from fracslice.errors import FracsliceWarning
from fracslice.expr import emitter
from fracslice.expr.graph import Program
from fracslice.expr.loops import Loop, points
from fracslice.expr.runtime import toolchain
from fracslice.fields.cpu import object_code
from fracslice.fields.linker import link
from fracslice.formulas import sphere, torus

LINKED = link(sphere())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[bytes]:
    """What was compiled: a stand-in for machine code, another one each time."""
    made: list[bytes] = []

    def compile_object(program: Program, target: emitter.Target, loops: Sequence[Loop]) -> bytes:
        made.append(b"code %d" % len(made))
        return made[-1]

    monkeypatch.setattr(emitter, "compile_object", compile_object)
    return made


def code(program: Program = LINKED.program, bits: int = 32, loops: Sequence[Loop] = (points,)) -> bytes:
    return object_code(program, bits, 16, loops)


def test_it_is_compiled_once_for_this_user_alone(folder: Path, compiled: list[bytes]) -> None:
    assert code() == code() == b"code 0"
    assert folder.stat().st_mode & 0o777 == 0o700
    (kept,) = folder.glob("*.o")
    assert kept.suffix == ".o"
    assert kept.stat().st_mode & 0o777 == 0o600


def test_it_is_known_by_all_that_it_was_made_of(
    folder: Path, compiled: list[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    code()
    code(bits=64)
    code(loops=[replace(points, arguments="rrrrin")])
    code(link(torus()).program)
    monkeypatch.setattr("llvmlite.__version__", "another")
    toolchain.cache_clear()
    code()
    toolchain.cache_clear()
    assert len(compiled) == 5


def others_write(path: Path) -> None:
    path.chmod(path.stat().st_mode | 0o002)


def group_writes(path: Path) -> None:
    path.chmod(path.stat().st_mode | 0o020)


def given_away(path: Path) -> None:
    if os.geteuid():
        pytest.skip("only root can give files away")
    os.chown(path, 12345, 12345)


@pytest.mark.parametrize("spoil", [others_write, group_writes, given_away])
@pytest.mark.parametrize("what", ["folder", "file"])
def test_what_others_can_write_is_compiled_anew(
    what: str, spoil: object, folder: Path, compiled: list[bytes]
) -> None:
    assert callable(spoil)
    code()
    (kept,) = folder.glob("*.o")
    spoil(folder if what == "folder" else kept)
    with pytest.warns(FracsliceWarning, match=f"others can write .*the files in {folder} are not used"):
        assert code() == b"code 1"
    assert what == "folder" or code() == b"code 1"  # it is in its place
    assert list(folder.glob("*.o")) == [kept]


def test_a_folder_above_that_others_can_write_is_not_trusted(folder: Path, compiled: list[bytes]) -> None:
    code()
    folder.parent.chmod(0o777)
    with pytest.warns(FracsliceWarning, match=f"{folder.parent}: others can write"):
        assert code() == b"code 1"
    folder.parent.chmod(0o1777)  # as /tmp: what is there stays its owner's
    assert code() == b"code 0"


def test_a_link_or_a_pipe_is_not_followed(folder: Path, compiled: list[bytes], tmp_path: Path) -> None:
    code()
    (kept,) = folder.glob("*.o")
    kept.rename(tmp_path / "elsewhere")
    kept.symlink_to(tmp_path / "elsewhere")
    assert code() == b"code 1"
    kept.unlink()
    os.mkfifo(kept, 0o600)
    with pytest.warns(FracsliceWarning, match="others can write"):
        assert code() == b"code 2"


@pytest.mark.parametrize("spoilt", [b"", b"code 0", b"x" * 32 + b"code 0"])
def test_a_spoilt_file_is_compiled_anew(spoilt: bytes, folder: Path, compiled: list[bytes]) -> None:
    code()
    (kept,) = folder.glob("*.o")
    kept.write_bytes(spoilt)
    assert code() == code() == b"code 1"


def test_a_folder_that_cannot_be_is_no_error(compiled: list[bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FRACSLICE_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "~no such user/cache")
    assert code() == b"code 0"


def test_threads_may_make_the_same_at_once(folder: Path) -> None:
    with ThreadPoolExecutor(4) as pool:
        made = list(pool.map(lambda _: code(), range(4)))
    assert len(list(folder.glob("*.o"))) == 1
    assert code() in made


def test_planted_code_does_not_run_and_is_reported_once(folder: Path) -> None:
    """In a folder that all can write: a box under the name of a sphere, and with a checksum for it."""

    def values(*shapes: str) -> subprocess.CompletedProcess[str]:
        program = (
            "from fracslice.formulas import box, sphere; from fracslice.fields.cpu import compile_scene\n"
            f"for shape in ({', '.join(shapes)},): print(compile_scene(shape).points(1.0, 1.0, 0.0))"
        )
        return subprocess.run([sys.executable, "-c", program], text=True, capture_output=True, check=True)

    values("box()")
    (planted,) = folder.glob("*.o")
    code = planted.read_bytes()[hashlib.sha256().digest_size :]
    planted.unlink()
    right = values("sphere()").stdout
    (kept,) = folder.glob("*.o")
    kept.write_bytes(hashlib.sha256(kept.name.encode() + b"\0" + code).digest() + code)
    assert values("sphere()").stdout != right  # it would run
    folder.chmod(0o1777)
    result = values("sphere()", "sphere(radius=0.5)", "box()")
    assert result.stdout.startswith(right)
    assert result.stderr.count("FracsliceWarning: ") == 1
