"""Figures: their numbers, and that each is drawn without a display."""

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy import stats

import doe
from doe import Category, DesignError, Factor, Wish, central_composite, fit_surface, full_factorial, plots
from doe.plots.plot_data import half_normal_points, surface_grid

TARGET = 30.148


def drawn(figure: Figure) -> int:
    """Return the number of differing pixel values of the rendered figure."""
    with io.BytesIO() as buffer:
        figure.savefig(buffer, format="rgba", dpi=50)
        return len(np.unique(np.frombuffer(buffer.getvalue(), dtype=np.uint8)))


def test_half_normal_points_hold_all_columns(screening):
    points = half_normal_points(screening.effects)
    assert len(points) == 11
    assert points.index[-1] == "F"
    # The sixth of eleven sits at the median of the half-normal distribution.
    assert points["quantile"].iloc[5] == pytest.approx(stats.norm.ppf(0.75), rel=1e-12)


def test_grid_holds_the_predictions(reduced):
    grid = surface_grid(reduced, x="F", y="E", resolution=5)
    expected = reduced.predict({"F": grid.x[1], "E": grid.y[3]}).iloc[0]
    assert grid.mean[3, 1] == pytest.approx(expected["mean"], rel=1e-12)
    assert grid.se[3, 1] == pytest.approx(expected["se"], rel=1e-9)
    assert (grid.x[0], grid.x[-1]) == pytest.approx((0.35, 0.55), abs=1e-12)


def test_grid_of_three_factors_holds_the_third():
    design = central_composite([Factor(name, 0.0, 2.0) for name in "ABC"])
    response = design.points.to_numpy() @ [1.0, 2.0, 4.0]
    noise = np.random.default_rng(61).normal(scale=1e-9, size=len(response))
    surface = fit_surface(design, response + noise)
    centered, moved = (surface_grid(surface, at=at).mean for at in (None, {"C": 2.0}))
    assert moved - centered == pytest.approx(4.0, abs=1e-6)
    figure = plots.contour_plot(
        surface, 0.5, surface.nearest(0.5), surface.compatible_region(0.5, 0.2), x="C", y="A"
    )
    assert drawn(figure) > 50


def test_screening_figures_are_drawn(screening):
    pareto = plots.pareto_chart(screening)
    assert [bar.get_height() for bar in pareto.axes[0].patches] == pytest.approx(
        screening.table.sort_values("rank")["t"].abs().to_list()
    )
    assert drawn(pareto) > 50
    assert drawn(plots.half_normal_plot(screening)) > 50


def test_surface_figures_are_drawn(reduced, measured):
    assert drawn(plots.residual_plots(reduced)) > 50
    assert drawn(plots.surface_plot(reduced, TARGET)) > 50
    region = reduced.compatible_region(measured)
    figure = plots.contour_plot(reduced, TARGET, reduced.nearest(TARGET), region)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        f"compatible: {100.0 * region.fraction:.0f} %",
        "target 30.148",
        "runs",
        "chosen point",
    ]
    assert drawn(figure) > 50


def cube_data():
    design = full_factorial([Factor(name, 10.0, 20.0, "mm") for name in "abc"])
    x = design.points
    response = 50.0 + 4.0 * x["a"] - 2.0 * x["b"] + 3.0 * x["a"] * x["c"]
    return design, np.column_stack([response + 0.1, response - 0.1])


def test_main_effects_and_interactions_show_the_means():
    design, response = cube_data()
    axes = plots.main_effects_plot(design, response).axes[0]
    drawn_means = [line.get_ydata().tolist() for line in axes.lines[1:]]
    assert drawn_means == [
        pytest.approx([46.0, 54.0]),
        pytest.approx([52.0, 48.0]),
        pytest.approx([50.0, 50.0]),
    ]
    figure = plots.interaction_plot(design, response, "a", "c", "length")
    low, high = figure.axes[0].lines
    assert low.get_ydata().tolist() == pytest.approx([49.0, 51.0])
    assert high.get_ydata().tolist() == pytest.approx([43.0, 57.0])
    assert drawn(figure) > 50
    with pytest.raises(DesignError, match="must differ"):
        plots.interaction_plot(design, response, "a", "a")


def test_cube_shows_the_fitted_corners():
    design, response = cube_data()
    figure = plots.cube_plot(fit_surface(design, response, "interaction"))
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert sorted(texts[:8]) == sorted(["51", "53", "47", "49", "45", "59", "41", "55"])
    assert drawn(figure) > 50
    with pytest.raises(DesignError, match="three different ones"):
        plots.cube_plot(fit_surface(design, response, "first-order"), ["a", "b"])


def test_profiler_and_overlay(reduced):
    surfaces = {"angle": reduced}
    at = {"E": 0.48, "F": 0.45}
    figure = plots.profile_plot(surfaces, at, {"angle": Wish(28.0, 33.0, target=TARGET)})
    assert len(figure.axes) == 4
    line = figure.axes[0].lines[0]
    middle = reduced.predict(at)["mean"].iloc[0]
    assert np.interp(0.48, line.get_xdata(), line.get_ydata()) == pytest.approx(middle, rel=1e-9)
    assert drawn(figure) > 50
    overlay = plots.overlay_plot(surfaces, {"angle": (30.0, 31.0)}, point=at)
    assert [text.get_text() for text in overlay.legends[0].get_texts()] == ["angle 30 to 31", "all kept"]
    assert drawn(overlay) > 50
    with pytest.raises(DesignError, match="no value for factor 'F'"):
        plots.profile_plot(surfaces, {"E": 0.5})
    with pytest.raises(DesignError, match="limits for each"):
        plots.overlay_plot(surfaces, {})


def test_profiler_draws_categories():
    design = full_factorial([Factor("t", 0.0, 1.0), Category("kind", ["old", "new"])], levels=3)
    surface = fit_surface(design, np.arange(6.0) + np.array([0.0, 0.1, 0.0, 0.0, 0.2, 0.0]), "first-order")
    figure = plots.profile_plot({"y": surface}, {"t": 0.5, "kind": "old"})
    assert [label.get_text() for label in figure.axes[1].get_xticklabels()] == ["old", "new"]


def test_figures_are_drawn_on_given_axes(reduced, screening, measured):
    figure = Figure(figsize=(9.0, 6.0))
    axes = figure.subplots(2, 3).ravel()
    design, response = cube_data()
    noise = np.random.default_rng(7).normal(size=response.shape)
    effects = doe.two_level_effects(design, response + noise)
    drawings = [
        plots.pareto_chart(screening, axes=axes[0]),
        plots.half_normal_plot(effects, axes=axes[1]),
        plots.contour_plot(reduced, TARGET, axes=axes[2]),
        plots.overlay_plot({"angle": reduced}, {"angle": (30.0, None)}, axes=axes[3]),
        plots.residual_plots(reduced, (axes[4], axes[5])),
    ]
    assert all(drawing is figure for drawing in drawings)
    assert all(axis.has_data() for axis in axes)
    assert drawn(figure) > 50
