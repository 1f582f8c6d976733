"""Ties between the packages: who imports whom, what loads with what, how long things are."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("dem_warp", "doe", "imaging", "experiments")

# What each package may import apart from itself and the standard library; late ones only in functions: the
# simulator alone needs numpy and Warp, and no window system is loaded before something is drawn.
LIBRARIES = {
    "dem_warp": {"lazy_loader", "numpy", "warp"},
    "doe": {"contourpy", "lazy_loader", "matplotlib", "numpy", "pandas", "scipy", "statsmodels"},
    "imaging": {"cv2", "lazy_loader", "numpy", "scipy"},
}
LATE_LIBRARIES = {
    "dem_warp": {"trimesh"},
    "doe": {"threadpoolctl"},
    "imaging": {"PIL", "pillow_heif", "pyvista"},
}

# Device code: a law sees numbers only, a kernel sees laws and the structures that it works on.
LAYERS = {
    "dem_warp.laws": {
        "collections.abc", "dem_warp.laws", "dem_warp.parameters", "dem_warp.registry", "dataclasses",
        "functools", "math", "typing", "warp",
    },
    "dem_warp.kernels": {
        "dem_warp.entries", "dem_warp.kernels", "dem_warp.laws", "dem_warp.types", "dem_warp.walls",
        "functools", "types", "typing", "warp",
    },
    "dem_warp.types": {
        "collections.abc", "dem_warp.laws", "dataclasses", "enum", "functools", "types", "typing", "warp",
    },
}  # fmt: skip

DISTRIBUTIONS = {
    "dask_jobqueue": "dask-jobqueue",
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "lazy_loader": "lazy-loader",
    "pillow_heif": "pillow-heif",
    "sklearn": "scikit-learn",
    "warp": "warp-lang",
}
COMES_WITH = {
    "annotated_types": "pydantic",
    "contourpy": "matplotlib",
    "dask": "distributed",
    "markupsafe": "jinja2",
    "pydantic_core": "pydantic",
    "torch": "sbi",
    "vtkmodules": "pyvista",
}

MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 65

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Import:
    """An imported module, and whether it is loaded only when a function runs or a type is checked."""

    module: str
    late: bool
    place: str

    @property
    def library(self) -> str:
        return self.module.partition(".")[0]


@dataclass(frozen=True)
class Source:
    """A parsed Python file."""

    path: Path
    tree: ast.Module
    line_count: int

    @property
    def name(self) -> str:
        return self.path.relative_to(ROOT).as_posix()

    @property
    def module(self) -> str:
        return self.name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")

    @cached_property
    def statements(self) -> list[tuple[ast.AST, bool]]:
        """Every statement, and whether it runs only when a function runs or a type is checked."""
        return list(_statements(self.tree, late=False))

    @cached_property
    def functions(self) -> list[Function]:
        return [node for node, _ in self.statements if isinstance(node, Function)]

    @cached_property
    def imports(self) -> list[Import]:
        found = []
        for node, late in self.statements:
            if isinstance(node, ast.Import):
                found += [Import(alias.name, late, f"{self.name}:{node.lineno}") for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                module = "." * node.level + (node.module or "")
                found.append(Import(module, late, f"{self.name}:{node.lineno}"))
        return found


def _statements(node: ast.AST, late: bool) -> Iterator[tuple[ast.AST, bool]]:
    for block in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, block, ()):
            yield child, late
            checked = isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"
            yield from _statements(child, late or checked or isinstance(child, Function))


@cache
def sources(folder: str) -> tuple[Source, ...]:
    """Every Python file under a folder of the repository; an empty folder would make each test below pass."""
    found = []
    for path in sorted((ROOT / folder).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        found.append(Source(path, ast.parse(text, path.name), text.count("\n")))
    assert found, f"no Python files under {folder}"
    return tuple(found)


def everything() -> list[Source]:
    return [source for folder in (*PACKAGES, "tests") for source in sources(folder)]


def own_lines(function: Function) -> int:
    """Lines of a function without its docstring and what is defined in it, as a kernels' builder has."""
    inner: list[ast.stmt] = [n for n in function.body if isinstance(n, Function | ast.ClassDef)]
    documentation = function.body[:1] if ast.get_docstring(function) is not None else []
    return _lines(function) - sum(_lines(n) for n in inner + documentation)


def _lines(node: ast.stmt) -> int:
    assert node.end_lineno is not None
    decorators = getattr(node, "decorator_list", [])
    return node.end_lineno - min([node.lineno, *(decorator.lineno for decorator in decorators)]) + 1


@pytest.mark.parametrize("package", PACKAGES)
def test_simulation_statistics_and_pictures_do_not_know_each_other(package: str) -> None:
    others = {*PACKAGES, "tests"} - {package} if package != "experiments" else {"tests"}
    assert [i for source in sources(package) for i in source.imports if i.library in others] == []


def test_imports_are_absolute() -> None:
    assert [i for source in everything() for i in source.imports if i.module.startswith(".")] == []


@pytest.mark.parametrize("package", sorted(LIBRARIES))
def test_a_package_uses_its_own_libraries_only(package: str) -> None:
    early = LIBRARIES[package] | {package}
    late = early | LATE_LIBRARIES[package]
    foreign = [
        i
        for source in sources(package)
        for i in source.imports
        if i.library not in sys.stdlib_module_names and i.library not in (late if i.late else early)
    ]
    assert foreign == []


@pytest.mark.parametrize("layer", sorted(LAYERS))
def test_device_code_sees_only_what_lies_below_it(layer: str) -> None:
    inside = [s for s in sources("dem_warp") if s.module == layer or s.module.startswith(layer + ".")]
    assert inside, f"no module {layer}"
    allowed = LAYERS[layer]
    above = [
        i
        for source in inside
        for i in source.imports
        if i.module not in allowed and not any(i.module.startswith(a + ".") for a in allowed)
    ]
    assert above == []


def test_device_functions_stand_among_laws_and_kernels() -> None:
    homes = {"kernel": ("dem_warp.kernels",), "func": ("dem_warp.kernels", "dem_warp.laws")}
    strays = []
    for source in (s for package in PACKAGES for s in sources(package)):
        for function in source.functions:
            for decorator in map(ast.unparse, function.decorator_list):
                kind = re.match(r"(?:wp|warp)\.(kernel|func)\b", decorator)
                if kind and not source.module.startswith(homes[kind[1]]):
                    strays.append(f"{source.name}:{function.lineno} {function.name}")
    assert strays == []


def test_every_library_is_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    # What a function imports may be of an extra that a person chooses; the tests' own tools are none.
    extras = [r for name, group in project["optional-dependencies"].items() if name != "test" for r in group]
    for late, requirements in ((False, project["dependencies"]), (True, project["dependencies"] + extras)):
        declared = {re.split(r"[^\w-]", requirement)[0] for requirement in requirements}
        used = {
            i.library for p in PACKAGES for source in sources(p) for i in source.imports if i.late is late
        }
        third_party = used - set(sys.stdlib_module_names) - set(PACKAGES)
        missing = {COMES_WITH.get(n, DISTRIBUTIONS.get(n, n)) for n in third_party} - declared
        assert missing == set()


@pytest.mark.parametrize(
    "unwanted",
    [
        {
            "dem_warp doe doe.discrepancy imaging": {"numpy", "warp", "pandas", "scipy", "cv2"},
            "dem_warp.scenes.library experiments.cli": {
                "warp", "scipy", "pyvista", "pandas", "cv2", "statsmodels", "plotly",
            },
            "imaging.drawing.simulated_heap": {"warp", "pyvista", "vtkmodules", "pandas"},
        },
        {
            "dem_warp.simulation": {"pandas", "scipy", "pyvista", "cv2", "trimesh", "pydantic", "typer"},
            "experiments.runs.calibration": {"pyvista"},
        },
        {
            "doe.response.response_surface doe.discrepancy.analysis": {
                "warp", "pyvista", "cv2", "plotly", "matplotlib.pyplot", "sklearn",
            },
        },
    ],
    ids=["names", "simulator", "statistics"],
)  # fmt: skip
def test_an_import_loads_no_more_than_it_needs(unwanted: dict[str, set[str]]) -> None:
    """The modules of a process are imported one after another: what each may not load, no earlier one may."""
    code = (
        "import importlib, sys\nfor names in sys.argv[1:]:\n  [*map(importlib.import_module, names.split())]"
    )
    words = [sys.executable, "-c", f"{code}\n  print(*sys.modules)", *unwanted]
    shown = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for loaded, (names, each) in zip(map(str.split, shown.splitlines()), unwanted.items(), strict=True):
        assert each & set(loaded) == set(), names


def test_no_generic_room_knows_a_study() -> None:
    named = re.compile(r"studies\.(buckwheat|cellulose|trial|wheat)")
    rooms = [
        s
        for s in sources("experiments")
        if not s.name.startswith(("experiments/studies/", "experiments/evidence/"))
    ]
    assert [s.name for s in rooms if named.search(s.path.read_text(encoding="utf-8"))] == []


def test_package_files_only_hand_names_on() -> None:
    def hands_on(node: ast.stmt) -> bool:
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        targets = ("__all__", "(__getattr__, __dir__, __all__)")
        names = isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in targets
        return docstring or names or isinstance(node, ast.Import | ast.ImportFrom)

    files = [s for p in PACKAGES for s in sources(p) if s.path.name == "__init__.py"]
    logic = [f"{s.name}:{node.lineno}" for s in files for node in s.tree.body if not hands_on(node)]
    assert logic == []


def test_input_is_checked_by_errors_that_python_cannot_leave_out() -> None:
    asserts = [
        f"{source.name}:{node.lineno}"
        for package in PACKAGES
        for source in sources(package)
        for node, _ in source.statements
        if isinstance(node, ast.Assert)
    ]
    assert asserts == []


def test_files_are_short() -> None:
    assert {s.name: s.line_count for s in everything() if s.line_count >= MAX_FILE_LINES} == {}


def test_functions_are_short() -> None:
    long = {
        f"{source.name}:{node.lineno} {node.name}": own_lines(node)
        for source in everything()
        for node in source.functions
        if own_lines(node) >= MAX_FUNCTION_LINES
    }
    assert long == {}


def test_the_guide_gives_these_lengths() -> None:
    guide = " ".join((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").split())
    assert f"A file stays under {MAX_FILE_LINES} lines, a function under {MAX_FUNCTION_LINES}" in guide


def test_no_file_names_a_place_of_one_machine() -> None:
    place = re.compile(r"(?<![\w.$}])/(?:home|Users|root|work|opt|mnt|srv)/\w")
    kinds = {".py", ".toml", ".md", ".cff", ".txt", ".csv", ".j2", ".css", ".js", ".html", ".json", ".yml"}
    top = [path for path in ROOT.iterdir() if path.is_file()]
    below = [
        path
        for f in (*PACKAGES, "tests", ".ci", ".github", "requirements")
        for path in (ROOT / f).rglob("*")
        if path.is_file()
    ]
    texts = [path for path in top + below if path.suffix in kinds or path.parent.name == ".ci"]
    named = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in texts
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if "/" in line and place.search(line)
    ]
    assert named == []
