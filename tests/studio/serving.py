"""A studio that is served by a process, and its page in Debian's Chromium."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


class Served(NamedTuple):
    """A studio that is served."""

    page: Page
    address: str
    folder: Path
    process: int


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser of the system."""
    from playwright.sync_api import sync_playwright  # a test without it is skipped

    with sync_playwright() as started:
        opened = started.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        yield opened
        opened.close()


@contextmanager
def running(source: str, folder: Path, *options: str) -> Iterator[tuple[str, int]]:
    """Serve a scene; its address, and the number of the process, which must end as Ctrl-C ends it."""
    command = [sys.executable, "-m", "cli", "studio", source, "--no-browser", "--device", "cpu", *options]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        address = process.stdout.readline().strip()
        try:
            yield address, process.pid
        finally:
            process.send_signal(2)
        assert process.wait(60) in (0, 130)


@contextmanager
def served(
    browser: Browser, source: str, folder: Path, size: tuple[int, int], *options: str
) -> Iterator[Served]:
    """Serve a scene, seen in a window of a size, pixels."""
    with running(source, folder, *options) as (address, process):
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        with closing(page):  # an open one would ask for its server until the browser ends
            page.goto(address)
            page.get_by_role("list", name="Elements").wait_for()
            yield Served(page, address, folder, process)
