"""Results as files: a CSV for each table, and one Markdown page to be put into a record."""

import platform
import time
from pathlib import Path

import pandas as pd
import warp as wp


def parse_counts(text: str) -> list[int]:
    """Return the numbers of a list such as "1,12,31".

    Raises
    ------
    ValueError
        If one is not a positive integer.
    """
    words = [word.strip() for word in text.split(",")]
    if not all(word.isdecimal() and int(word) > 0 for word in words):
        raise ValueError(f"must be positive integers separated by commas, got {text!r}")
    return [int(word) for word in words]


def markdown_table(table: pd.DataFrame) -> str:
    """Return a table in Markdown, numbers to four significant digits."""
    rows = [list(table.columns), ["---"] * table.shape[1]]
    rows += [[_cell(value) for value in row] for row in table.itertuples(index=False)]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows) + "\n"


def _cell(value: object) -> str:
    if isinstance(value, str):
        return value
    number = float(value)  # type: ignore[arg-type]
    if pd.isna(number):
        return ""
    if number.is_integer() or abs(number) >= 1000:
        return f"{number:.0f}"
    return f"{number:.4g}" if abs(number) >= 1e-3 else f"{number:.1e}"


def machine(device: str) -> str:
    """Return what a measurement ran on: processor or GPU, Warp, day."""
    target = wp.get_device(device)
    name = target.name if target.is_cuda else f"one core of {_processor()}"
    return f"{name}, Warp {wp.__version__}, {time.strftime('%Y-%m-%d')}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def write_page(folder: Path, name: str, sections: list[tuple[str, str, pd.DataFrame]]) -> Path:
    """Write tables to a folder.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    name : str
        Of the page, `name`.md.
    sections : list of (name, text, table)
        Each table goes to a CSV of its name, and below its text to the page.

    Returns
    -------
    Path
        The page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    parts = []
    for part, text, table in sections:
        table.to_csv(folder / f"{part}.csv", index=False, float_format="%.6g")
        parts.append(f"{text}\n\n{markdown_table(table)}")
    page = folder / f"{name}.md"
    page.write_text("\n".join(parts), encoding="utf-8")
    return page
