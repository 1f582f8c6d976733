"""The charts hold the numbers of the results."""

import pytest

from experiments.calibrate import Campaign
from experiments.report.stage_charts import half_normal_chart, pareto_chart
from experiments.report.surface_charts import surface_charts


def test_the_pareto_chart_holds_every_effect_and_the_critical_values(campaign: Campaign) -> None:
    screen = campaign.screening.leading.screen
    traces = pareto_chart(screen, 0.10, campaign.responses[0]).figure.data
    bars = {
        name: size
        for trace in traces
        if trace.type == "bar"
        for name, size in zip(trace.y, trace.x, strict=True)
    }
    assert bars == screen.table["t"].abs().to_dict()
    lines = sorted(trace.x[0] for trace in traces if trace.type == "scatter")
    # Two-sided t on 3 degrees of freedom at 0.10, 0.05 and 0.05 / 11, as tabulated.
    assert lines == pytest.approx([2.35336, 3.18245, 7.70406], abs=5e-6)


def test_the_half_normal_chart_holds_dummies_too(campaign: Campaign) -> None:
    traces = half_normal_chart(campaign.screening.leading.screen, 0.10, campaign.responses[0]).figure.data
    drawn = sum(len(trace.text) for trace in traces if trace.text is not None)
    assert drawn == campaign.screening.design.coded.shape[1] == 11


def test_the_drawn_region_is_the_compatible_region(campaign: Campaign) -> None:
    chart = next(
        chart
        for chart in surface_charts(
            campaign.surface, campaign.optimum, campaign.target, campaign.responses[0]
        )
        if chart.name == "contour-E-F"
    )
    [cells] = [trace for trace in chart.figure.data if trace.type == "heatmap"]
    region = campaign.optimum.region
    drawn = {
        (e, f)
        for row, f in zip(cells.z, cells.y, strict=True)
        for inside, e in zip(row, cells.x, strict=True)
        if inside
    }
    expected = set(region.natural[region.mask].itertuples(index=False, name=None))
    assert drawn == expected
