"""Sizes as they are measured: tables, distributions and shapes, and what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from dem_warp import ClumpShape
from experiments.grains.sizes.diameters import feret_diameter, sieve_diameter, volume_diameter
from experiments.grains.sizes.distribution import Continuous, Tabulated
from experiments.grains.sizes.size_classes import cut_classes
from experiments.grains.sizes.size_tables import read_counts, read_sieves
from experiments.io.errors import InputError, StudyError
from experiments.report.study_facts import study_facts
from experiments.studyfile import load_study

LAWS = {
    "normal": stats.norm(2.0, 0.3),
    "lognormal": stats.lognorm(np.log(1.4), scale=2.0),
    "rosin-rammler": stats.weibull_min(3.5, scale=2.0),
}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("basis", ["number", "volume"])
def test_classes_keep_numbers_and_mass_of_a_distribution(name: str, basis: str) -> None:
    """Number and volume of the grains between the cuts, by scipy's quadrature of the density."""
    law, cut = LAWS[name], (0.02, 0.98)
    classes = cut_classes(Continuous(law), basis, cut, 7)
    ends = law.ppf(cut)
    mean, third = (law.expect(lambda d, p=p: d**p, lb=ends[0], ub=ends[1]) / 0.96 for p in (1, 3))
    if basis == "number":
        assert classes.mean_mass_diameter**3 == pytest.approx(third, rel=1e-9)
        assert classes.fractions == pytest.approx([1 / 7] * 7, rel=1e-9)
        # A class has one size: its mean is a little above that of the sizes in it.
        found = np.dot(classes.fractions, classes.diameters)
        assert mean <= found < 1.01 * mean
    else:
        inverse = law.expect(lambda d: d**-3.0, lb=ends[0], ub=ends[1]) / 0.96
        # by volume, the number of grains of a unit of it is the mean of 1 / d^3
        assert classes.mean_mass_diameter**-3 == pytest.approx(inverse, rel=1e-9)
        volumes = np.array(classes.fractions) * np.power(classes.diameters, 3)
        assert volumes / volumes.sum() == pytest.approx([1 / 7] * 7, rel=1e-9)


@pytest.mark.parametrize(("basis", "cut"), [("number", (0.05, 0.9)), ("volume", (0.05, 0.9))])
def test_the_mass_beyond_the_cuts_is_counted(basis: str, cut: tuple[float, float]) -> None:
    law = LAWS["lognormal"]
    lost = cut_classes(Continuous(law), basis, cut, 10).mass_lost
    if basis == "volume":
        assert lost == pytest.approx(1.0 - (cut[1] - cut[0]), rel=1e-12)
        return
    # The mass is a lognormal too, its median larger by exp(3 s^2) (Hatch and Choate 1929).
    spread = np.log(1.4)
    mass = stats.lognorm(spread, scale=2.0 * np.exp(3.0 * spread**2))
    assert lost == pytest.approx(1.0 - np.diff(mass.cdf(law.ppf(cut)))[0], rel=1e-6)


def test_numbers_become_volumes_and_back_after_hatch_and_choate() -> None:
    spread = np.log(1.3)
    by_number = stats.lognorm(spread, scale=1.0)
    by_volume = stats.lognorm(spread, scale=np.exp(3.0 * spread**2))
    ends = by_number.ppf([0.001, 0.999])
    one = cut_classes(Continuous(by_number), "number", (0.001, 0.999), 20)
    other = cut_classes(Continuous(by_volume), "volume", tuple(by_volume.cdf(ends)), 20)
    assert one.mean_mass_diameter == pytest.approx(other.mean_mass_diameter, rel=1e-9)


def table(folder: Path, text: str) -> Path:
    path = folder / "sizes.csv"
    path.write_text(text, encoding="utf-8")
    return path


SIEVES = "opening,{column}\n0,{0}\n500 um,{1}\n0.71 mm,{2}\n1 mm,{3}\n1.4 mm,{4}\n"


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("retained", ("2 g", "18 g", "60 g", "20 g", "0 g")),
        ("retained", (1, 9, 30, 10, 0)),
        ("retained_percent", (2, 18, 60, 20, 0)),
        ("passing_percent", (0, 2, 20, 80, 100)),
    ],
)
def test_a_sieve_analysis_is_read_in_every_form(tmp_path: Path, column: str, values: tuple) -> None:
    found, unaccounted = read_sieves(table(tmp_path, SIEVES.format(*values, column=column)))
    assert unaccounted == pytest.approx(0.02, rel=1e-9)
    assert found.lows == pytest.approx((0.5e-3, 0.71e-3, 1e-3))
    assert found.shares == pytest.approx((18 / 98, 60 / 98, 20 / 98), rel=1e-9)
    # a fifth of the mass below 1 mm lies below 0.71 mm
    assert found.quantile(18 / 98) == pytest.approx(0.71e-3, rel=1e-9)
    assert cut_classes(found, "mass", (0.0, 1.0), 5, unaccounted).mass_lost == pytest.approx(0.02, rel=1e-9)


def test_moments_of_a_table_are_those_of_its_grains() -> None:
    found = Tabulated((1.0, 2.0), (2.0, 5.0), (0.3, 0.7))
    rng = np.random.default_rng(2)
    shares = np.sort(rng.random(400_000))
    sample = np.array([found.quantile(share) for share in shares[::400]])
    for power in (-3, 1, 3):
        # a thousand quantiles evenly drawn: their error is 1 / sqrt(1000) of the spread, and sorted far less
        assert found.moment(power, 0.0, 1.0) == pytest.approx(np.mean(sample**power), rel=0.02)
    parts = [found.moment(3, low, high) for low, high in ((0.0, 0.2), (0.2, 0.6), (0.6, 1.0))]
    assert sum(parts) == pytest.approx(found.moment(3, 0.0, 1.0), rel=1e-12)


def test_counts_of_single_grains_are_those_grains(tmp_path: Path) -> None:
    diameters = np.random.default_rng(3).normal(1.0, 0.1, 500)
    text = "diameter\n" + "\n".join(f"{value!r} mm" for value in diameters.tolist())
    found = cut_classes(read_counts(table(tmp_path, text)), "number", (0.0, 1.0), 10)
    assert found.mean_mass_diameter == pytest.approx(1e-3 * np.cbrt(np.mean(diameters**3)), rel=1e-9)
    assert found.mass_lost == pytest.approx(0.0, abs=1e-12)
    classed = "from,to,count\n800,900,16\n900,1000,34\n1000,1100,34\n1100,1200,16\n"
    by_class = cut_classes(read_counts(table(tmp_path, classed), "um"), "number", (0.0, 1.0), 10)
    units = "from (um),to (mm),count (%)\n800,0.9,16\n900,1,34\n1000,1.1,34\n1100,1.2,16\n"
    assert read_counts(table(tmp_path, units)) == read_counts(table(tmp_path, classed), "um")
    # A class of 10 % width: the mean cube of normal grains in it, to a percent.
    assert by_class.mean_mass_diameter == pytest.approx(found.mean_mass_diameter, rel=0.01)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("opening,retained\n0.25 in,3\n0.5 in,4\n", None, r"sizes.csv:2: opening: needs a unit of length"),
        ("opening,retained\n0.25,3\n0.5,4\n", None, r"sizes.csv:2: opening: needs a unit .*; or write"),
        ("opening,retained\n1,3\n1,4\n", "mm", r"sizes.csv:3: opening: must be another opening.*got 1"),
        ("opening,retained\n-1,3\n1,4\n", "mm", r"sizes.csv:2: opening: must be positive, got -1"),
        (
            "opening,passing_percent\n1,30\n2,101\n",
            "mm",
            r"sizes.csv:3: passing_percent: must be at most 100",
        ),
        ("opening,passing_percent\n1,60\n2,30\n", "mm", r"sizes.csv:3: passing_percent: must rise with the"),
        ("opening,retained_percent\n1,50\n2,40\n", "mm", r"must add up to 100 .*got 90"),
        ("opening,retained\n1,-3\n2,4\n", "mm", r"sizes.csv:2: retained: must be 0 or more, got -3"),
        ("opening,retained\n1,x\n2,4\n", "mm", r"sizes.csv:2: retained: must be a number"),
        ("opening,retained\n1,0\n2,4\n", "mm", r"sizes.csv: retained: must have mass between two sieves"),
        ("opening,retained\n1,3\n", "mm", r"sizes.csv: retained: must have mass between two sieves, got 0"),
        ("opening,retained\n", "mm", r"sizes.csv: has no rows below the names of the columns"),
        ("opening\n1\n2\n", "mm", r"sizes.csv: needs one column of retained, .*got none"),
        (
            "Maschenweite [µm];Rückstand [g]\n2.000;3\n1.000;4\n",
            None,
            r"sizes.csv:2: opening: may be a thousand times as large: write it without a point, got 2.000",
        ),
        (
            "Sieve (mm),Retained (g),Refus (g),% retained\n2,0,1,0\n1,30,40,100\n",
            None,
            r"sizes.csv:1: must have one column retained, got Retained \(g\), Refus \(g\). Rename the others",
        ),
        # 10 mesh of Tyler's has 1.7 mm, that of ASTM 2 mm
        ("Mesh (Tyler),Retained (g)\n10,3\n20,4\n", None, r"sizes.csv:2: opening: needs a unit of length"),
        (
            "opening,retained\n1-2,3\n2.5-3,4\n",
            "mm",
            r"sizes.csv:2: opening: must end at the opening that the next row begins with, got 1-2",
        ),
        (
            "opening,passing_percent\n1-2,3\n2-3,40\n",
            "mm",
            r"sizes.csv:2: opening: may have two ends only in a table of what each .* retains, got 1-2",
        ),
        (
            "# 3 sieves, dry\nopening,passing_percent\n0.4 mm,2\n#31,20\n#20,100\n",
            None,
            r"sizes.csv:4: opening: must be a sieve of ASTM E11, .*, got #31",
        ),
        (
            "opening,retained\n0.5,1 g\n1,12\n2,5 g\n",
            "mm",
            r"sizes.csv:3: retained: needs a unit like the other rows, got 12",
        ),
        (
            "opening,passing_percent\n0.5,0.02\n1,0.8\n2,1\n",
            "mm",
            r"sizes.csv:4: passing_percent: must be percent, .*not parts of 1, got 1",
        ),
    ],
)
def test_a_bad_sieve_analysis_is_refused_with_its_row(
    tmp_path: Path, text: str, unit: str | None, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_sieves(table(tmp_path, text), unit)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("diameter\n-1\n", r"sizes.csv:2: diameter: must be positive, got -1"),
        ("diameter,count\n1,0\n", r"sizes.csv: count: must count at least one grain"),
        ("from,to,count\n1,0.5,3\n", r"sizes.csv:2: to: must be above from, 1, got 0.5"),
        ("from,to,count\n1,2,3\n1.5,3,4\n", r"sizes.csv:3: from: must not be below .*got 1.5"),
        ("diameter,from,to,count\n1,1,2,3\n", r"sizes.csv: must have a column diameter, or .*not both"),
    ],
)
def test_bad_counts_are_refused_with_their_row(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_counts(table(tmp_path, text), "mm")


def rod(spheres: int, step: float = 0.5, radius: float = 1.0) -> ClumpShape:
    centers = np.zeros((spheres, 3))
    centers[:, 0] = step * np.arange(spheres)
    return ClumpShape.from_spheres(centers, [radius] * spheres)


def test_all_diameters_of_a_sphere_are_its_own() -> None:
    ball = ClumpShape.sphere(1.5)
    for diameter in (sieve_diameter, feret_diameter):
        assert diameter(ball) == pytest.approx(3.0, rel=1e-12)
    # The volume is a quadrature.
    assert volume_diameter(ball) == pytest.approx(3.0, rel=1e-4)


def test_a_rod_passes_a_sieve_end_on_and_lies_under_the_caliper_at_full_length() -> None:
    shape = rod(9)
    assert sieve_diameter(shape) == pytest.approx(2.0, rel=1e-4)
    assert feret_diameter(shape) == pytest.approx(6.0, rel=1e-12)
    assert sieve_diameter(shape) < volume_diameter(shape) < feret_diameter(shape)


def test_a_flat_grain_passes_across_the_diagonal() -> None:
    # Four balls in a square of side a: end on its shadow is a stadium of length a + 2 r and width 2 r. Across
    # the diagonal of the opening its widths along both sides are a / sqrt 2 + 2 r.
    side, radius = 6.0, 0.5
    centers = np.array([[x, y, 0.0] for x in (0.0, side) for y in (0.0, side)])
    shape = ClumpShape.from_spheres(centers, [radius] * 4)
    assert sieve_diameter(shape) == pytest.approx(side / np.sqrt(2.0) + 2.0 * radius, rel=1e-3)


SECTION = """[grain.sizes]
distribution = "lognormal"
median = "3.6 mm"
geometric_sd = 1.2
by = "volume"
"""
WriteStudy = Callable[..., Path]
BEFORE_WALL = "[wall]\n"


def with_sizes(write_study: WriteStudy, section: str) -> Path:
    return write_study((BEFORE_WALL, section + "\n" + BEFORE_WALL))


def test_a_study_takes_its_sizes_from_a_distribution(write_study: WriteStudy) -> None:
    grains = load_study(with_sizes(write_study, SECTION)).case({}, seed=1).grains
    law = stats.lognorm(np.log(1.2), scale=3.6e-3)
    expected = cut_classes(Continuous(law), "volume", (0.01, 0.99), 10)
    [shape] = grains.mixture.shapes
    assert 2.0 * shape.radii[0] == pytest.approx(expected.mean_mass_diameter, rel=1e-4)
    assert grains.classes.moment(3) == pytest.approx(1.0, rel=1e-12)
    diameters = 2.0 * shape.radii[0] * np.array(grains.classes.sizes)
    assert diameters == pytest.approx(expected.diameters, rel=1e-4)
    facts = study_facts(load_study(with_sizes(write_study, SECTION)))
    assert facts["Sizes"].endswith("2 % of the mass is beyond the cuts and left out")


@pytest.mark.parametrize(("diameter", "scale"), [("sieve", 2.0), ("feret", 6.0), ("volume", None)])
def test_a_diameter_scales_the_clump_as_its_instrument_sees_it(
    write_study: WriteStudy, tmp_path: Path, diameter: str, scale: float | None
) -> None:
    shape = rod(9)
    lines = [f"{x} {y} {z} {r}" for (x, y, z), r in zip(shape.centers, shape.radii, strict=True)]
    (tmp_path / "rod.txt").write_text("\n".join(lines), encoding="utf-8")
    section = SECTION + f'diameter = "{diameter}"\ncut = [0.49, 0.51]\nclasses = 1\n'
    path = write_study(
        ('sphere = "2 mm"', 'clump = "rod.txt"'), (BEFORE_WALL, section + BEFORE_WALL),
        ('diameter = "28 mm"', 'diameter = "60 mm"'),
    )  # fmt: skip
    [scaled] = load_study(path).case({}, seed=1).grains.mixture.shapes
    expected = 3.6e-3 / (scale or volume_diameter(shape))
    # A class of 2 % of the grains stands for its median to 1e-4; the turn in the sieve is found as well.
    assert scaled.radii[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(("key", "low", "high"), [("median", "'3 mm'", "'4 mm'"), ("correction", 0.9, 1.2)])
def test_a_factor_may_vary_a_size_and_be_read(write_study: WriteStudy, key: str, low: str, high: str) -> None:
    of = f'parameter = "grain.sizes.{key}"\n'
    factor = f'[[factor]]\nname = "D"\nlabel = "diameter"\nlow = {low}\nhigh = {high}\n{of}'
    reading = f'[[direct]]\nby = "value"\nmean = {low}\nsd = {low}\nn = 1\n{of}'
    section = SECTION if key != "median" else SECTION.replace('median = "3.6 mm"\n', "")
    study = load_study(write_study((BEFORE_WALL, section + BEFORE_WALL), add=f"\n{factor}\n{reading}"))
    ends = study.factors[-1].low, study.factors[-1].high
    small, large = (study.case({"D": end}, seed=1).grains.mixture.shapes[0].radii[0] for end in ends)
    assert large / small == pytest.approx(4.0 / 3.0, rel=1e-9)
    assert study.direct[0].measured.mean == pytest.approx(ends[0])


def test_a_wrong_table_is_named_by_the_study_and_by_its_row(write_study: WriteStudy, tmp_path: Path) -> None:
    table(tmp_path, "opening,passing_percent\n1,30\n2,101\n")
    with pytest.raises(StudyError, match=r"sizes.csv:3: passing_percent: must be at most 100") as caught:
        load_study(with_sizes(write_study, '[grain.sizes]\nsieves = "sizes.csv"\nunit = "mm"\n'))
    assert caught.value.problems[0].place.endswith("grain.sizes")


ON_EACH = {"0.5 mm": 60.0, "1 mm": 30.0, "2 mm": 0.0}
SHEETS = {
    "coarsest first, with a pan": "Sieve Opening (mm),Mass Retained (g)\n2,0\n1,30\n0.5,60\nPan,10\n",
    "finest first": "Aperture [um],Retained (%)\n0,10\n500,60\n1000,30\n2000,0\n",
    "what passes": "Sieve size (mm);% passing\n2,0;100\n1,0;70\n0,5;10\n",
    "cumulative": "Size (mm),Cumulative retained (%)\n2,0\n1,30\n0.5,90\nPan,100\n",
    "by numbers": "# of a lecture\nopening,retained_percent\n#10,0\nNo. 18,30\n35 mesh,60\nPan,10\n",
    "numbers alone": "Sieve (mesh),% passing\n10,100\n18,70\n35,10\n",
    "classes": "Size class (mm),Mass retained (g)\n1.00-2.00,30\n0.50-1.00,60\n<0.50,10\n>2,0\n",
    "classes without their ends": "opening,retained\n1 - 2 mm,30\n500–1000 um,60\nPan,10\n",
    "German": "Maschenweite [mm];Rückstand [g];Durchgang [%]\n2,0;0;100\n1,0;30;70\n0,5;60;10\nBoden;10;\n",
    "German classes": "Kornklasse in mm;Rückstand in %\n> 2,00;0\n1,00 - 2,00;30\n0,50 bis 1,00 mm;60\n"
    "<0,50;10\nSumme;100\n",
    "French": "Ouverture de maille (mm);Refus cumulé (%)\n2;0\n1;30\n0,5;90\nFond;100\n",
    "French masses": "Tamis (mm);Refus partiel (g)\n2;0\n1;30\n0,5;60\nFond;10\nTotal;100\n",
    "Spanish": "Abertura (mm);% que pasa\n2;100\n1;70\n0,5;10\n",
    "Spanish masses": "Tamiz, mm\tPeso retenido, g\n2\t0\n1\t30\n0,5\t60\nBandeja\t10\nTotal\t100\n",
    "per cent in each cell": "opening,passing_percent\n2 mm,100 %\n1 mm,70 %\n0.5 mm,10%\n",
    "Greek and other micrometres": "Particle size (μm),Retained %\n2000,0\n1000,30\n500 µm,60\n0,10\n",
    "oversize": "Sieve (mm),Oversize (%)\n2,0\n1,30\n0.5,90\n",
    "a sieve and what it holds": "Sieve size (mm),Sieve + retained (g),Retained (g)\n"
    "2,400,0\n1,420,30\n0.5,440,60\nPan,310,10\n",
    "a column of numbers": "Mesh,Mass retained (g)\n#10,0\n18,30\n35,60\nPan,10\n",
    "a name of each sieve": "Sieve,Sieve opening (mm),Retained (g)\nA,2,0\nB,1,30\nC,0.5,60\nPan,0,10\n",
    "a mesh in micrometres": "Mesh (microns),Retained (g)\n2000,0\n1000,30\n500,60\nPan,10\nSomme,100\n",
    "a pan among the numbers": "Sieve No.,Opening (mm),Retained (g)\n10,2,0\n18,1,30\n35,0.5,60\n"
    "Pan,,10\nTotal,,100\n",
    "a whole sheet": "Sample,river sand\n"
    "Sieve No.,Opening (mm),Mass of sieve (g),Mass retained (g),% retained,% finer\n"
    "10,2,400,0,0,100\n18,1,390,30,30,70\n35,0.5,380,60,60,10\n-,Pan,300,10,10,0\n,Total,,100,100,\n",
}


@pytest.mark.parametrize("name", SHEETS)
def test_a_laboratorys_sheet_is_read_as_it_is(tmp_path: Path, name: str) -> None:
    found, unaccounted = read_sieves(table(tmp_path, SHEETS[name]))
    assert found.lows == pytest.approx([0.5e-3, 1e-3])
    assert found.highs == pytest.approx([1e-3, 2e-3])
    assert found.shares == pytest.approx([60.0 / 90.0, 30.0 / 90.0])
    assert unaccounted == pytest.approx(0.1)


def test_an_analysers_export_has_its_diameter_in_a_named_column(
    write_study: WriteStudy, tmp_path: Path
) -> None:
    export = (
        "Device: analyser\nId,Area [mm2],EQPC [um],Aspect\n1,0.78,1000,0.9\n2,3.1,2000,0.8\n3,3.2,2000,0.7\n"
    )
    found = read_counts(table(tmp_path, export), None, "EQPC [um]")
    assert found == read_counts(table(tmp_path, export), None, "eqpc")
    assert found.lows == pytest.approx([1e-3, 2e-3, 2e-3])
    study = '[grain.sizes]\ncounts = "sizes.csv"\ncolumn = "EQPC"\nby = "number"\ndiameter = "volume"\n'
    mean = load_study(with_sizes(write_study, study)).case({}, seed=1).grains.mixture.shapes[0].radii[0]
    # the grain of the mean mass of one of 1 mm and two of 2 mm, within the classes' width
    assert 2.0 * mean == pytest.approx(1e-3 * (17.0 / 3.0) ** (1.0 / 3.0), rel=0.01)
    with pytest.raises(InputError, match=r"must be a known column, known: .*count.*got Volume"):
        # shares of classes, of which each would be one grain
        read_counts(table(tmp_path, "Size (um),Volume (%)\n100,20\n200,80\n"), None, "Size")
    counted = read_counts(table(tmp_path, "Size (um),Count\n100,20\n200,80\n"), None, "Size")
    assert (counted.lows, counted.shares) == (pytest.approx((1e-4, 2e-4)), (0.2, 0.8))
    with pytest.raises(InputError, match="missing: Feret"):
        read_counts(table(tmp_path, export), None, "Feret")


def test_the_mass_of_a_thousand_grains_gives_their_size(write_study: Callable[..., Path]) -> None:
    # 1,000 spheres of 700 kg/m3 and 23.4572 g have radii of 2 mm
    radius, mass = 'sphere = "2 mm"\n', '23.4572 g"\nsize_sd = 0.2\n'
    for shape in ("", 'sphere = "9 mm"\n'):
        path = write_study((radius, f'{shape}thousand_grain_mass = "{mass}'))
        grains = load_study(path).case({}, 1).grains
        assert grains.mixture.shapes[0].radii[0] == pytest.approx(2e-3, rel=1e-5)
        masses = (
            700.0
            * grains.mixture.shapes[0].volume
            * grains.draw_sizes(100_000, np.random.default_rng(1)) ** 3
        )
        # the mean of 100,000 masses with a spread of .6 has an error of .2 %
        assert masses.mean() == pytest.approx(23.4572e-6, rel=0.008)
    with pytest.raises(StudyError, match="thousand_grain_mass or other sizes, not both"):
        load_study(write_study((radius, f'size_mean = 1.0\nthousand_grain_mass = "{mass}')))


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_as_many_grains_are_poured_as_fill_the_container_at_their_size(
    write_study: Callable[..., Path], size: float
) -> None:
    path = write_study(
        ('sphere = "2 mm"', f'sphere = "1 mm"\nsize_mean = {size}'), ("grain_count = 30\n", "")
    )
    case = load_study(path).case({}, 1)
    drawn = case.grains.draw(100_000, 1)
    assert drawn.sizes.mean() * drawn.clumps[0].radii[0] == pytest.approx(1e-3 * size, rel=0.003)
    # the spread of 5 % in size adds 3 x .05^2 to the mean volume, which the number of grains leaves out
    poured = case.scene.supply(case) * 4.0 / 3.0 * np.pi * (1e-3 * size) ** 3
    assert poured == pytest.approx(case.scene.densest_fill * case.scene.volume, rel=0.005)
