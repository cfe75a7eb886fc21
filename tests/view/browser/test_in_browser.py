"""The viewers in a real browser: `make browser`. FLOWBORNE_SCREENSHOTS names a folder for them."""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from PIL import Image

import flowborne
import viewer_script
from flowborne.view import style

pytest.importorskip("viser", reason="the viewer needs viser: pip install 'flowborne[view]'")
playwright = pytest.importorskip(
    "playwright.sync_api", reason="a browser is driven by playwright: make browser"
)

pytestmark = pytest.mark.browser

SOFTWARE = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Options with which Chromium draws WebGL without a graphics card."""

SYSTEM = ("chromium", "chromium-browser", "google-chrome")
"""Names of a browser that the machine may have of its own."""

DIFFERENT = 12.0
"""Levels of 255 by which a colour is another one."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    own = next((path for name in SYSTEM if (path := shutil.which(name))), None)
    with playwright.sync_playwright() as started:
        try:
            found = started.chromium.launch(executable_path=own, args=list(SOFTWARE))
        except playwright.Error:
            pytest.skip("there is no Chromium here: make browser")
        yield found
        found.close()


@pytest.fixture(scope="module", params=["human-wind-back", "ns-block-drag-max"])
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a walker of 150 frames in space, and of a block in a stream."""
    frames = {"human-wind-back": 150, "ns-block-drag-max": 12}[request.param]
    folder = tmp_path_factory.mktemp("runs") / str(request.param)
    flowborne.run(request.param, folder, frames=frames, workers=1, film=False)
    return folder


@contextmanager
def served(*given: str) -> Iterator[str]:
    """Address of a viewer, by its command."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    command = [sys.executable, "-m", "flowborne", *given, "--port", str(port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            line = next(line for line in process.stdout if line.startswith(("viewing", "playing")))
            assert str(port) in line
            yield f"http://127.0.0.1:{port}"
        finally:
            process.send_signal(signal.SIGINT)


def picture(page: Any) -> np.ndarray:
    """(height, width, 3) what the page shows of the run, without the panel."""
    image = Image.open(BytesIO(page.screenshot())).convert("RGB")
    return np.asarray(image, float)[:, : image.width - 380]


def drawn(image: np.ndarray) -> float:
    """Part of an image that is not the colour of still water."""
    water = 255.0 * style.rgb(style.WATER)
    return float((np.abs(image - water).max(axis=-1) > DIFFERENT).mean())


def opened(browser: Any, address: str) -> tuple[Any, float]:
    """Page of a viewer once there is something on it, and s that it took."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    before = monotonic()
    page.goto(address)
    # viser tells of drawing without a graphics card
    page.add_style_tag(content=".mantine-Notifications-root { display: none }")
    while drawn(picture(page)) < 0.02:
        assert monotonic() - before < 60.0, "nothing was drawn in a minute"
    return page, monotonic() - before


def put(page: Any, label: str, value: float) -> None:
    """Type a number beside a slider, and wait until it has been sent: a page sends the last one of
    those within some hundredths of a second."""
    box = page.locator(f'xpath=//label[.="{label}"]/following::input[@type="text"][1]')
    box.fill(str(value))
    box.press("Enter")
    sleep(0.3)


def pick(page: Any, label: str, option: str) -> None:
    """Choose from a list."""
    page.locator(f'xpath=//label[.="{label}"]/following::input[1]').click()
    page.get_by_role("option", name=option, exact=True).click()


def seek(page: Any, time: float) -> None:
    """Type a time beside the slider, and wait until it is shown."""
    put(page, "time (s)", time)
    page.get_by_text(f"t = {time:.3f} s").wait_for()
    sleep(1.0)


def test_first_picture_and_three_moments(browser: Any, run: Path, tmp_path: Path) -> None:
    """Bodies move from moment to moment, and the panel says when."""
    shots = Path(os.environ.get("FLOWBORNE_SCREENSHOTS", tmp_path))
    shots.mkdir(parents=True, exist_ok=True)
    times = flowborne.open_run(run).times
    with served("view", str(run)) as address:
        page, seconds = opened(browser, address)
        assert page.title() == f"{run.name} – flowborne"
        label = page.locator('xpath=//label[text()="time (s)"]')
        colour = label.evaluate("one => getComputedStyle(one).color")
        assert colour == f"rgb({', '.join(str(round(255 * x)) for x in style.rgb(style.MUTED))})"
        print(f"{run.name}: first picture after {seconds:.2f} s")
        moments = []
        for n, share in enumerate((0.25, 0.5, 1.0)):
            seek(page, round(float(times[round(share * (len(times) - 1))]), 3))
            moments.append(picture(page))
            page.screenshot(path=shots / f"{run.name}-{n}.png")
        page.get_by_text("camera", exact=True).click()
        page.get_by_text("[film.camera]").wait_for()
        page.close()
    for before, after in itertools.pairwise(moments):
        assert (np.abs(after - before).max(axis=-1) > DIFFERENT).mean() > 0.005
    assert all(drawn(image) > 0.02 for image in moments)


def test_a_phone_and_a_server_that_ends(browser: Any, tmp_path: Path) -> None:
    """The panel is one row until it is tapped, controls have names, and nothing is an error."""
    run = flowborne.run("ns-block-drag-max", tmp_path / "run", frames=1, workers=1, film=False)
    page, errors = browser.new_page(viewport={"width": 390, "height": 844}), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda said: errors.append(said.text) if said.type == "error" else None)
    with served("view", str(run.folder)) as address:
        page.goto(address)
        title = page.get_by_text("ns-block-drag-max", exact=True)
        title.wait_for()
        page.wait_for_function("document.querySelector('[data-shut]')")
        sleep(1.0)
        assert title.bounding_box()["y"] > 780.0
        title.click()
        page.get_by_role("button", name="next frame").click()
        page.get_by_text("frame 1 of 1").wait_for()
        assert page.get_by_role("slider", name="time (s)").count() == 1
        assert not errors
    page.get_by_text("flowborne has ended").wait_for(timeout=15_000)
    page.close()


def lean(run: flowborne.OpenRun) -> np.ndarray:
    """(n,) degrees by which the thorax leans forward in each state."""
    thorax = run.bodies.index("thorax")
    up = run.every("body_rotation")[:, thorax] @ [0.0, 0.0, 1.0]
    return np.degrees(np.arctan2(up[:, 0], up[:, 2]))


def test_a_walker_that_is_played_leans_the_other_way(browser: Any, tmp_path: Path) -> None:
    """The wind is turned in the page; what was played is recorded, and repeated bit for bit."""
    shots = Path(os.environ.get("FLOWBORNE_SCREENSHOTS", tmp_path))
    shots.mkdir(parents=True, exist_ok=True)
    played = tmp_path / "played"
    with served("play", "human-wind-back", "--out", str(played)) as address:
        page, _ = opened(browser, address)
        pick(page, "input motion", "beside")
        sleep(3.0)
        page.screenshot(path=shots / "play-0.png")
        put(page, "lower_back (°/s)", 60)
        put(page, "direction (°)", 0)
        put(page, "speed (m/s)", 16)
        sleep(4.0)
        page.screenshot(path=shots / "play-1.png")
        print(page.get_by_text("frames a second").inner_text())
        page.get_by_role("button", name="pause").click()
        page.get_by_text("paused").wait_for()
        page.get_by_role("button", name="save as a run").click()
        page.get_by_text("they repeat what was played, bit for bit").wait_for(timeout=60_000)
        page.screenshot(path=shots / "play-2.png")
        page.close()
    again = flowborne.run(played / "scene.toml", tmp_path / "again", film=False)
    run, repeated = flowborne.open_run(played), flowborne.open_run(again.folder)
    assert len(run) == len(repeated)
    for name, values in run.state(-1).items():
        assert np.array_equal(values, repeated.state(-1)[name])
    changes = flowborne.load_scene(played / "scene.toml").changes
    assert changes[-1].values == {"wind.0.velocity": [16.0, 0.0, 0.0]}
    leaning, second = lean(run), round(run.frames_per_second)
    first, last = (int(np.searchsorted(run.times, changes[n].time)) for n in (0, -1))
    before, after = leaning[first - second : first].mean(), leaning[last + second]
    print(f"leaning {before:.1f}° before the wind turned, {after:.1f}° a second of the walk later")
    assert before > 3.0
    assert after < -3.0


def test_a_recorded_run_turns_without_a_server(browser: Any, tmp_path: Path) -> None:
    """A card of the front page of the documentation, from a disc."""
    static = Path(__file__).parents[3] / "docs" / "static"
    for name in ("turn.js", "turn/fish-robot.js"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(static / name, tmp_path / name)
    (tmp_path / "turn" / "three.js").write_text(viewer_script.three(), encoding="utf-8")
    (tmp_path / "index.html").write_text(
        '<script src="turn.js"></script><ul id="runs-to-turn"><li>'
        '<a href="#"><img alt="A fish"></a><code>flowborne run fish-robot</code></li></ul>',
        encoding="utf-8",
    )
    page, asked = browser.new_page(viewport={"width": 390, "height": 844}), []
    page.on("request", lambda request: asked.append(request.url))
    page.goto((tmp_path / "index.html").as_uri())
    assert [url.rsplit("/", 1)[1] for url in asked] == ["index.html", "turn.js"]
    page.get_by_role("button", name="Turn: A fish").click()
    fish = page.locator("canvas")
    fish.wait_for()
    assert fish.get_attribute("aria-label") == "A fish"
    before = fish.screenshot()
    sleep(1.0)
    assert fish.screenshot() != before
    assert {url.partition(":")[0] for url in asked} <= {"file", "blob", "data"}
    page.close()
