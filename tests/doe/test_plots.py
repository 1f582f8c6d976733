"""Figures: their numbers, and that each is drawn without a display."""

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy import stats

from doe import DesignError, Factor, central_composite, fit_surface, plots, steepest_path
from doe.plot_data import half_normal_points, normal_points, pareto_points, surface_grid

TARGET = 30.148


def drawn(figure: Figure) -> int:
    """Return the number of differing pixel values of the rendered figure."""
    with io.BytesIO() as buffer:
        figure.savefig(buffer, format="rgba", dpi=50)
        return len(np.unique(np.frombuffer(buffer.getvalue(), dtype=np.uint8)))


def test_pareto_points_are_ranked(screening):
    points = pareto_points(screening)
    assert list(points.index) == ["F", "E", "H", "D", "A", "B", "C", "G"]
    assert (np.diff(points["abs_t"]) < 0.0).all()


def test_half_normal_points_hold_all_columns(screening):
    points = half_normal_points(screening.effects)
    assert len(points) == 11
    assert points.index[-1] == "F"
    # The sixth of eleven sits at the median of the half-normal distribution.
    assert points["quantile"].iloc[5] == pytest.approx(stats.norm.ppf(0.75), rel=1e-12)


def test_normal_points_are_symmetric(reduced):
    points = normal_points(reduced.residuals)
    assert points["quantile"].to_numpy() == pytest.approx(-points["quantile"].to_numpy()[::-1], abs=1e-12)
    assert points["value"].is_monotonic_increasing


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


@pytest.mark.parametrize(
    ("x", "message"), [("Z", "no factor is named 'Z'"), ("F", "different factors, received 'F' twice")]
)
def test_grid_refuses(reduced, x, message):
    with pytest.raises(DesignError, match=message):
        surface_grid(reduced, x=x)


def test_screening_figures_are_drawn(screening):
    pareto = plots.pareto_chart(screening)
    assert [bar.get_height() for bar in pareto.axes[0].patches] == pytest.approx(
        screening.table.sort_values("rank")["t"].abs().to_list()
    )
    assert drawn(pareto) > 50
    assert drawn(plots.half_normal_plot(screening)) > 50


def test_climb_figure_shows_runs_prediction_and_target(screening, climb):
    path = steepest_path(screening, 5, factors=["E", "F"], step={"E": 0.06, "F": 0.1})
    figure = plots.climb_plot(path, climb["repose_angle_deg"], TARGET, target_sd=0.518)
    assert [line.get_label() for line in figure.axes[0].lines] == ["target 30.148", "predicted", "run"]
    assert drawn(figure) > 50


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
