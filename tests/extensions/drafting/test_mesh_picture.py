"""The picture of an inspected mesh: what is drawn where, read from the figure before it is a PNG."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_rgba

from lowalt.extensions.drafting import mesh_picture
from lowalt.extensions.drafting.guesses import Component
from lowalt.extensions.drafting.inspection import Inspection


@pytest.fixture
def drawn(monkeypatch):
    """A function that draws the picture of an inspection and returns its figure."""

    def draw(found):
        figures = []
        monkeypatch.setattr(mesh_picture, "png", lambda figure: figures.append(figure) or b"")
        mesh_picture.inspection_picture(found)
        return figures[0]

    yield draw
    plt.close("all")


def offsets(panel) -> np.ndarray:
    return panel.collections[0].get_offsets()


def test_an_inspection_shows_each_plane_at_one_scale_and_what_may_move_in_colours(drawn):
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.1], [2.0, 1.0, 0.2], [-2.0, 3.0, 0.4]])
    low = points.min(axis=0)
    high = points.max(axis=0)
    parts = [
        Component(7, low, high, 9, True, ""),
        *(Component(i, low + i, high + i, 3, True, "", "wheel") for i in (2, 5)),
    ]
    found = Inspection(
        Path("a$b.obj"),
        "in",
        "given",
        low,
        high,
        4,
        "z",
        "y",
        [],
        parts,
        "Vehicle",
        points,
        np.array([7, 2, 5, 7]),
    )
    figure = drawn(found)
    assert figure.get_suptitle() == r"a\$b.obj: unit in (given); guessed: up z, front y"
    for panel, (across, up) in zip(figure.axes, [(0, 1), (1, 2), (0, 2)], strict=True):
        np.testing.assert_array_equal(offsets(panel), points[:, [across, up]])
        labels = panel.get_xlabel(), panel.get_ylabel()
        assert (
            labels == tuple(f"the file's {'xyz'[axis]} (m)" for axis in (across, up))
            and panel.get_aspect() == 1
        )
        assert [(text.get_text(), *text.get_position()) for text in panel.texts] == [
            ("wheel", part.centre[across], part.centre[up]) for part in parts[1:]
        ]
        colours = panel.collections[0].get_facecolors()
        np.testing.assert_allclose(colours[1:3], [to_rgba("tab:blue"), to_rgba("tab:orange")])
        np.testing.assert_array_equal(colours[0], colours[3])


def test_an_inspected_bird_has_its_shoulders_marked_on_both_sides(drawn):
    body = np.stack(
        np.broadcast_arrays(np.linspace(-0.1, 0.1, 41), 0.0, [[-0.05], [0.05]]), -1
    ).reshape(-1, 3)
    wings = np.stack(
        np.broadcast_arrays([[-1.0], [1.0]] * np.linspace(0.11, 1, 41), 0.0, 0.0), -1
    ).reshape(-1, 3)
    points = np.concatenate([body, wings]) + np.array([3.0, 0.0, 0.0])
    low = points.min(axis=0)
    high = points.max(axis=0)
    found = Inspection(
        Path("crow.stl"),
        "m",
        "given",
        low,
        high,
        1,
        "z",
        "y",
        [],
        [],
        "Bird",
        points,
        np.zeros(len(points), int),
    )
    figure = drawn(found)
    assert 0.1 < found.shoulder_m < 0.15
    sides = [3.0 - found.shoulder_m, 3.0 + found.shoulder_m]
    top, side, front = figure.axes
    assert not side.lines
    for panel in (top, front):
        assert [line.get_xdata()[0] for line in panel.lines] == pytest.approx(sides)
    assert figure.get_suptitle().endswith(", wings beyond the dashed lines")
