"""Plain English: how a text begins, and words that the house does not use."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("dem_warp", "doe", "imaging", "experiments", "tests", "docs")

BEGINNING = re.compile(r"(?:Of|By|From|As|At|That|Which|Who|What|Whether|How|Where|So|None)\b")
"""A text that says what something is begins with a noun phrase, one that says what it does with a verb."""

BEGUN = re.compile(rf"""["'](?:\\\\\n)?{BEGINNING.pattern}""")
"""Only a file that has this is parsed."""

DROPPED = re.compile(
    r"\b(?:told|heed(?:s|ed)?|torment\w*|strangers?|crews?|outbox\w*|contenders?|glimpses?|onlookers?|beside"
    r"|so many|see to it|takes? leave|to mend|mended)\b",
    re.IGNORECASE,
)
"""Words that the field does not use: prints, unknown, workers, queue, method, preview, next to, n."""

TEXTS = {".py", ".pyi", ".md", ".toml", ".j2", ".html", ".js", ".css", ".txt"}


def files(suffixes: set[str]) -> Iterator[Path]:
    """Yield the files of the project's folders, without what a build or a record brings."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            generated = {"generated", "record", "__pycache__"} & set(path.relative_to(ROOT).parts)
            if path.suffix in suffixes and path.is_file() and not generated:
                yield path


def place(path: Path, line: int) -> str:
    return f"{path.relative_to(ROOT).as_posix()}:{line}"


def statements(path: Path) -> Iterator[tuple[int, str]]:
    """Yield every string that is a statement: docstrings, and the texts below fields and constants."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield node.lineno, text


def test_a_text_begins_with_what_it_names() -> None:
    wrong = [
        place(path, line)
        for path in files({".py"})
        if BEGUN.search(path.read_text(encoding="utf-8"))
        for line, text in statements(path)
        if BEGINNING.match(text)
    ]
    assert wrong == []


def test_words_that_were_dropped_stay_away() -> None:
    found = [
        f"{place(path, number)}: {match[0]}"
        for path in files(TEXTS)
        if path != Path(__file__).resolve()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        for match in DROPPED.finditer(line)
    ]
    assert found == []
