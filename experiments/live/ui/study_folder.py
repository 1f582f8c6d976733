"""Actions of the start page in its folder; each calls the function of a command."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from dem_warp import SCENES, Drum
from experiments.grains.clumps.clump_maker import ClumpRequest, make_clump, write_clump
from experiments.io.errors import InputError, Problem
from experiments.io.files import replacing, write_text
from experiments.io.toml_files import read_toml, toml_text
from experiments.io.units import read_quantity, read_share
from experiments.live.run_files import inside
from experiments.live.watch_routes import problems_of
from experiments.measurement.photographs import PictureOptions, find_pictures, mean_angle, measure_pictures
from experiments.studyfile import Study, load_study, study_scales
from experiments.studyfile.factor_section import merge
from experiments.studyfile.new_study import TEMPLATE, new_study_path
from experiments.studyfile.places import nested
from experiments.studyfile.reference import study_reference

LARGEST_UPLOAD = 100_000_000
"""Bytes of the largest file that is taken."""

MOST_FACES = 20_000
"""Triangles of a solid that the preview draws; of more, some are left out."""

_FILE_NAME = re.compile(r"[^\W_][\w .()-]{0,120}", re.UNICODE)


@dataclass(frozen=True)
class StudyFolder:
    """A folder with study files, pictures and runs."""

    folder: Path

    # ---- what the page begins with -------------------------------------------------------------------------

    def form(self) -> dict[str, Any]:
        """Values of the template, keys and units of every test, and the files of the folder."""
        document = read_toml(TEMPLATE)[1]
        rows = [row for row in study_reference() if row.key]
        tests = {
            name: [
                {"key": row.key, "kind": row.kind, "default": row.default, "bounds": row.bounds,
                 "meaning": row.meaning, "required": row.required}
                for row in rows
                if row.section == f"[scene.{name}]"
            ]
            for name in SCENES
        }  # fmt: skip
        meanings = {f"{row.section[1:-1]}.{row.key}": row.meaning for row in rows}
        return {
            "folder": str(self.folder),
            "template": document,
            "tests": tests,
            "meanings": meanings,
            "studies": sorted(path.name for path in self.folder.glob("*.toml") if path.is_file()),
            "measured": sorted(path.name for path in self.folder.glob("*.csv") if path.is_file()),
        }

    def new_file(self, name: str) -> Path:
        """Return the path of a file that is taken from a person."""
        parts = name.split("/")
        if not 1 <= len(parts) <= 2 or not all(_FILE_NAME.fullmatch(part) for part in parts):
            raise InputError("upload", "a file name has only letters, digits, spaces and .-_()", name)
        path = self.folder.joinpath(*parts)
        if any(each.is_symlink() for each in (path, path.parent)):
            raise InputError("upload", "links are not followed", name)
        if path.exists():
            raise InputError(str(path), "the file exists")
        return path

    def keep(self, name: str, data: bytes) -> Path:
        """Write an uploaded file; the same one may come twice."""
        if len(data) > LARGEST_UPLOAD:
            raise InputError(name, f"must have at most {LARGEST_UPLOAD:,} bytes", f"{len(data):,}")
        try:
            path = self.new_file(name)
        except InputError:
            if _same(self.folder, name, data):
                return inside(self.folder, name)
            raise
        with replacing(path) as temporary:
            temporary.write_bytes(data)
        return path

    # ---- grain and photographs -----------------------------------------------------------------------------

    def clump(self, asked: Mapping[str, str]) -> dict[str, Any]:
        """Make a clump, as ``dem-warp clump`` does; with ``out``, write it too."""
        source = asked.get("source", "")
        if ":" not in source:
            source = str(inside(self.folder, source))
        count, tolerance, reach = (asked.get(name) or None for name in ("spheres", "tolerance", "protrusion"))
        request = ClumpRequest(
            source,
            _whole(count, "--spheres") if count else None,
            read_share(tolerance, "--tolerance") if tolerance else None,
            None if reach == "auto" else read_quantity(reach or "0 mm", "length", "--protrusion"),
            asked.get("unit") or None,
        )
        density = read_quantity(asked["density"], "density", "--density") if asked.get("density") else None
        made = make_clump(request)
        if out := asked.get("out"):
            with TemporaryDirectory() as draft:
                write_clump(made.shape, Path(draft, "clump.txt"))
                self.keep(out, Path(draft, "clump.txt").read_bytes())
        own = np.column_stack([made.shape.centers, made.shape.radii])
        spheres = made.fit.spheres if made.fit else own
        return {
            "facts": made.to_dict(density),
            "advice": made.advice,
            "description": made.description,
            "spheres": np.column_stack([spheres, np.zeros(len(spheres))]).ravel().tolist(),
            "faces": [] if made.solid is None else _faces(made.solid),
            "command": self.clump_command(asked),
        }

    def clump_command(self, asked: Mapping[str, str]) -> str:
        """Write the command line that makes a clump."""
        names = ("spheres", "tolerance", "unit", "protrusion", "density", "out")
        options = [word for name in names if asked.get(name) for word in (f"--{name}", str(asked[name]))]
        return command_line("clump", asked.get("source", ""), *options)

    def angles(self, folder: str, fit: str, test: str) -> dict[str, Any]:
        """Measure the photographs of a folder, as ``dem-warp angle`` does: heaps, or the test "drum"."""
        pictures = find_pictures(self._plain(folder), self.folder, "pictures")
        options = PictureOptions(fit, drum=test == Drum.name)
        rows = measure_pictures(pictures, options)
        mean = mean_angle(rows, options)
        chosen = ("--drum",) if options.drum else ("--fit", fit)
        names = [f"{folder}/{path.name}" for path in pictures]
        return {
            "rows": [row | {"picture": Path(row["picture"]).name} for row in rows],
            "mean": str(mean) if mean else "",
            "command": command_line("angle", *names, *chosen),
        }

    def _plain(self, name: str) -> str:
        if not _FILE_NAME.fullmatch(name) or (self.folder / name).is_symlink():
            raise InputError("pictures", "must be a folder of photographs next to the study", name)
        return name

    # ---- the study file ------------------------------------------------------------------------------------

    def draft(
        self, name: str, values: Mapping[str, str], factors: Sequence[Mapping[str, str]]
    ) -> dict[str, Any]:
        """Write a study of the form's values, and check it."""
        path = new_study_path(name, self.folder)
        document: dict[str, Any] = {"name": path.stem}
        for place, text in values.items():
            if text.strip():
                document = merge(document, nested(place.split("."), plain_value(text)))
        document["factor"] = [
            {key: plain_value(text) for key, text in factor.items() if text.strip()} for factor in factors
        ]
        head = f"# One heap: dem-warp heap {shlex.quote(path.name)}\n"
        head += f"# The whole campaign: dem-warp calibrate {shlex.quote(path.name)}\n\n"
        text = head + toml_text(document)
        return {"text": text, "file": path.name, **self.checked(path.name, text)}

    def checked(self, file: str, text: str) -> dict[str, Any]:
        """Check the text of a study file: what is wrong, or what is doubtful about it."""
        try:
            with self._draft_file(file, text) as path:
                study = load_study(path)
                found = {
                    "note": study.note,
                    "doubtful": "; ".join(study.doubts()),
                    "scales": study_scales(path),
                }
        except InputError as error:
            return problems_of(error)
        return found

    def write(self, file: str, text: str) -> Path:
        """Write a study file that keeps every rule."""
        path = new_study_path(file, self.folder)
        with self._draft_file(path.name, text) as draft:
            load_study(draft)
        write_text(path, text)
        return path

    def study(self, file: str, scale: str | None = None) -> Study:
        """Load a study file of the folder."""
        return load_study(inside(self.folder, file), scale)

    @contextmanager
    def _draft_file(self, file: str, text: str) -> Iterator[Path]:
        """Put a text where its files are found from, for as long as it is looked at; errors name the file."""
        path = self.folder / f".draft-{Path(file).name}"
        try:
            write_text(path, text)
            yield path
        except InputError as error:
            found = [
                Problem(each.place.replace(str(path), file), each.problem, each.value)
                for each in error.problems
            ]
            raise type(error).of(found) from None
        finally:
            path.unlink(missing_ok=True)


def command_line(*words: str) -> str:
    """Write a command of dem-warp as a person would type it."""
    return shlex.join(["dem-warp", *words])


def plain_value(text: str) -> Any:
    """Read a field of the form as a TOML file would: a number or a truth value where it is one, else text."""
    try:
        found = tomllib.loads(f"value = {text.strip()}")
    except (tomllib.TOMLDecodeError, ValueError, RecursionError):
        return text.strip()
    value = found.get("value")
    return value if found.keys() == {"value"} and isinstance(value, bool | int | float) else text.strip()


def _whole(text: str, place: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(place, "must be a whole number", text) from None


def _same(folder: Path, name: str, data: bytes) -> bool:
    try:
        return inside(folder, name).read_bytes() == data
    except (InputError, OSError):
        return False


def _faces(solid: Any) -> list[float]:
    """Corners of the triangles of a solid [m], nine numbers each."""
    faces = np.asarray(solid.triangles)
    step = -(-len(faces) // MOST_FACES)
    return np.round(faces[::step].ravel(), 9).tolist()
