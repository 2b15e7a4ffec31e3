"""Pictures whose layout a solver finds: their places are round numbers, so that every process draws
the same bytes.
"""

import numpy as np
import pytest
from matplotlib.figure import Figure

from lowalt.numerics.picture_layout import DIGITS, settle

SHIFT = 1e-13
"""A thousand times the difference between the solver's answers in two processes."""


def drawing() -> Figure:
    """A figure with sub-figures, one in another, and axes of equal scales in each, as in the
    picture of all clouds.
    """
    result = Figure(figsize=(5, 6), layout="constrained")
    top, bottom = result.subfigures(2, 1, height_ratios=[1, 2.3])
    for part in (top, bottom.subfigures(1, 2, width_ratios=[1, 1.7])[1]):
        axes = part.subplots(1, 3)
        axes[0].set_title("two\nlines", fontsize=7)
        axes[1].set_aspect("equal")
        axes[2].set_ylabel("speed (m/s)")
    return result


def places(figure: Figure) -> np.ndarray:
    """The extents of all axes, in shares of their sub-figure, and of all sub-figures, in shares of
    the one around.
    """
    parts = list(figure.subfigs)
    for part in parts:
        parts += part.subfigs
    boxes = [axes.get_position(original=True) for axes in figure.axes]
    return np.array([box.extents for box in (*boxes, *(part.bbox_relative for part in parts))])


def test_an_answer_that_differs_in_its_last_bits_gives_the_same_places(monkeypatch):
    """As another process's solver would find it: every place a little elsewhere before it is
    rounded.
    """
    once = drawing()
    settle(once, 110)
    twice = drawing()
    draw = twice.draw_without_rendering

    def elsewhere() -> None:
        draw()
        parts = list(twice.subfigs)
        for part in parts:
            parts += part.subfigs
            part.bbox_relative.set_points(part.bbox_relative.get_points() + SHIFT)
        for axes in twice.axes:
            place = axes.get_position(original=True)
            axes.set_position(place.from_extents(place.extents + SHIFT))

    monkeypatch.setattr(twice, "draw_without_rendering", elsewhere)
    settle(twice, 110)
    np.testing.assert_array_equal(places(twice), places(once))


@pytest.mark.parametrize("dpi", [72, 110, 150])
def test_laid_out_at_the_resolution_of_the_file(dpi):
    """The width of letters depends on it: what was laid out for one resolution is not right for
    another.
    """
    free = drawing()
    settled = drawing()
    free.set_dpi(dpi)
    free.draw_without_rendering()
    settle(settled, dpi)
    assert settled.dpi == dpi
    found = places(settled)
    np.testing.assert_array_equal(found, found.round(DIGITS))
    # Nothing moves when the figure is drawn, and all parts count for a tight picture.
    settled.draw_without_rendering()
    np.testing.assert_array_equal(places(settled), found)
    assert all(axes.get_in_layout() for axes in settled.axes)
    np.testing.assert_allclose(places(settled), places(free), rtol=0, atol=10.0**-DIGITS)


def test_a_figure_without_engine_is_left_alone():
    """Axes placed by hand stay where they are, to the last bit."""
    figure = Figure()
    axes = figure.add_axes((1 / 3, 1 / 7, 0.5, 2 / 3))
    before = axes.get_position().extents.copy()
    settle(figure, 110)
    np.testing.assert_array_equal(axes.get_position().extents, before)
    assert figure.dpi != 110
