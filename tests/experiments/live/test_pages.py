"""The pages in headless Chromium: what they show of runs, without an error and without a look elsewhere."""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import trimesh
from conftest import OTHER, begin, photograph
from playwright.sync_api import Browser, Page

from dem_warp import Case, CaseResult, Progress
from experiments import api
from experiments.cases import Store
from experiments.live import server
from experiments.live.run_charts import charts_of
from experiments.live.run_state import RunState
from experiments.live.server import Place, serving
from experiments.live.ui.start_routes import ui_app
from experiments.measurement.case_observables import Observed
from experiments.studyfile import Study, load_study

pytestmark = pytest.mark.program("chromium")

Cone = Callable[..., CaseResult]
Serve = Callable[[Path], Place]

PATIENCE = 90_000
"""Longest wait for what a page should show [ms]; a machine may be busy."""

PAINTED = """[...document.querySelectorAll('canvas')].filter((canvas) => canvas.width && canvas
  .getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((value) => value)).length"""
"""Number of heaps that are drawn."""

FAINT = """(() => {
  const light = (color) => {
    const [r, g, b] = color.match(/[\\d.]+/g).slice(0, 3).map((c) => c / 255).map(
      (c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const color = getComputedStyle(at).backgroundColor;
      if (!color.endsWith(', 0)')) return color;
    }
    return 'rgb(255, 255, 255)';
  };
  const faint = [];
  for (const element of document.querySelectorAll('body *')) {
    const text = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!text || !element.checkVisibility() || element.closest('svg') || element.disabled) continue;
    const [a, b] = [light(getComputedStyle(element).color), light(behind(element))].sort((x, y) => y - x);
    if ((a + 0.05) / (b + 0.05) < 4.5) faint.push(element.textContent.trim().slice(0, 40));
  }
  return faint;
})()"""
"""Texts whose contrast is below the 4.5 of WCAG 2.1, AA."""

UNNAMED = """[...document.querySelectorAll('input, select, textarea, button, canvas, progress, a')]
  .filter((each) => each.checkVisibility() && !(each.labels?.length || each.getAttribute('aria-label')
  || each.textContent.trim())).map((each) => each.outerHTML.slice(0, 80))"""
"""Controls and pictures without a name for who cannot see them."""


@contextmanager
def browsing(chromium: Browser, url: str) -> Iterator[Page]:
    """Open a page that notes its errors and the addresses that it asks for."""
    page = chromium.new_page(viewport={"width": 1280, "height": 900})
    page.set_default_timeout(PATIENCE)
    page.errors, page.asked = [], []
    page.on(
        "console", lambda said: page.errors.append(said.text) if said.type in ("error", "assert") else None
    )
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(url)
    yield page
    page.close()


def wait(page: Page, condition: str) -> None:
    """Wait until an expression is true in the page; what a page does not have yet throws."""
    page.wait_for_function(f"() => {{ try {{ return Boolean({condition}); }} catch {{ return false; }} }}")


def look(page: Page, width: int, dark: bool) -> None:
    """Show a page with a width, light or dark."""
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme="dark" if dark else "light")


def check(page: Page, place: Place) -> None:
    """See that a page has no error, nothing from elsewhere, a name for everything, and room for all."""
    assert page.errors == []
    home = f"http://127.0.0.1:{place.port}/{place.token}/"
    assert [each for each in page.asked if not each.startswith((home, "data:", "blob:"))] == []
    assert page.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
    assert page.evaluate(UNNAMED) == []
    assert page.evaluate(FAINT) == []
    assert page.evaluate("document.querySelectorAll('h1').length") == 1
    assert page.evaluate("document.documentElement.lang") == "en"


LOOKS = [(1280, False), (1280, True), (390, False), (390, True)]


def test_a_run_is_shown_as_it_goes(
    run_folder: Path, small_study: Study, cone: Cone, served: Serve, chromium: Browser
) -> None:
    journal = begin(run_folder, small_study, cone)
    place = served(run_folder)
    with ExitStack() as stack:
        note = stack.enter_context(journal.batch("screening"))
        note(Progress(0, 2, 0.0, {"lift": 1}, 0.0))
        journal._noted = 0.0
        note(Progress(1, 2, 0.5, {"lift": 1}, 30.0))
        page = stack.enter_context(browsing(chromium, place.url))
        wait(page, f"{PAINTED} === 2")
        shown = page.evaluate("document.body.innerText")
        assert "30 s left, 50 %, 1 of 2 cases, 1 lift" in shown
        assert "screening, run 2, replicate 1" in shown
        assert "lift, 40 %" in shown
        assert "at rest, 26.5°" in shown
        assert "The run begins." in shown
        assert page.evaluate("document.querySelector('#state').textContent") == "running"
        wait(page, "document.querySelector('.chart .scatterlayer .point')")
        for width, dark in LOOKS:
            look(page, width, dark)
            dark_page = "getComputedStyle(document.body).backgroundColor === 'rgb(18, 22, 28)'"
            wait(page, f"({dark_page}) === {str(dark).lower()}")
            check(page, place)
        # what happens is seen without loading the page anew
        Store(run_folder / "cases").save(OTHER, cone(0.6))
        journal.ended(OTHER, {"status": "finished", "reason": "", "angle": 31.25, "angle_se": 0.5})
        wait(page, "document.body.innerText.includes('at rest, 31.3°')")
        wait(page, f"{PAINTED} === 2")
        wait(page, "document.querySelectorAll('#cases tbody tr').length === 2")
        journal.__exit__(None, None, None)
        wait(page, "document.querySelector('#state').textContent === 'finished'")
        check(page, place)


@pytest.mark.parametrize("ending", ["killed", "failed"])
def test_a_run_that_was_broken_off_is_shown(
    run_folder: Path, small_study: Study, cone: Cone, served: Serve, chromium: Browser, ending: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    journal = begin(run_folder, small_study, cone)
    if ending == "failed":
        journal.__exit__(ValueError, ValueError("the disk is full"), None)
    else:
        journal._ended.set()
        monkeypatch.setattr("experiments.live.run_state.STALE", -1.0)
    place = served(run_folder)
    with browsing(chromium, place.url) as page:
        wait(page, f"{PAINTED} === 2")
        shown = page.evaluate("document.body.innerText")
        assert "last seen: lift, 40 %" in shown
        assert ("The run failed: the disk is full" if ending == "failed" else "No sign of life") in shown
        check(page, place)


def test_a_finished_calibration_is_shown_with_its_report(
    small_study: Study, tmp_path: Path, cone: Cone, served: Serve, chromium: Browser,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """A run of the command's own function, with its stages, tables and report, whose heaps are cones."""

    def heaps(cases: Sequence[Case], *, on_result: Callable[[int, CaseResult], None], **_: object) -> None:
        for number, case in enumerate(cases):
            angle = 15.0 + 30.0 * case.grain_grain.static_friction + 0.3 * math.sin(12.9898 * case.seed)
            heap = cone(math.tan(math.radians(angle)), radius=1.5e-3)
            on_result(number, replace(heap, observables={"angle": angle}))

    def observed(_: object, result: CaseResult, __: object) -> Observed:
        return Observed(dict(result.observables), SimpleNamespace(se=0.1))  # type: ignore[arg-type]

    monkeypatch.setattr("experiments.cases.workers.own.simulate", heaps)
    monkeypatch.setattr("experiments.cases.execute.observe", observed)
    folder = tmp_path / "out"
    found = api.calibrate(small_study.file, folder, device="cpu").campaign
    place = served(folder)
    with browsing(chromium, place.url) as page:
        wait(page, f"{PAINTED} === 12")
        for decision in found.decisions:
            assert decision.outcome in page.evaluate("document.querySelector('#stages').innerText")
        assert page.evaluate("document.querySelectorAll('#cases tbody tr').length") == len(found.cases)
        assert page.evaluate("document.querySelectorAll('.chart').length") == len(
            charts_of(RunState.read(folder))
        )
        # every chart has all of its room, and no more
        wait(
            page,
            "[...document.querySelectorAll('.chart')].every((chart) => "
            "Math.abs(chart.clientWidth - chart.querySelector('svg').clientWidth) < 2)",
        )
        check(page, place)
    with browsing(chromium, f"{place.url}file/report.html") as page:
        wait(page, "document.querySelector('h1')")
        assert page.errors == []


def test_the_page_of_a_run_shows_its_end(
    run_folder: Path, small_study: Study, cone: Cone, chromium: Browser
) -> None:
    """`--live` serves a moment longer than the run lasts."""
    said: list[str] = []
    with ExitStack() as stack:
        live = stack.enter_context(server.live_page(run_folder, True, said.append))
        assert live is None
        journal = begin(run_folder, small_study, cone)
        [line] = said
        page = stack.enter_context(browsing(chromium, line.removeprefix("Live: ")))
        wait(page, "document.querySelector('#state').textContent === 'running'")
        journal.__exit__(None, None, None)
        wait(page, "document.querySelector('#state').textContent === 'finished'")
        assert page.errors == []


def test_a_heap_turns_by_the_arrow_keys(
    run_folder: Path, small_study: Study, cone: Cone, served: Serve, chromium: Browser
) -> None:
    begin(run_folder, small_study, cone)
    with browsing(chromium, served(run_folder).url) as page:
        wait(page, f"{PAINTED} === 2")
        picture = "document.querySelector('canvas').toDataURL()"
        before = page.evaluate(picture)
        page.locator("canvas").first.press("ArrowLeft")
        wait(page, f"{picture} !== {before!r}")


@pytest.fixture
def start_page(tmp_path: Path):  # type: ignore[no-untyped-def]
    """Serve the page to start from: its place, and its folder."""
    folder = tmp_path / "work"
    folder.mkdir()
    place = Place.open()
    with serving(place, ui_app(folder, place.token)):
        yield place, folder


READY = "document.documentElement.dataset.ready"


def test_the_start_page_is_readable_and_fits(start_page: tuple[Place, Path], chromium: Browser) -> None:
    place, _ = start_page
    with browsing(chromium, place.url) as page:
        wait(page, READY)
        for width, dark in LOOKS:
            look(page, width, dark)
            check(page, place)


@pytest.mark.usefixtures("_coarse_clumps")
def test_from_an_stl_to_a_heap_in_the_browser(
    start_page: tuple[Place, Path], chromium: Browser, tmp_path: Path
) -> None:
    """Grain from an STL with its preview, test, ranges, study file, start, watch: by clicks alone."""
    place, folder = start_page
    stl = tmp_path / "grain.stl"
    trimesh.creation.capsule(height=2.0, radius=1.5, count=(16, 16)).export(stl)
    with browsing(chromium, place.url) as page:
        wait(page, READY)
        page.fill("#name", "rye")
        page.click("input[value=file]")
        page.set_input_files("#mesh", stl)
        page.fill("#spheres", "2")
        page.click("#preview")
        wait(page, f"{PAINTED} === 2")
        assert "2 spheres, volume" in page.evaluate("document.querySelector('#clump-words').innerText")
        command = page.evaluate("document.querySelector('#clump-command').innerText")
        assert command.startswith("dem-warp clump grain.stl --spheres 2 --protrusion auto")
        # a wrong value gets the message of the command line
        page.fill("[data-place='grain.density']", "heavy")
        page.click("#draft")
        wait(page, "document.querySelector('#draft-error').innerText.includes('rye.toml')")
        assert "got 'heavy'" in page.evaluate("document.querySelector('#draft-error').innerText")
        page.fill("[data-place='grain.density']", "1200 kg/m^3")
        page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
        settings = {"diameter": "28 mm", "height": "28 mm", "grain_count": "30"}
        for key, value in settings.items():
            page.fill(f"[data-place='scene.lifted-cylinder.{key}']", value)
        page.fill("[data-place='numerics.modulus_scale']", "400")
        page.click("#draft")
        wait(page, "document.querySelector('#text').value.includes('1200 kg/m^3')")
        page.click("#write")
        wait(page, "document.querySelector('#written').innerText === 'Wrote rye.toml.'")
        study = load_study(folder / "rye.toml")
        assert study.case({}, seed=1).grains.shape.sphere_count == 2
        wait(page, "document.querySelector('#study').value === 'rye.toml'")
        page.select_option("#command", "heap")
        page.fill("#device", "cpu")
        page.fill("#scale", "moon")
        page.click("#start")
        wait(page, "document.querySelector('#run-error').innerText.includes('moon')")
        # a slow press ends the change of the field: the error goes, the command comes, and the press counts
        page.fill("#scale", "")
        page.hover("#start")
        page.mouse.down()
        command = "dem-warp heap rye.toml --out out/rye-heap-1 --device cpu"
        wait(page, f"document.querySelector('#run-command').innerText === {command!r}")
        page.mouse.up()
        wait(page, "document.querySelector('#runs .badge.finished')")
        check(page, place)
        link = page.evaluate("document.querySelector('#runs a').href")
        page.goto(link)
        wait(page, f"{PAINTED} === 1")
        assert page.evaluate("document.querySelector('h1').innerText") == "rye"
        check(page, place)
    assert (folder / "out" / "rye-heap-1" / "heap.vtp").is_file()


def test_photographs_become_the_target(
    start_page: tuple[Place, Path], chromium: Browser, tmp_path: Path
) -> None:
    place, folder = start_page
    pictures = [tmp_path / f"{number}.png" for number in range(3)]
    for path, slope in zip(pictures, (0.5, 0.55, 0.6), strict=True):
        path.write_bytes(photograph(slope))
    with browsing(chromium, place.url) as page:
        wait(page, READY)
        page.click("input[value=pictures]")
        page.set_input_files("#photos", pictures)
        page.click("#draft")  # pictures that were not measured are measured now
        wait(page, "document.querySelector('#text').value.includes('pictures = \"mygrain-photos\"')")
        page.click("#measure")
        wait(page, "!document.querySelector('#measure').disabled")
        assert page.evaluate("document.querySelectorAll('#angles tbody tr').length") == 3
        assert page.evaluate("document.querySelector('#angles-command').innerText").startswith(
            "dem-warp angle"
        )
        check(page, place)
    assert len(list((folder / "mygrain-photos").iterdir())) == 3
