"""The wheel as a user installs it: the product, all that it needs when it runs, and no evidence."""

import tomllib
import zipfile
from pathlib import Path

from installation import COMMIT, Installed

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("dem_warp", "doe", "imaging", "experiments")
EVIDENCE = {"evidence", "record"}
"""Folders of measurements and of their records; notes on data stay out too."""

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_wheel_holds_the_product_and_no_evidence(wheel: Path) -> None:
    files = {path.relative_to(ROOT) for p in PACKAGES for path in (ROOT / p).rglob("*") if path.is_file()}
    product = {f.as_posix() for f in files if not EVIDENCE & set(f.parts) and f.suffix not in (".pyc", ".md")}
    shipped = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert shipped - {"dem_warp/commit.txt", "dem_warp_command.py"} == product
    assert len(product) < len(files)


def test_the_wheel_is_typed_and_names_its_version_of_python(installed: Installed) -> None:
    assert all((installed.sites[0] / package / "py.typed").is_file() for package in PACKAGES)
    (metadata,) = installed.sites[0].glob("dem_warp-*.dist-info/METADATA")
    text = metadata.read_text(encoding="utf-8")
    assert f"Version: {PROJECT['version']}\n" in text
    assert f"Requires-Python: {PROJECT['requires-python']}\n" in text
    assert "Classifier: Typing :: Typed\n" in text


def test_an_installed_package_knows_its_version_and_its_commit(installed: Installed) -> None:
    assert installed.dem_warp("--version") == f"dem-warp {PROJECT['version']} ({COMMIT})\n"
    program = "import dem_warp.version as here; print(here.__version__, here.source_commit(), here.__file__)"
    version, commit, file = installed.python("-c", program).split()
    assert (version, commit) == (PROJECT["version"], COMMIT)
    assert Path(file).is_relative_to(installed.sites[0])


def test_the_installed_studies_are_complete(installed: Installed) -> None:
    program = """
from pathlib import Path
import experiments
from experiments.studyfile import load_study
example = Path(experiments.__file__).parent / "studies" / "trial" / "study.toml"
for study in (load_study(None, "bench"), load_study(example, "bench")):
    print(len(study.case({}, seed=1).to_dict()["grains"]["shape"]["radii"]))
"""
    assert installed.python("-c", program).split() == ["9", "3"]
