"""The page of a studio, driven as a person would, in a real browser."""

from __future__ import annotations

import os
import random
import re
import shutil
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests import waiting

from . import serving
from .serving import Served

if TYPE_CHECKING:
    from playwright.sync_api import Browser

playwright = pytest.importorskip("playwright.sync_api")
axe = pytest.importorskip("axe_playwright_python.sync_playwright")

pytestmark = [
    pytest.mark.once,
    pytest.mark.skipif(shutil.which("chromium") is None, reason="no Chromium is installed"),
]

wait_until = partial(waiting.wait_until, seconds=30)

SCENE = """<scene version="1">
  <!-- A ball and a block. -->
  <solid size="40mm">
    <union smooth="0.1">
      <sphere radius="0.5"/>
      <transform translate="0.8 0 0"><box size="0.6 0.6 0.6"/></transform>
    </union>
  </solid>
</scene>
"""


SOAK = 1800.0
"""Time of random input, seconds."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with serving.chromium() as opened:
        yield opened


@pytest.fixture
def served(browser: Browser, tmp_path: Path) -> Iterator[Served]:
    (tmp_path / "two.xml").write_text(SCENE)
    with serving.served(browser, "two.xml", tmp_path, (1200, 640), "--threads", "1") as made:
        yield made


def text(page: playwright.Page) -> str:
    """Text of the scene, in its editor."""
    return str(page.get_by_label("Text of the scene").input_value())


def row(page: playwright.Page, name: str) -> playwright.Locator:
    """Elements of a name in the tree."""
    return page.get_by_role("list", name="Elements").get_by_text(name, exact=True)


def picture(page: playwright.Page) -> bytes:
    """What the page shows as the picture, once it has samples."""
    wait_until(lambda: "sample" in page.get_by_role("status").inner_text())
    return bytes(page.locator(".v-main img").first.screenshot())


def test_a_person_looks_changes_undoes_and_saves(served: Served) -> None:
    page = served.page
    first = picture(page)
    page.mouse.move(700, 350)
    page.mouse.down()
    page.mouse.move(760, 380, steps=8)
    page.mouse.up()
    wait_until(lambda: picture(page) != first)
    row(page, "sphere").click()
    page.get_by_label("radius 1 as a number").fill("0.7")
    page.get_by_label("radius 1 as a number").press("Enter")
    page.get_by_label("Text", exact=True).click()
    wait_until(lambda: 'radius="0.7"' in text(page))
    page.get_by_label("Undo").click()
    wait_until(lambda: text(page) == SCENE)
    page.get_by_label("Redo").click()
    page.get_by_label("Save").click()
    wait_until(lambda: 'radius="0.7"' in (served.folder / "two.xml").read_text())
    assert "<!-- A ball and a block. -->" in (served.folder / "two.xml").read_text()


def test_every_value_of_a_slider_arrives(served: Served) -> None:
    page = served.page
    row(page, "sphere").click()
    shown = page.get_by_label("radius 1 as a number")
    shown.wait_for()  # until then, the controls are those of another element
    thumb = page.locator(".v-slider-thumb").first.bounding_box()
    assert thumb
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y, steps=30)
    page.mouse.up()
    wait_until(lambda: float(shown.input_value()) > 0.75)  # what it had before is in the text, too
    wait_until(lambda: f'radius="{float(shown.input_value()):.6g}"' in text(page))
    assert float(shown.input_value()) > 0.75


def test_no_step_of_a_key_that_is_held_is_lost(served: Served) -> None:
    page = served.page
    row(page, "sphere").click()
    shown = page.get_by_label("radius 1 as a number")
    shown.wait_for()
    thumb = page.locator(".v-slider-thumb").first
    thumb.press("ArrowRight")
    wait_until(lambda: float(shown.input_value()) > 0.5)
    step = float(shown.input_value()) - 0.5
    for _ in range(40):
        thumb.press("ArrowRight")
    wait_until(lambda: f'radius="{0.5 + 41 * step:.6g}"' in text(page))


def test_a_wrong_text_is_said_at_its_line_while_the_picture_stays(served: Served) -> None:
    page, editor = served.page, served.page.get_by_label("Text of the scene")
    page.get_by_label("Text", exact=True).click()
    editor.fill(SCENE.replace("<sphere", "<spheres"))
    page.get_by_text(re.compile(r"two\.xml:5: <spheres> is not a known element")).wait_for()
    assert page.locator(".v-main img").first.is_visible()
    editor.fill(SCENE)
    page.locator(".v-alert").wait_for(state="detached")


def test_an_element_is_wrapped_and_a_file_made(served: Served) -> None:
    page = served.page
    row(page, "sphere").click()
    page.get_by_role("button", name="Wrap", exact=True).click()
    page.get_by_label("Search").fill("shell")
    page.locator(".v-dialog .v-list-item", has_text="shell").first.click()
    wait_until(lambda: "<shell" in text(page))
    page.get_by_label("Make a file").click()
    page.get_by_label("File:").fill("two.stl")
    page.get_by_label("Voxels").fill("32")
    page.get_by_role("button", name="Make", exact=True).click()
    page.get_by_text(re.compile(r"two\.stl: [\d,]+ triangles")).wait_for()
    assert (served.folder / "two.stl").stat().st_size > 1000
    assert page.get_by_text("fracslice mesh two.xml -o two.stl --resolution 32").is_visible()


def test_the_inside_is_looked_at(served: Served) -> None:
    page = served.page
    page.get_by_label("Inside", exact=True).click()
    panel = page.locator(".v-navigation-drawer", has_text="Layers")
    panel.locator(".v-select", has_text="Fineness").click()
    page.get_by_role("option", name="32", exact=True).click()
    panel.get_by_text("closed, manifold").wait_for()
    assert page.get_by_role("button", name="mesh", exact=True).get_attribute("aria-pressed") == "true"
    panel.get_by_label("Click points").check()
    box = page.locator(".v-main img").first.bounding_box()
    assert box
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    panel.get_by_text("point 1").wait_for()
    page.get_by_role("button", name="layers", exact=True).click()
    layer = panel.get_by_label("Layer as a number")
    layer.fill("3")
    layer.press("Enter")
    panel.get_by_text("0.200 mm of").wait_for()
    page.get_by_role("button", name="field", exact=True).click()
    picture(page)


def test_a_page_is_loaded_again_and_goes_on_after_a_lost_connection(served: Served) -> None:
    page, sockets = served.page, []

    def passed_on(socket: playwright.WebSocketRoute) -> None:
        server = socket.connect_to_server()
        socket.on_message(server.send)
        server.on_message(socket.send)
        sockets.append(socket)

    page.route_web_socket("**/ws*", passed_on)
    row(page, "sphere").click()
    page.get_by_label("radius 1 as a number").fill("0.7")
    page.get_by_label("radius 1 as a number").press("Enter")
    page.reload()
    row(page, "sphere").wait_for()
    assert page.get_by_label("radius 1 as a number").input_value() == "0.7"
    with page.expect_event("load"):
        sockets[-1].close()
    row(page, "sphere").wait_for()
    picture(page)


def test_two_tabs_show_the_same_scene(served: Served, browser: Browser) -> None:
    other = browser.new_page()
    other.goto(served.address)
    row(other, "sphere").wait_for()
    row(served.page, "sphere").click()
    before = row(other, "sphere").count()
    served.page.get_by_role("button", name="Duplicate").click()
    wait_until(lambda: row(other, "sphere").count() == before + 1)
    other.close()


def test_other_sites_and_those_without_the_token_are_refused(served: Served, browser: Browser) -> None:
    base = served.address.partition("/index")[0]
    for headers in ({"Host": "example.com"}, {"Origin": "http://example.com"}):
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(urllib.request.Request(f"{base}/index.html", headers=headers))
    stranger = browser.new_page()
    stranger.goto(f"{base}/index.html?secret=wrong")
    time.sleep(2)
    assert row(stranger, "sphere").count() == 0
    stranger.close()


def act_at_random(page: playwright.Page, chance: random.Random) -> None:
    """Do one of the things that a person does."""
    x, y = chance.uniform(400, 1100), chance.uniform(120, 580)
    what = chance.choice(("drag", "wheel", "key", "row", "slider", "number", "undo", "cut", "view"))
    if what == "drag":
        page.mouse.move(x, y)
        page.mouse.down(button=chance.choice(("left", "right")))
        page.mouse.move(x + chance.uniform(-90, 90), y + chance.uniform(-90, 90), steps=5)
        page.mouse.up(button="left")
        page.mouse.up(button="right")
    elif what == "wheel":
        page.mouse.move(x, y)
        page.mouse.wheel(0, chance.choice((-100, 100)))
    elif what == "key":
        page.mouse.move(x, y)
        page.keyboard.press(chance.choice(tuple("wsadrfqe12v,.")), delay=chance.uniform(0, 200))
    elif what == "row":
        page.get_by_role("list", name="Elements").locator(".v-list-item").nth(chance.randrange(5)).click()
    elif what == "slider":
        thumb = page.locator(".v-navigation-drawer .v-slider-thumb").first
        box = thumb.bounding_box() if thumb.count() else None
        if box:
            page.mouse.move(box["x"] + 10, box["y"] + 10)
            page.mouse.down()
            page.mouse.move(box["x"] + chance.uniform(-40, 60), box["y"] + 10, steps=5)
            page.mouse.up()
    elif what == "number":
        field = page.locator(".v-navigation-drawer input[type=number]").first
        if field.count():
            field.fill(chance.choice(("", "0", "-1", "0.5", "0.9", "1e9", "3")))
            field.press("Enter")
    elif what == "undo":
        page.get_by_label(chance.choice(("Undo", "Redo")), exact=True).click(force=True)
    elif what == "cut":
        page.get_by_label(f"Cut across {chance.choice('xyz')}").click()
    else:
        page.get_by_label(chance.choice(("First view", "View before", "View after"))).click()


@pytest.fixture
def nothing_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No kernel of earlier processes: the compiler, which is large, is loaded at the beginning."""
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))


@pytest.mark.nightly
@pytest.mark.usefixtures("nothing_compiled")
def test_half_an_hour_of_random_input_takes_no_memory(served: Served) -> None:
    page, chance, memory = served.page, random.Random(1), Path(f"/proc/{served.process}/statm")
    session = page.context.new_cdp_session(page)
    page.set_default_timeout(3000)
    begin, marks = time.monotonic(), []
    while (now := time.monotonic() - begin) < SOAK:
        with suppress(playwright.TimeoutError):  # what was there a moment before may be gone
            act_at_random(page, chance)
        if now > len(marks) * SOAK / 6:
            session.send("HeapProfiler.collectGarbage")
            heap = session.send("Runtime.getHeapUsage")["usedSize"]
            pages = int(memory.read_text().split()[1])
            marks.append((pages * os.sysconf("SC_PAGE_SIZE") / 1e6, heap / 1e6))
    page.set_default_timeout(30000)
    page.get_by_label("First view").click()
    picture(page)
    for first, last in zip(marks[2], marks[-1], strict=True):  # by then all is loaded, and caches are full
        assert last < 1.05 * first + 10, marks  # megabytes


def test_a_film_is_made_of_views(served: Served) -> None:
    page = served.page
    page.get_by_role("button", name="Film", exact=True).click()
    panel = page.get_by_role("region", name="Film")
    panel.get_by_role("button", name="Key view").click()
    panel.get_by_label("camera.eye at 0 s").wait_for()
    panel.get_by_label("Length of the film").fill("1")
    panel.get_by_label("Length of the film").press("Enter")
    wait_until(lambda: 'duration="1s"' in text(page))
    panel.locator(".v-slider-thumb").press("End")
    panel.get_by_text("1.00 s of").wait_for()
    page.mouse.move(700, 300)
    page.mouse.down()
    page.mouse.move(760, 320, steps=4)
    page.mouse.up()
    panel.get_by_role("button", name="Key view").click()
    wait_until(lambda: text(page).count("; 1s:") == 2)
    panel.get_by_label("curve of values of camera.target").click()
    panel.get_by_label("camera.target 3 at 1 s").click()
    handle = panel.get_by_title("Slope", exact=True).first.bounding_box()
    assert handle
    page.mouse.move(handle["x"] + 6, handle["y"] + 6)
    page.mouse.down()
    page.mouse.move(handle["x"] + 6, handle["y"] + 26, steps=4)
    page.mouse.up()
    wait_until(lambda: 'slopes="1s: ' in text(page))
    panel.get_by_role("button", name="Back").click()
    panel.get_by_label("Play", exact=True).click()
    panel.get_by_label("Pause").wait_for()
    panel.get_by_text("1.00 s of").wait_for()
    page.get_by_role("button", name="Film", exact=True).click()


def test_a_gamepad_flies(served: Served) -> None:
    page = served.page
    before = picture(page)
    page.evaluate("navigator.getGamepads = () => [{axes: [0.9, 0, 0, 0.05], buttons: []}]")
    wait_until(lambda: page.locator(".v-main img").first.screenshot() != before)
    page.evaluate("navigator.getGamepads = () => [{axes: [0, 0, 0, 0], buttons: []}]")
    page.wait_for_timeout(100)
    page.evaluate("navigator.getGamepads = () => []")


def press_until(page: playwright.Page, key: str, what: str) -> None:
    """Press a key until what has the focus is so; an expression of it, `e`."""
    for _ in range(100):
        page.keyboard.press(key)
        if page.evaluate(f"(e => {what})(document.activeElement)"):
            return
    pytest.fail(f"{key} leads to nothing with {what}")


def test_the_keyboard_alone_suffices(served: Served) -> None:
    page = served.page
    press_until(page, "Tab", "e.closest('[aria-label=Elements]')")
    press_until(page, "ArrowDown", "e.textContent.includes('sphere')")
    page.keyboard.press("Enter")
    page.get_by_label("radius 1 as a number").wait_for()
    press_until(page, "Tab", "e.role === 'slider'")
    page.keyboard.press("ArrowRight")
    wait_until(lambda: 'radius="0.5"' not in text(page))
    before = picture(page)
    press_until(page, "Tab", "e.querySelector('img') && e.tabIndex === 0")
    page.keyboard.down("w")
    wait_until(lambda: page.locator(".v-main img").first.screenshot() != before)
    page.keyboard.up("w")
    page.keyboard.press("Control+z")
    wait_until(lambda: text(page) == SCENE)
    page.keyboard.press("?")
    page.get_by_text("turn around what is under the mouse").wait_for()
    page.keyboard.press("Escape")
    page.get_by_text("turn around what is under the mouse").wait_for(state="hidden")


def test_the_page_can_be_used_by_those_who_do_not_see_it_well(served: Served) -> None:
    """Labels, contrast, landmarks, by the rules of axe-core."""
    page = served.page
    page.get_by_role("button", name="Film", exact=True).click()
    page.get_by_role("region", name="Film").wait_for()
    for _ in "light", "dark":
        page.get_by_label("Light or dark").click()
        page.wait_for_timeout(400)  # colours fade
        found = {problem["id"] for problem in axe.Axe().run(page).response["violations"]}
        assert found <= {"meta-viewport"}  # of the frame of trame
