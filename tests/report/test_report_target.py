"""Pictures of one target: what is drawn where, read from the figure before
it is a PNG.
"""

import numpy as np
import pytest
from matplotlib import pyplot as plt

from craft import craft, row
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


def test_a_target_is_seen_from_three_sides_with_its_hinge_and_front(drawn, monkeypatch):
    monkeypatch.setattr(target_picture, "_motion_row", lambda *given: {})
    monkeypatch.setattr(target_picture, "_spectra", lambda *given: None)
    monkeypatch.setattr(target_picture, "_instants", lambda *given: None)
    cloud = craft()
    figure = drawn(target_picture, "target_picture", cloud)
    middle = (cloud.points.min(0) + cloud.points.max(0)) / 2
    half = 0.58 * np.ptp(cloud.points, axis=0).max()
    titles = {"from above": (0, 1), "from the right": (1, 2), "from behind": (0, 2)}
    for panel, (title, (across, up)) in zip(figure.axes[:3], titles.items(), strict=True):
        assert panel.get_title() == title and panel.get_aspect() == 1
        assert (panel.get_xlabel(), panel.get_ylabel()) == (
            target_picture.AXES[across],
            target_picture.AXES[up],
        )
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


def test_a_rotor_is_shown_at_four_instants_an_eighth_of_a_turn_apart_and_its_tip_draws_a_circle(
    drawn, monkeypatch
):
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
    assert [panel.get_title().split(", ")[1] for panel in figure.axes[3:5]] == [
        "0 of 12.5 ms",
        "1.562 of 12.5 ms",
    ]
