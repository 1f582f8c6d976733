"""Put a benchmark's results into the record: tables and pictures into record/, its page into README.md.

    python -m experiments.evidence.performance.performance_record out/throughput throughput-cpu
    python -m experiments.evidence.performance.performance_record out/cost cost-gpu

README.md keeps each page between two comments that name it; what stood there is replaced.
"""

import shutil
from pathlib import Path
from typing import Annotated

import typer

HERE = Path(__file__).parent


def record_page(folder: Path, name: str, readme: Path, record: Path) -> None:
    """Put one benchmark's results, a Markdown page with tables and perhaps pictures, into the record.

    The page goes between the lines ``<!-- begin NAME -->`` and ``<!-- end NAME -->`` of the readme. Tables
    and pictures go to the folder `record` next to it; their suffix is what follows the first dash of NAME.
    """
    pages = sorted(folder.glob("*.md"))
    if len(pages) != 1:
        raise ValueError(f"{folder}: must hold one page, got {[page.name for page in pages]}")
    text = readme.read_text(encoding="utf-8")
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->\n"
    if text.count(begin) != 1 or text.count(end) != 1 or text.index(end) < text.index(begin):
        raise ValueError(f"{readme}: must hold the lines {begin.strip()!r} and {end.strip()!r}, once each")
    kind = name.partition("-")[2]
    pictures = []
    for path in sorted(folder.iterdir()):
        if path.suffix in {".csv", ".png"}:
            kept = record / f"{path.stem}-{kind}{path.suffix}"
            shutil.copyfile(path, kept)
            if path.suffix == ".png":
                pictures.append(f"\n![{name}]({record.name}/{kept.name})\n")
    page = pages[0].read_text(encoding="utf-8") + "".join(pictures)
    before, after = text[: text.index(begin)], text[text.index(end) :]
    readme.write_text(f"{before}{begin}{page}{after}", encoding="utf-8")


def main(
    folder: Annotated[Path, typer.Argument(help="Folder of the results.")],
    name: Annotated[str, typer.Argument(help="Of the page: throughput-cpu, throughput-gpu, cost-cpu, ...")],
) -> None:
    """Put results into README.md and record/."""
    record_page(folder, name, HERE / "README.md", HERE / "record")


if __name__ == "__main__":
    typer.run(main)
