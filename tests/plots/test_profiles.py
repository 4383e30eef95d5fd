"""Pictures of profiles."""

import numpy as np

from projdist import plots, profile


def test_curves_are_the_profile() -> None:
    """A panel for the scale, one for heights, one a measure; parts per million at the right are off 1."""
    found = profile("EPSG:32632", [(9, 48, 300), (10, 48, 500), (12, 49, 400)], measures=["convergence", "omega"])
    figure = plots.profile_figure(found)
    scale, ppm, height, convergence, _ = figure.axes
    curves = scale.get_lines()
    np.testing.assert_array_equal(curves[0].get_xdata(), found.distance_km)
    np.testing.assert_array_equal(curves[0].get_ydata(), found.scale)
    np.testing.assert_array_equal(height.get_lines()[0].get_ydata(), found.height)
    np.testing.assert_array_equal(convergence.get_lines()[0].get_ydata(), found.measures["convergence"])
    np.testing.assert_allclose(ppm.get_ylim(), 1e6 * (np.array(scale.get_ylim()) - 1.0))
    assert f"mean {found.mean_scale:.7g}" in scale.get_legend().get_texts()[0].get_text()


def test_curves_end_where_the_map_is_torn() -> None:
    """No line is drawn across the antimeridian, where Robinson's map is cut."""
    figure = plots.profile_figure(profile("robin", [(170, 10), (-170, 30)]))
    values = figure.axes[0].get_lines()[0].get_ydata()
    assert np.isnan(values).sum() == 1
    plain = plots.profile_figure(profile("robin", [(150, 10), (170, 30)]))
    assert not np.isnan(plain.axes[0].get_lines()[0].get_ydata()).any()
