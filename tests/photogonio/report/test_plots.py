"""Shaded balls against the formula; figures that give the same bytes twice."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.report import plots
from photogonio.report.ball import shaded_sphere, to_display
from photogonio.report.html import picture_bytes
from photogonio.report.misfit import correlation
from photogonio.report.sections import Table

ALBEDO = np.array([0.8, 0.4, 0.1])


def lambert(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    return np.broadcast_to(ALBEDO / np.pi, (len(incident), 3))


def oblique(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """Tells the two directions apart."""
    return np.column_stack([incident[:, 2], exit[:, 2], (incident * exit).sum(1)])


def test_a_lambertian_ball_is_the_cosine():
    light = np.array([0.6, 0.0, 0.8])
    ball = shaded_sphere(lambert, light, size=101)
    y, x = np.mgrid[50:-51:-1, -50:51] / 50.5
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    inside = x**2 + y**2 < 1
    assert (np.isfinite(ball[..., 0]) == inside).all()
    expected = np.maximum(0.6 * x + 0.8 * z, 0)[..., None] * ALBEDO
    np.testing.assert_allclose(ball[inside], expected[inside], atol=1e-12)


def test_directions_on_the_ball_are_those_of_light_and_viewer():
    light = np.array([0.0, 0.6, 0.8])
    ball = shaded_sphere(oblique, light, size=101)
    assert np.isnan(ball[0, 0]).all()
    # at the middle the normal is the viewer's direction
    np.testing.assert_allclose(ball[50, 50], np.pi * 0.8 * np.array([0.8, 1.0, 0.8]), atol=1e-12)


def test_display_is_srgb():
    image = np.array([[[0.0, 0.5, 2.0], [np.nan, np.nan, np.nan]]])
    shown = to_display(image, white=1.0, background=0.25)
    np.testing.assert_allclose(shown[0, 0], [0, 0.735357, 1], atol=1e-6)
    np.testing.assert_array_equal(shown[0, 1], [0.25] * 3)


def test_correlation():
    x = np.array([1.0, 2.0, 3.0, np.nan])
    assert correlation(x, 5 - 2 * x) == pytest.approx(-1)
    assert np.isnan(correlation(x, np.ones(4)))


def test_figures_give_the_same_bytes_twice():
    rng = np.random.default_rng(0)
    angles = rng.uniform(0, 1.4, (4, 200))
    value = rng.uniform(0.1, 0.2, (200, 3))
    table = samples_table(GoniometerSamples(*angles, value, None, ("R", "G", "B")))
    draw = {
        "coverage": lambda: plots.coverage_figure(table),
        "fit": lambda: plots.scatter_figure(value, value * 1.01, "RGB"),
        "overview": lambda: plots.overview_figure(lambert, "RGB", "title"),
    }
    for name, figure in draw.items():
        kind = "svg" if name == "overview" else "png"
        first, second = (picture_bytes(figure(), kind=kind, source="here") for _ in range(2))
        assert first == second
        assert b"here" in first


def test_numbers_are_aligned_right_and_words_left():
    table = Table(("name", "value", "mixed"), [("a", "1.5", "2"), ("b", "-2e-3", "no")])
    assert [table.numeric(k) for k in range(3)] == [False, True, False]


def test_draws_are_balls_at_one_exposure():
    """Of two that differ, one is darker; a third place stays empty."""
    shades = [lambda i, r, f=f: np.full((len(i), 3), f / np.pi) for f in (0.4, 0.8, 0.8)]
    figure = plots.draws_figure(shades, "three")
    pictures = [ax.images[0].get_array() for ax in figure.axes if ax.images]
    assert len(figure.axes) == 4 and len(pictures) == 3
    middle = [float(np.asarray(one)[80, 80, 0]) for one in pictures]
    assert middle[0] < middle[1] == middle[2]


def test_of_a_spectrum_a_few_channels_are_drawn():
    names, value = [str(k) for k in range(400, 710, 10)], np.random.default_rng(0).uniform(0.1, 0.2, (50, 31))
    few = plots.drawn_channels(names)
    assert few == ["400", "460", "520", "580", "640", "700"]
    titles = [ax.get_title().split(",")[0] for ax in plots.scatter_figure(value, value, names).axes]
    assert titles == few
    drawn = plots.lobes_figure(lambda i, o: np.tile(value[:1], (len(o), 1)), names)
    assert [text.get_text() for text in drawn.axes[0].get_legend().get_texts()] == few
    assert plots.drawn_channels("RGB") == ["R", "G", "B"]
