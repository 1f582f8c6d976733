"""The documentation without its execution: each command, study, script and link on its pages exists.

``.ci/run`` runs the pages that take seconds, ``.ci/docs`` all; what it noted of the others is held to here.
"""

import ast
import json
import re
import runpy
import shlex
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.main import get_command

from experiments.cli import app
from experiments.studyfile import load_study

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "generated" not in path.parts)
TEXTS = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
NOT_RUN = re.compile(r'^:caption: "Not run (here|by this page): .+"$', re.MULTILINE)
MOST_NOT_RUN = 5
"""Blocks that the build does not run: they need other hardware, other programs or own measurements."""

BASE = Path(__file__).parent / "experiments" / "small.toml"
"""Study that a piece of one is merged over."""

DRUM = {"diameter": "40 mm", "length": "12 mm", "rotation_rate": "15 1/min", "filling": 0.3}
"""Test of the pieces that need one of their own."""

MEASURED = {
    "sieves.csv": "opening,passing_percent\n0.5 mm,2\n1 mm,80\n1.4 mm,100\n",
    "analyser.csv": "diameter\n900\n1000\n1100\n",
    "profiles.csv": "replicate,x,z\n"
    + "".join(f"{n},{x} mm,{0.3 * x + 0.2 * n} mm\n" for n in range(4) for x in range(-18, 19, 2)),
}
"""Files that the pieces name."""

EXECUTED = SimpleNamespace(**runpy.run_path(str(DOCS / "executed.py")))
"""The module that notes which pages were run."""

COMMANDS = get_command(app)
FENCED = re.compile(r"^[ ]*```.*?^[ ]*```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    page: Path
    line: int
    kind: str
    text: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    @property
    def executed(self) -> bool:
        """True for a cell, which the build runs."""
        return self.kind == "{code-cell}"

    @property
    def code(self) -> str:
        """Text without the options of a directive and the line that says what a cell holds."""
        lines = [line for line in self.text.splitlines() if not re.match(r":[\w-]+:", line)]
        return "\n".join(line for line in lines if not line.startswith("%%"))

    @property
    def is_shell(self) -> bool:
        """True for commands."""
        return self.text.startswith("%%bash") or bool(re.search(r"\b(sh|bash|console)$", self.kind))

    @property
    def is_python(self) -> bool:
        """True for Python."""
        return self.kind.endswith("python") or (self.executed and "%%" not in self.text)

    @property
    def is_study(self) -> bool:
        """True for a study file, or a piece of one."""
        return self.kind == "toml" or bool(re.match(r"%%writefile \S+\.toml\n", self.text))


def blocks_of(page: Path) -> Iterator[Block]:
    """Find the fenced blocks of a page."""
    text = page.read_text(encoding="utf-8")
    for found in re.finditer(r"^[ ]*```(\S[^\n]*)?\n(.*?)^[ ]*```$", text, re.MULTILINE | re.DOTALL):
        line = text.count("\n", 0, found.start()) + 1
        yield Block(page, line, (found[1] or "").strip(), found[2])


BLOCKS = [block for page in TEXTS for block in blocks_of(page)]


def commands_in(text: str) -> Iterator[list[str]]:
    """Find the words of each call in shell text; a variable stands as 1, what a command prints as nothing."""
    text = re.sub(r"\\\n", " ", text)
    for line in (line for line in text.splitlines() if not line.lstrip().startswith("#")):
        plain = re.sub(r"\$\w+", "1", re.sub(r"\$\([^)]*\)", "", line))
        lexer = shlex.shlex(plain, posix=True, punctuation_chars=True)
        lexer.whitespace_split = True
        words: list[str] | None = None
        for word in [*lexer, ";"]:
            if set(word) <= set("();<>|&"):
                if words:
                    yield words[:-1] if words[-1] == "2" and word == ">" else words
                words = None
            elif words is not None:
                words.append(word)
            elif word == "dem-warp" or word.endswith("/dem-warp"):
                words = []


def parsed(words: list[str]) -> None:
    """Parse a call as the command line does; an error that it would show is raised."""
    group = typer.Context(COMMANDS, info_name="dem-warp")
    if words[0].startswith("-"):
        assert words in (["--version"], ["--help"], ["-h"]), words
        return
    command = COMMANDS.get_command(group, words[0])
    assert command is not None, f"no command is named {words[0]}"
    context = command.make_context(words[0], words[1:], parent=group)
    if hasattr(command, "resolve_command"):
        _, command, rest = command.resolve_command(context, words[1:])
        command.make_context(words[1], rest, parent=context)


SHELL = [block for block in BLOCKS if block.is_shell]


@pytest.mark.parametrize("block", [block for block in SHELL if "dem-warp" in block.code], ids=str)
def test_commands_are_as_the_command_line_takes_them(block: Block) -> None:
    found = list(commands_in(block.code))
    assert len(found) >= len(re.findall(r"^\s*(?:time )?dem-warp ", block.code, re.MULTILINE))
    for words in found:
        parsed(words)


def test_a_command_that_is_wrong_is_seen() -> None:
    with pytest.raises(Exception, match="No such option"):
        parsed(["heap", "--no-such-option"])
    with pytest.raises(Exception, match="valid integer"):
        parsed(["heap", "--seed", "many"])


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: page.name)
def test_commands_and_options_in_a_sentence_exist(page: Path) -> None:
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    group = typer.Context(COMMANDS, info_name="dem-warp")
    names = COMMANDS.list_commands(group)
    commands = [COMMANDS.get_command(group, name) for name in names]
    commands += [each for command in commands for each in getattr(command, "commands", {}).values()]
    known = {"--help", "--version"} | {
        option
        for command in commands
        for parameter in command.params
        for option in (*parameter.opts, *parameter.secondary_opts)
    }
    for quoted in re.findall(r"`(dem-warp [^`]+|--[^`]+)`", text):
        words = quoted.split()
        assert words[0] != "dem-warp" or words[1] in names or words[1].startswith("--"), quoted
        for option in (word.split("=")[0] for word in words if word.startswith("--")):
            assert option in known, quoted


@pytest.mark.parametrize("block", [block for block in BLOCKS if block.is_study], ids=str)
def test_studies_load(block: Block, tmp_path: Path) -> None:
    """A whole study as it is; a piece of one merged over a small study."""
    changes = tomllib.loads(block.code)
    changes.pop("material", None)
    for name, rows in MEASURED.items():
        (tmp_path / name).write_text(rows, encoding="utf-8")
    for clump in re.findall(r'clump = "(\S+)"', block.code):
        (tmp_path / clump).write_text("0 0 0 2\n", encoding="utf-8")
    text = BASE.read_text(encoding="utf-8")
    if "walls" in changes:
        changes |= {"scene": {"drum": DRUM}, "target": {"observable": "dynamic_angle"}}
        changes |= {"contact": {"grain-grain": {"static_friction": 0.4}}}
    elif "profiles" in changes.get("target", {}):
        text = re.sub(r"\[target\].*?\n\n", "", text, flags=re.DOTALL)
        changes |= {"scene": {"drum": DRUM}}
    elif "grain-grain" in changes.get("contact", {}):
        text = text.replace("[contact.grain-grain]\nrestitution = 0.2\nrolling_friction = 0.05\n", "")
        if "factor" not in changes:
            text = re.sub(r"\[\[factor\]\].*?\n\n", "", text, flags=re.DOTALL)
    if "grain-wall" in changes.get("contact", {}):
        text = re.sub(r"\[contact\.grain-wall\].*?\n\n", "", text, flags=re.DOTALL)
    if any(key in changes.get("grain", {}) for key in ("clump", "shapes")):
        text = text.replace('sphere = "2 mm"\n', "")
    if "scene" in changes:
        text = re.sub(r"\[scene\.lifted-cylinder\].*?\n\n", "", text, flags=re.DOTALL)
    (tmp_path / "base.toml").write_text(text, encoding="utf-8")
    load_study(tmp_path / "base.toml", changes=changes)


@pytest.mark.parametrize("block", [block for block in BLOCKS if block.is_python], ids=str)
def test_python_compiles(block: Block) -> None:
    ast.parse(re.sub(r"^!.*$", "", block.code, flags=re.MULTILINE))


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    """Pages that the build makes and headings are left to `sphinx-build -W`."""
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
        if "://" in target or "generated/" in target:
            continue
        assert (page.parent / target).exists(), f"{page}: {target}"


def test_what_the_build_does_not_run_says_so_and_is_little() -> None:
    site = [block for block in BLOCKS if block.page in PAGES and not block.executed]
    left = [block for block in site if block.is_shell or block.is_python]
    included = [block for block in site if block.kind.startswith("{literalinclude}")]
    assert [str(block) for block in [*left, *included] if not NOT_RUN.search(block.text)] == []
    assert len(left) + len(included) <= MOST_NOT_RUN


def test_a_page_that_the_gate_leaves_out_was_run_with_the_cells_that_it_has() -> None:
    rows, pages = EXECUTED.recorded(), EXECUTED.pages()
    assert list(rows) == list(pages)
    left_out = [name for name, row in rows.items() if EXECUTED.slow(row)]
    changed = [
        name for name in left_out if EXECUTED.digest(EXECUTED.cells_of(pages[name])) != rows[name]["cells"]
    ]
    assert changed == [], f"run .ci/docs {' '.join(changed)}"


@pytest.mark.parametrize("page", [*PAGES, *DOCS.rglob("*.ipynb")], ids=lambda page: page.name)
def test_every_cell_counts(page: Path) -> None:
    mark = '"cell_type": "code"' if page.suffix == ".ipynb" else "{code-cell}"
    assert len(EXECUTED.cells_of(page)) == page.read_text(encoding="utf-8").count(mark)


def test_a_page_with_another_cell_is_seen_and_other_prose_is_none(tmp_path: Path) -> None:
    text = (DOCS / "tutorials" / "wheat.md").read_text(encoding="utf-8")
    copy, digests = tmp_path / "wheat.md", []
    for changed in (text, f"{text}\nMore prose.\n", text.replace("--spheres 3", "--spheres 4")):
        copy.write_text(changed, encoding="utf-8")
        digests.append(EXECUTED.digest(EXECUTED.cells_of(copy)))
    assert digests[0] == digests[1] != digests[2]


def test_what_the_readme_shows_is_run() -> None:
    """Its two commands by the gate and the workflow, every other line by a page of the site."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    run_elsewhere = re.findall(r"^## (?:Run|Test) it$.*?^```sh\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert len(run_elsewhere) == 2
    site = "\n".join(block.code for block in BLOCKS if block.page in PAGES and block.executed)
    others = [block for block in blocks_of(ROOT / "README.md") if block.text not in run_elsewhere]
    for block in others:
        for line in block.code.splitlines():
            assert line.strip() in site, f"README: no page runs {line!r}"


def test_the_notebook_of_a_campaign_is_that_of_its_script_and_was_run() -> None:
    notebook = json.loads((DOCS / "notebooks" / "campaign.ipynb").read_text(encoding="utf-8"))
    script = (DOCS / "notebooks" / "campaign_source.py").read_text(encoding="utf-8")
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    assert all("".join(cell["source"]).removesuffix("\nfigure") in script for cell in code[1:])
    assert len(code) - 1 == script.count("# %%\n")
    assert not [output for cell in code for output in cell["outputs"] if output["output_type"] == "error"]
