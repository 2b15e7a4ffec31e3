"""Pictures of points next to the page: their tables hold the points that are drawn, and files repeat."""

import csv

import numpy as np

from craft import craft, row
from lowalt.motion import positions
from lowalt.recognition.distances import cycle_s, still_row
from lowalt.report.figures.motion_strip import strip_figure, strip_rows
from lowalt.report.figures.stills import cloud_points, write_stills
from lowalt.report.figures.style import png


def test_tables_hold_every_point_that_is_drawn():
    cloud, moving = craft(), row(0)
    found = cloud_points([cloud])
    assert np.allclose([[one[key] for key in ("x_m", "y_m", "z_m")] for one in found], cloud.points, atol=5.1e-5)
    assert [one["part"] for one in found] == cloud.part.tolist()
    rows = strip_rows([cloud], [{**moving, "category": "UAV"}])
    times = np.arange(7) / 7 * cycle_s(cloud, moving)
    wanted = positions(cloud, still_row(moving), times).reshape(-1, 3)
    assert np.allclose([[one[key] for key in ("x_m", "y_m", "z_m")] for one in rows], wanted, atol=5.1e-5)
    assert np.allclose(sorted({one["time_ms"] for one in rows}), 1000 * times, rtol=1e-5)


def test_files_repeat_and_the_svg_of_clouds_holds_their_picture(tmp_path):
    cloud, moving = craft(), {**row(0), "category": "UAV"}
    picture = png(strip_figure([cloud], [moving]))
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_stills(tmp_path / name, [cloud], picture, [moving])
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["clouds.csv", "clouds.svg", "motion.csv", "motion.svg"]
    assert all((tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes() for name in names)
    assert "data:image/png;base64" in (tmp_path / "one/clouds.svg").read_text()
    assert (tmp_path / "one/motion.svg").read_text().count("<use") > len(cloud.points)
    with (tmp_path / "one/clouds.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(cloud.points)
