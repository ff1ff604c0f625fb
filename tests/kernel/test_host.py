"""Description of the host CPU, and the device that computes."""

from __future__ import annotations

from pathlib import Path

import pytest

from fracslice.expr import runtime
from fracslice.fields import devices

LINES = "".join(f"{line}\t: 1\n" for line in sorted(runtime.DESCRIBED))
CPU = f"processor\t: 0\n{LINES}\nprocessor\t: 1\n"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[int]:
    """Questions to LLVM, with an empty cache and a processor of its own."""
    questions: list[int] = []

    def answer() -> tuple[str, str, str]:
        questions.append(1)
        return "znver4", "+avx,-amx", "15.0.7"

    (tmp_path / "cpuinfo").write_text(CPU)
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(runtime, "_ask_llvm", answer)
    monkeypatch.setattr(runtime, "PROCESSORS", tmp_path / "cpuinfo")
    return questions


def described() -> tuple[str, str, str]:
    return runtime.description.__wrapped__()


def test_llvm_is_asked_once_for_a_processor(asked: list[int]) -> None:
    assert described() == described() == ("znver4", "+avx,-amx", "15.0.7")
    assert len(asked) == 1
    runtime.PROCESSORS.write_text(CPU.replace("flags\t: 1", "flags\t: 2"))
    described()
    assert len(asked) == 2
    runtime.PROCESSORS.write_text(CPU.replace("processor\t: 0", "processor\t: 5"))
    described()
    assert len(asked) == 2, "the first processor again"


def test_other_systems_ask_llvm_each_time(asked: list[int]) -> None:
    runtime.PROCESSORS.write_text(CPU.replace("flags", "Features"))
    described()
    runtime.PROCESSORS.unlink()
    described()
    assert len(asked) == 2


def test_a_small_picture_does_not_start_the_gpu() -> None:
    assert devices.for_picture("auto", (640, 360), 1) == "cpu"
    assert devices.for_picture("auto", (1920, 1080), 64) == "auto"
    assert [devices.for_picture(device, (64, 48), 1) for device in ("cpu", "cuda")] == ["cpu", "cuda"]


def test_a_small_render_does_not_look_for_a_gpu(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from fracslice.cli.main import run

    from fracslice import render, sphere

    monkeypatch.setattr("fracslice.expr.cuda_driver.missing", lambda: pytest.fail("looked for a GPU"))
    (tmp_path / "a.xml").write_text('<scene version="1"><solid size="9mm"><sphere/></solid></scene>')
    command = "render", tmp_path / "a.xml", "-o", tmp_path / "a.png", "--size", "8x6", "--samples", 1, "-q"
    assert run([str(word) for word in command]) == 0
    assert render(sphere(), size=(8, 6), samples=1).shape == (6, 8, 3)
