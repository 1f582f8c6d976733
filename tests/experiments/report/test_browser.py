"""The pages in headless Chromium: light and dark, wide and narrow, on paper, without a network."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from analytic_heaps import AnalyticHeaps, twin_of_one_angle
from axe_playwright_python.sync_playwright import Axe
from cone_engine import resting
from discoveries import made_discovery
from playwright.sync_api import Browser, BrowserContext, Page

from doe.discrepancy import Settings, Verdict
from experiments.calibrate import Campaign, calibrate
from experiments.report import HeapPicture, SolidHeap, discovery, kit, render_page
from experiments.report.kit.theme import DARK, LIGHT
from experiments.studyfile import Study

pytestmark = pytest.mark.program("chromium")

PATIENCE = 240_000
"""Milliseconds that a page may take where a dozen processes share a core and WebGL is drawn in software."""

SHOWN = ((1280, "light"), (390, "dark"))
"""Windows: width and colours."""

THROUGH = """async () => {
  for (let y = 0; y < document.documentElement.scrollHeight; y += window.innerHeight) {
    window.scrollTo({ top: y, behavior: "instant" });
    await new Promise((next) => requestAnimationFrame(() => requestAnimationFrame(next)));
  }
  while ([...document.querySelectorAll(".plot")].some((place) => !place.querySelector(".main-svg, canvas"))) {
    await new Promise((next) => setTimeout(next, 50));
  }
}"""
"""Shows a page from its top to its end, as a reader would, until every chart is drawn."""


@dataclass(frozen=True)
class Opened:
    """A page that was read to its end, and what the browser said of it."""

    page: Page
    width: int
    scheme: str
    said: list[str] = field(default_factory=list)


def small_heap() -> SolidHeap:
    """Return a heap of forty clumps of two spheres."""
    place = np.random.default_rng(1).uniform([-0.02, -0.02, 0.002], [0.02, 0.02, 0.012], (40, 3))
    clump = [[-0.001, 0.0, 0.0, 0.002], [0.001, 0.0, 0.0, 0.002]]
    packed = SolidHeap.of("A heap.", resting(place, clump))
    assert packed is not None
    return packed


@pytest.fixture(scope="module")
def files(
    tmp_path_factory: pytest.TempPathFactory,
    terms,
    whole_study: Study,
    plotly: str,
) -> dict[str, Path]:
    """Return a calibration's page and a search's, with all that they can hold."""
    folder, picture = (
        tmp_path_factory.mktemp("pages"),
        HeapPicture("Heap", "A heap.", np.zeros((8, 12, 3), np.uint8)),
    )
    study = twin_of_one_angle()
    found: Campaign = calibrate(study, AnalyticHeaps())
    monkeypatch = pytest.MonkeyPatch()
    monkeypatch.setattr(kit.html, "get_plotlyjs", lambda: plotly)
    pages = {
        "calibration": render_page(found, study, [picture], {"device": "cpu"}, solid=small_heap()),
        "search": discovery.render_discovery(
            made_discovery(Verdict.NAMED), whole_study, terms, Settings(), [picture], ["study-with.toml"],
            {"device": "cpu"}, solid=small_heap(),
        ),
    }  # fmt: skip
    monkeypatch.undo()
    for name, text in pages.items():
        (folder / f"{name}.html").write_text(text, encoding="utf-8")
    return {name: folder / f"{name}.html" for name in pages}


def read_through(context: BrowserContext, file: Path, width: int, scheme: str) -> Opened:
    context.set_default_timeout(PATIENCE)
    context.set_offline(True)
    page = context.new_page()
    opened = Opened(page, width, scheme)
    page.on("console", lambda message: opened.said.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: opened.said.append(str(error)))
    page.goto(file.as_uri())
    page.evaluate(THROUGH)
    return opened


@pytest.fixture(
    scope="module",
    params=[(name, *shown) for name in ("calibration", "search") for shown in SHOWN],
    ids=lambda shown: "-".join(map(str, shown)),
)
def opened(request: pytest.FixtureRequest, chromium: Browser, files: dict[str, Path]) -> Iterator[Opened]:
    name, width, scheme = request.param
    context = chromium.new_context(viewport={"width": width, "height": 1600}, color_scheme=scheme)
    yield read_through(context, files[name], width, scheme)
    context.close()


@pytest.fixture
def calibration(chromium: Browser, files: dict[str, Path]) -> Iterator[Page]:
    """Return a calibration's page on a phone with a finger."""
    context = chromium.new_context(viewport={"width": 390, "height": 1600}, has_touch=True)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.goto(files["calibration"].as_uri())
    yield page
    context.close()


def test_a_page_opens_without_an_error(opened: Opened) -> None:
    assert opened.said == []


def test_no_page_is_wider_than_its_window(opened: Opened) -> None:
    assert opened.page.evaluate("document.documentElement.scrollWidth") == opened.width


def test_axe_finds_nothing(opened: Opened) -> None:
    found = Axe().run(opened.page)
    assert found.violations_count == 0, found.generate_report()


def test_what_is_too_wide_scrolls_in_its_box_and_says_so(opened: Opened) -> None:
    boxes = opened.page.evaluate(
        """() => {
          const boxes = [...document.querySelectorAll(".table, .sweep")];
          return boxes.filter((box) => box.checkVisibility()).map((box) => ({
            hidden: box.scrollWidth - box.clientWidth,
            cue: getComputedStyle(box, "::before").content.includes("Scroll sideways"),
            fades: getComputedStyle(box).maskImage !== "none",
            scrolls: getComputedStyle(box).overflowX === "auto",
            stop: box.tabIndex === 0,
          }));
        }"""
    )
    cut = [box for box in boxes if box["hidden"] > 1]
    assert len(boxes) > 5
    assert all(box["cue"] and box["fades"] and box["scrolls"] and box["stop"] for box in cut)
    assert not any(box["cue"] or box["stop"] for box in boxes if box not in cut)
    if opened.width == 390:
        assert cut


def test_a_map_has_room_for_the_numbers_of_its_columns(opened: Opened) -> None:
    maps = opened.page.evaluate(
        """() => [...document.querySelectorAll(".sweep.broad")].map((box) => ({
          columns: Number(box.style.getPropertyValue("--columns")),
          drawn: document.getElementById(box.querySelector(".plot").id).data[0].x.length,
          width: box.querySelector(".plot").clientWidth,
          em: parseFloat(getComputedStyle(document.documentElement).fontSize),
        }))"""
    )
    assert bool(maps) is ("search" in opened.page.url)
    for each in maps:
        assert each["columns"] == each["drawn"]
        if opened.width == 390:  # 2.6 em a column, and nine for the names of the rows
            assert each["width"] >= (9.0 + 2.6 * each["columns"]) * each["em"] - 1.0


def test_charts_lie_inside_their_boxes_in_the_colours_of_the_page(opened: Opened) -> None:
    charts = opened.page.evaluate(
        """() => {
          const right = (element) => element.getBoundingClientRect().right;
          return [...document.querySelectorAll(".plot")].map((place) => ({
            over: Math.max(...[...place.querySelectorAll(".main-svg")].map((one) => right(one)))
                - right(place),
            ends: Math.min(right(place), right(place.parentElement)),
            ink: place.layout.font.color,
          }));
        }"""
    )
    colors = DARK if opened.scheme == "dark" else LIGHT
    assert len(charts) > 5
    assert all(chart["over"] < 1.0 and chart["ends"] <= opened.width for chart in charts)
    assert {chart["ink"] for chart in charts} == {colors["ink"]}


def test_paper_is_light_and_holds_everything(opened: Opened) -> None:
    page = opened.page
    page.emulate_media(media="print")
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    try:
        paper = page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--paper').trim()")
        inks = page.evaluate(
            "[...document.querySelectorAll('.plot')].map((place) => place.layout.font.color)"
        )
        closed = page.locator("main details:not([open])").count()
        study = page.get_by_text("Every key of the study file").is_visible()
        still = page.locator(".solid .still img").is_visible()
        wide = page.evaluate("[...document.querySelectorAll('.plot')].map((place) => place.layout.width)")
    finally:
        page.evaluate("window.dispatchEvent(new Event('afterprint'))")
        page.emulate_media(media="screen")
    assert (paper, set(inks), closed, study, still) == (LIGHT["paper"], {LIGHT["ink"]}, 0, True, True)
    assert set(wide) <= {320, 660}
    assert page.locator("main details:not([open])").count() > 0


def test_texts_are_copied_without_a_clipboard(calibration: Page) -> None:
    # Pages from a disk may have none.
    calibration.evaluate("Object.defineProperty(navigator, 'clipboard', { value: undefined })")
    calibration.evaluate(
        "window.copied = ''; document.addEventListener('copy', () => (copied = getSelection().toString()))"
    )
    for name in ("methods-markdown", "methods-latex", "table-markdown", "table-latex"):
        button = calibration.locator(f"[data-copy='paste-{name}']")
        button.click()
        assert button.inner_text() == "Copied"
        text = calibration.locator(f"#paste-{name}").text_content()
        assert calibration.evaluate("copied").split() == str(text).split()


PICTURE = "document.querySelector('.scene').toDataURL()"


def test_a_heap_turns_by_key_button_mouse_and_finger(calibration: Page) -> None:
    figure = calibration.locator(".solid")
    scene = figure.locator(".scene")
    figure.get_by_role("button", name="Turn it in 3-D").click()
    assert not figure.locator(".still").is_visible()
    seen = [""]

    def turned() -> None:
        """Check that the canvas shows another picture."""
        calibration.wait_for_function(
            "(before) => document.querySelector('.scene').toDataURL() !== before", arg=seen[-1]
        )
        seen.append(calibration.evaluate("document.querySelector('.scene').toDataURL()"))

    turned()
    scene.press("ArrowRight")
    turned()
    scene.press("ArrowUp")
    turned()
    figure.get_by_role("button", name="Turn left").click()
    turned()
    scene.press("+")
    turned()
    box = scene.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    calibration.mouse.move(x, y)
    calibration.mouse.down()
    calibration.mouse.move(x + 60, y, steps=8)
    calibration.mouse.up()
    turned()
    touch = calibration.context.new_cdp_session(calibration)
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    for step in range(1, 9):
        point = {"x": x - 8 * step, "y": y}
        touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [point]})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    turned()
    figure.get_by_role("button", name="Colour by height").click()
    turned()
    assert "mm" in figure.locator(".scale").inner_text()
