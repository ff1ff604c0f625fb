"""The first steps of a person in the page of a studio, in Firefox, over WebDriver BiDi (W3C, 2025)."""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import subprocess
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.waiting import wait_until

from .serving import running

aiohttp = pytest.importorskip("aiohttp")

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(shutil.which("firefox-esr") is None, reason="no Firefox is installed"),
]

SCENE = '<scene version="1">\n  <solid size="40mm"><sphere radius="0.5"/></solid>\n</scene>\n'

PICTURE = "document.querySelector('.v-main img')?.src ?? ''"
RADIUS = "document.querySelector('[aria-label=\"radius 1 as a number\"]')?.value ?? ''"
TEXT = "document.querySelector('[aria-label=\"Text of the scene\"]').value"


class Tab:
    """A tab of Firefox."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._sent, self._context = socket, 0, ""

    async def ask(self, method: str, **given: Any) -> Any:
        """Send a command; return what it answers."""
        self._sent += 1
        await self._socket.send_json({"id": self._sent, "method": method, "params": given})
        while True:
            answer = json.loads((await self._socket.receive()).data)
            if answer.get("id") == self._sent:
                assert answer["type"] == "success", answer
                return answer["result"]

    async def open(self, address: str) -> None:
        """Go to an address."""
        await self.ask("session.new", capabilities={})
        self._context = (await self.ask("browsingContext.getTree"))["contexts"][0]["context"]
        await self.ask("browsingContext.navigate", context=self._context, url=address, wait="complete")

    async def value(self, script: str) -> str:
        """Value of a script, as text."""
        target = {"context": self._context}
        answer = await self.ask("script.evaluate", expression=script, target=target, awaitPromise=False)
        return str(answer["result"].get("value", ""))

    async def act(self, kind: str, *actions: dict[str, Any]) -> None:
        """Do something with the mouse (`pointer`) or the keys (`key`)."""
        source = {"type": kind, "id": kind, "actions": list(actions)}
        await self.ask("input.performActions", context=self._context, actions=[source])

    async def drag(self, x: int, y: int, by: int, steps: int) -> None:
        """Drag from a point of the page to the right."""
        moves = [{"type": "pointerMove", "x": x + by * k // steps, "y": y} for k in range(steps + 1)]
        down, up = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}
        await self.act("pointer", moves[0], down, *moves[1:], up)

    async def until(self, holds: Callable[[], Awaitable[bool]]) -> None:
        """Wait until it holds."""
        for _ in range(300):
            if await holds():
                return
            await asyncio.sleep(0.1)
        raise TimeoutError

    async def becomes(self, script: str, expected: str) -> None:
        """Wait until the value of a script matches an expression."""

        async def matches() -> bool:
            return re.search(expected, await self.value(script)) is not None

        await self.until(matches)


@asynccontextmanager
async def firefox(profile: Path) -> AsyncIterator[Tab]:
    """Firefox without a window."""
    command = ["firefox-esr", "--headless", "--remote-debugging-port=0", "--profile", str(profile)]
    log = profile / "log"
    with log.open("w") as file, subprocess.Popen(command, stdout=file, stderr=file) as process:
        try:
            wait_until(lambda: "WebDriver BiDi listening on" in log.read_text(), seconds=60)
            found = re.search(r"WebDriver BiDi listening on (ws://\S+)", log.read_text())
            assert found
            async with aiohttp.ClientSession() as client, client.ws_connect(f"{found[1]}/session") as socket:
                yield Tab(socket)
        finally:
            process.terminate()


async def first_steps(tab: Tab, address: str) -> None:
    """Look, turn, change a number, undo, load the page again."""
    await tab.open(address)
    await tab.becomes("document.querySelector('[role=status]')?.textContent ?? ''", "sample")
    before = await tab.value(PICTURE)
    await tab.drag(700, 400, 80, 8)

    async def is_turned() -> bool:
        return await tab.value(PICTURE) != before

    await tab.until(is_turned)
    rows = "[...document.querySelectorAll('[aria-label=Elements] .v-list-item')]"
    await tab.value(f"{rows}.find(row => row.textContent.includes('sphere')).click()")
    await tab.becomes(RADIUS, r"^0\.5$")
    thumb = "document.querySelector('.v-slider-thumb').getBoundingClientRect()"
    x, y = [round(float(await tab.value(f"{thumb}.{side} + 10"))) for side in ("x", "y")]
    await tab.drag(x, y, 40, 40)

    async def is_in_text() -> bool:
        radius = float(await tab.value(RADIUS))
        return radius > 0.6 and f'radius="{radius:.6g}"' in await tab.value(TEXT)

    await tab.until(is_in_text)
    await tab.value("document.querySelector('[aria-label=Undo]').click()")
    await tab.becomes(TEXT, r'radius="0\.5"')
    await tab.value("location.reload()")
    await tab.becomes("document.querySelector('[aria-label=Elements]')?.textContent ?? ''", "sphere")
    await tab.becomes(PICTURE, "^(blob|data):")


def test_a_person_looks_changes_and_returns(tmp_path: Path) -> None:
    (tmp_path / "ball.xml").write_text(SCENE)
    profile = tmp_path / "profile"
    profile.mkdir()

    async def run(address: str) -> None:
        async with firefox(profile) as tab:
            await asyncio.wait_for(first_steps(tab, address), 120)

    with running("ball.xml", tmp_path) as (address, _):
        asyncio.run(run(address))
