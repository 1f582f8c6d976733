"""The engine's fingerprint: it follows the meaning of the code, not its form or its comments."""

import hashlib
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
import warp as wp

import dem_warp
from dem_warp import provenance
from dem_warp.laws.linear_cohesion import LinearCohesion
from dem_warp.provenance import CHANGE_NO_HEAP, engine_files, engine_fingerprint, source_meaning
from dem_warp.version import source_commit

SOURCE = '''
"""Force of a spring."""

@dataclass
class Spring:
    stiffness: float = 1.5
    """[N/m]"""

    def force(self, length):
        """Force [N]."""
        return -self.stiffness * length  # towards the rest
'''


@pytest.mark.parametrize(
    ("part", "other"),
    [
        ("Force of a spring.", "Force [N] of a linear spring.\n\nSee Hooke."),
        ("[N/m]", "Newtons a metre"),
        ('"""Force [N]."""', "# without a docstring"),
        ("  # towards the rest", ""),
        ("-self.stiffness * length", "(\n            -self.stiffness * length\n        )"),
    ],
)
def test_comments_docstrings_and_form_have_no_meaning(part: str, other: str) -> None:
    assert part in SOURCE
    assert source_meaning(SOURCE.replace(part, other)) == source_meaning(SOURCE)


@pytest.mark.parametrize(
    ("part", "other"),
    [("1.5", "1.25"), ("-self", "self"), ("float", "int"), ("* length", "/ length"), ("@dataclass\n", "")],
)
def test_numbers_operators_annotations_and_decorators_have(part: str, other: str) -> None:
    assert part in SOURCE
    assert source_meaning(SOURCE.replace(part, other)) != source_meaning(SOURCE)


def test_the_meaning_of_the_kernels_is_written_out() -> None:
    text = (Path(dem_warp.__file__).parent / "kernels" / "contacts.py").read_text(encoding="utf-8")
    assert len(source_meaning(text)) > len(text)
    assert source_meaning(text.replace(" + ", " - ", 1)) != source_meaning(text)


LOAD = """
import sys
import dem_warp.batch
from dem_warp.laws.library import MECHANISMS
from dem_warp.laws.mechanism import Mechanism
from dem_warp.scenes.library import SCENES
[*MECHANISMS.values(), *SCENES.values()]
import dem_warp.kernels.rain
own = {name: module for name, module in sys.modules.items() if name.startswith("dem_warp.")}
print(*(name for name, module in own.items() if not hasattr(module, "__path__")))
"""


def test_the_fingerprint_covers_all_files_of_batches_laws_and_scenes() -> None:
    printed = subprocess.run([sys.executable, "-c", LOAD], capture_output=True, text=True, check=True).stdout
    loaded = {f"{name.replace('.', '/')}.py" for name in printed.split()}
    covered = {name for name in engine_files() if not name.endswith("__init__.py")}
    assert covered == loaded - set(CHANGE_NO_HEAP)
    assert not covered & {"dem_warp/frames.py", "dem_warp/solids.py", "dem_warp/processes.py"}


@pytest.fixture
def outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write a law in a package from outside, its number in another file; leave the engine's own files out."""
    package = tmp_path / "someones_laws"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "numbers.py").write_text("FACTOR = 2.0\n", encoding="utf-8")
    law = "from dem_warp.laws.linear_cohesion import LinearCohesion\nclass Glue(LinearCohesion):\n    pass\n"
    (package / "law.py").write_text(law, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(provenance, "_fingerprint", provenance._fingerprint.__wrapped__)
    monkeypatch.setattr(provenance, "_own_digest", hashlib.sha256)  # the real one stays cached
    yield package
    for name in [name for name in sys.modules if name.startswith("someones_laws")]:
        del sys.modules[name]


def test_a_law_from_outside_counts_if_it_takes_part(outside: Path) -> None:
    glue = import_module("someones_laws.law").Glue
    own, with_glue = engine_fingerprint(LinearCohesion), engine_fingerprint(LinearCohesion, glue)
    assert own == engine_fingerprint() != with_glue
    (outside / "numbers.py").write_text("FACTOR = 2.0  # measured\n", encoding="utf-8")
    assert engine_fingerprint(glue) == with_glue
    (outside / "numbers.py").write_text("FACTOR = 3.0\n", encoding="utf-8")
    assert engine_fingerprint(glue) != with_glue
    assert engine_fingerprint() == own
    (outside / "numbers.py").write_text("FACTOR = 2.0\n", encoding="utf-8")
    shutil.move(outside / "numbers.py", outside / "figures.py")
    assert engine_fingerprint(glue) != with_glue


def test_a_result_has_version_and_commit_of_its_maker() -> None:
    made_by = provenance.provenance(wp.get_device("cpu"), "mixed")
    assert (made_by["dem-warp"], made_by["commit"]) == (dem_warp.__version__, source_commit())


def test_a_checkout_knows_its_commit() -> None:
    in_a_checkout = (Path(dem_warp.__file__).parents[1] / ".git").exists()
    assert bool(source_commit()) == in_a_checkout
