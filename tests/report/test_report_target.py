"""Pictures of one target and of an inspected mesh: what is drawn where, read from the figure before it is a PNG."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.colors import to_rgba

from craft import craft, row
from lowalt.extensions.drafting import mesh_picture
from lowalt.extensions.drafting.guesses import Component
from lowalt.extensions.drafting.inspection import Inspection
from lowalt.report.figures import target_picture


@pytest.fixture
def drawn(monkeypatch):
    """A function that draws a picture and returns its figure."""

    def draw(module, name, *given):
        figures = []
        monkeypatch.setattr(module, "png", lambda figure: figures.append(figure) or b"")
        getattr(module, name)(*given)
        return figures[0]

    yield draw
    plt.close("all")


def offsets(panel) -> np.ndarray:
    return panel.collections[0].get_offsets()


def test_an_inspection_shows_each_plane_at_one_scale_and_what_may_move_in_colours(drawn):
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.1], [2.0, 1.0, 0.2], [-2.0, 3.0, 0.4]])
    low, high = points.min(axis=0), points.max(axis=0)
    parts = [
        Component(7, low, high, 9, True, ""),
        *(Component(i, low + i, high + i, 3, True, "", "wheel") for i in (2, 5)),
    ]
    found = Inspection(
        Path("a$b.obj"), "in", "given", low, high, 4, "z", "y", [], parts, "Vehicle", points, np.array([7, 2, 5, 7])
    )
    figure = drawn(mesh_picture, "inspection_picture", found)
    assert figure.get_suptitle() == r"a\$b.obj: unit in (given); guessed: up z, front y"
    for panel, (across, up) in zip(figure.axes, [(0, 1), (1, 2), (0, 2)], strict=True):
        np.testing.assert_array_equal(offsets(panel), points[:, [across, up]])
        labels = panel.get_xlabel(), panel.get_ylabel()
        assert labels == tuple(f"the file's {'xyz'[axis]} (m)" for axis in (across, up)) and panel.get_aspect() == 1
        assert [(text.get_text(), *text.get_position()) for text in panel.texts] == [
            ("wheel", part.centre[across], part.centre[up]) for part in parts[1:]
        ]
        colours = panel.collections[0].get_facecolors()
        np.testing.assert_allclose(colours[1:3], [to_rgba("tab:blue"), to_rgba("tab:orange")])
        np.testing.assert_array_equal(colours[0], colours[3])


def test_an_inspected_bird_has_its_shoulders_marked_on_both_sides(drawn):
    body = np.stack(np.broadcast_arrays(np.linspace(-0.1, 0.1, 41), 0.0, [[-0.05], [0.05]]), -1).reshape(-1, 3)
    wings = np.stack(np.broadcast_arrays([[-1.0], [1.0]] * np.linspace(0.11, 1, 41), 0.0, 0.0), -1).reshape(-1, 3)
    points = np.concatenate([body, wings]) + np.array([3.0, 0.0, 0.0])
    low, high = points.min(axis=0), points.max(axis=0)
    found = Inspection(
        Path("crow.stl"), "m", "given", low, high, 1, "z", "y", [], [], "Bird", points, np.zeros(len(points), int)
    )
    figure = drawn(mesh_picture, "inspection_picture", found)
    assert 0.1 < found.shoulder_m < 0.15
    sides = [3.0 - found.shoulder_m, 3.0 + found.shoulder_m]
    top, side, front = figure.axes
    assert not side.lines
    for panel in (top, front):
        assert [line.get_xdata()[0] for line in panel.lines] == pytest.approx(sides)
    assert figure.get_suptitle().endswith(", wings beyond the dashed lines")


def test_a_target_is_seen_from_three_sides_with_its_hinge_and_front(drawn, monkeypatch):
    monkeypatch.setattr(target_picture, "_motion_row", lambda *given: {})
    monkeypatch.setattr(target_picture, "_spectra", lambda *given: None)
    monkeypatch.setattr(target_picture, "_instants", lambda *given: None)
    cloud = craft()
    figure = drawn(target_picture, "target_picture", cloud)
    middle, half = (cloud.points.min(0) + cloud.points.max(0)) / 2, 0.58 * np.ptp(cloud.points, axis=0).max()
    titles = {"from above": (0, 1), "from the right": (1, 2), "from behind": (0, 2)}
    for panel, (title, (across, up)) in zip(figure.axes[:3], titles.items(), strict=True):
        assert panel.get_title() == title and panel.get_aspect() == 1
        assert (panel.get_xlabel(), panel.get_ylabel()) == (target_picture.AXES[across], target_picture.AXES[up])
        np.testing.assert_array_equal(offsets(panel), cloud.points[:, [across, up]])
        hinge = np.array(panel.lines[-1].get_xydata())
        np.testing.assert_allclose(hinge, [cloud.hinges[1, [across, up]]])
        body, rotor = panel.collections[0].get_facecolors()[[0, -1]]
        assert not np.allclose(body, rotor)
        arrows = [(np.array(text.xyann), np.array(text.xy)) for text in panel.texts]
        assert len(arrows) == (1 in (across, up))
        for start, tip in arrows:
            # The arrow points along y and stays inside of the panel.
            assert (np.sign((tip - start).round(9)) == [across == 1, up == 1]).all()
            assert (abs(np.array([start, tip]) - middle[[across, up]]) < half).all()
    assert figure.get_suptitle().startswith("DJI Mini 2 (UAV, test): 20 points, 2 parts, ")


def test_a_rotor_is_shown_at_four_instants_an_eighth_of_a_turn_apart_and_its_tip_draws_a_circle(drawn, monkeypatch):
    monkeypatch.setattr(target_picture, "_motion_row", lambda *given: row(0))
    monkeypatch.setattr(target_picture, "_spectra", lambda *given: None)
    cloud = craft()
    figure = drawn(target_picture, "target_picture", cloud)
    angles = []
    for panel in figure.axes[3:7]:
        path, tip = (np.array(line.get_xydata()) for line in panel.lines)
        radii = np.linalg.norm(path - cloud.hinges[1, :2], axis=1)
        np.testing.assert_allclose(radii, radii[0], rtol=1e-9)
        blade = cloud.points[cloud.part == 1] - cloud.hinges[1]
        assert radii[0] == pytest.approx(np.linalg.norm(blade[:, :2], axis=1).max())
        angles.append(np.arctan2(*(tip[0] - cloud.hinges[1, :2])[::-1]))
        assert len(offsets(panel)) == len(cloud.points)
    np.testing.assert_allclose(np.abs(np.diff(np.unwrap(angles))), 2 * np.pi / 8)
    assert [panel.get_title().split(", ")[1] for panel in figure.axes[3:5]] == ["0 of 12.5 ms", "1.562 of 12.5 ms"]
