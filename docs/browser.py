"""Pages in headless Chromium: every page of a folder without an error, or a picture of one.

``python docs/browser.py check out/site --pictures out/pictures``
``python docs/browser.py picture report.html report.png``

Needs Chromium or Chrome, and playwright (``pip install -e ".[docs]"``).
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "chrome")
WIDTHS = (1280, 390)
SCHEMES = ("light", "dark")
LONGEST = 16_000
"""Pixels of a picture: Chromium draws no longer one."""


@contextmanager
def browser() -> Iterator[Browser]:
    """Start the browser of this machine."""
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        raise SystemExit(f"Error: none of {', '.join(PROGRAMS)} is installed; pages need one of them")
    with sync_playwright() as play:
        running = play.chromium.launch(executable_path=program, args=["--no-sandbox", "--use-gl=swiftshader"])
        yield running
        running.close()


@contextmanager
def opened(running: Browser, file: Path, width: int, scheme: str) -> Iterator[tuple[Page, list[str]]]:
    """Open a page, and collect what its console calls an error, what it raises and what it fails to load."""
    context = running.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page, faults = context.new_page(), []
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("requestfailed", lambda request: faults.append(f"not loaded: {request.url[:200]}"))
    page.goto(file.resolve().as_uri(), wait_until="load")
    yield page, faults
    context.close()


def overflow(page: Page) -> str:
    """Say by how much the page is wider than the window; empty when it is not."""
    wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
    return f"{wide} px wider than the window" if wide > 0 else ""


def check(folder: Path, pictures: Path | None) -> int:
    """Open every page of a folder at every width in every scheme; return the number of faults."""
    pages = sorted(folder.rglob("*.html"))
    if not pages:
        raise SystemExit(f"Error: {folder} has no page")
    count = 0
    with browser() as running:
        for file in pages:
            name = file.relative_to(folder).with_suffix("").as_posix()
            for width in WIDTHS:
                for scheme in SCHEMES:
                    with opened(running, file, width, scheme) as (page, faults):
                        found = [*faults, *filter(None, [overflow(page)])]
                        if pictures is not None:
                            draw(page, pictures / f"{name.replace('/', '-')}-{width}-{scheme}.png")
                    for fault in found:
                        print(f"{name}, {width} px, {scheme}: {fault}")
                    count += len(found)
    print(f"{len(pages)} pages, {len(WIDTHS)} widths, {len(SCHEMES)} schemes: {count} faults")
    return count


def draw(page: Page, file: Path) -> None:
    """Draw the whole page."""
    file.parent.mkdir(parents=True, exist_ok=True)
    height = min(page.evaluate("document.documentElement.scrollHeight"), LONGEST)
    size = page.viewport_size or {"width": WIDTHS[0]}
    page.screenshot(
        path=file, clip={"x": 0, "y": 0, "width": size["width"], "height": height}, full_page=True
    )


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    checked = commands.add_parser("check", help="open every page of a folder")
    checked.add_argument("folder", type=Path)
    checked.add_argument("--pictures", type=Path, help="folder of a picture of each")
    drawn = commands.add_parser("picture", help="draw one page")
    drawn.add_argument("page", type=Path)
    drawn.add_argument("file", type=Path)
    drawn.add_argument("--width", type=int, default=WIDTHS[0])
    drawn.add_argument("--height", type=int, default=900, help="part of the page, from the top")
    drawn.add_argument("--at", default="", help="CSS selector to begin at")
    given = parser.parse_args()
    if given.command == "check":
        sys.exit(1 if check(given.folder, given.pictures) else 0)
    with browser() as running, opened(running, given.page, given.width, "light") as (page, faults):
        page.set_viewport_size({"width": given.width, "height": given.height})
        if given.at:
            page.locator(given.at).first.evaluate("element => element.scrollIntoView()")
        page.wait_for_timeout(500)  # charts are drawn after the page has loaded
        page.screenshot(path=given.file)
        if faults:
            raise SystemExit("Error: " + "; ".join(faults))


if __name__ == "__main__":
    main()
