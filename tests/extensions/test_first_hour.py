"""The page of the first hour, which visits the core and all extensions, runs as it is printed."""

import numpy as np
import pytest
import yaml

import lowalt
from followed_pages import ROOT, SCHEMA, followed, linked_checkout
from lowalt.config import extensions
from lowalt.config.layers import load
from lowalt.files.yaml_files import load_yaml
from lowalt.shards.build import write_run


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to what a checkout holds, and the current folder of the test."""
    return linked_checkout(tmp_path, monkeypatch)


# A town at two bands, a target from its data sheet, two seconds of a walker, a network of its radar
# and of one station.
@pytest.mark.slow
def test_the_first_hour(checkout, capsys, monkeypatch):
    (checkout / "results/tiny").mkdir(parents=True)
    (checkout / "results/zoo").symlink_to(ROOT / "results/zoo")
    # The run itself: tests/test_notebooks.py. Here its data set, and one row of its table.
    config = load(["config/default.yaml", "config/tiny.yaml"], SCHEMA)
    (checkout / "results/tiny/config.yaml").write_text(yaml.safe_dump(config))
    write_run(lowalt.Dataset(config), checkout / "results/tiny", "image")
    (checkout / "results/tiny/confusion_by_snr.csv").write_text(
        "protocol,scheme,snr_db,category,predicted,samples\nunseen,ABC:VRP+TRP+VT,3,Bird,Bird,8\n"
    )
    block = load_yaml("config/measured/recognition.yaml") | {
        "size": 24,
        "echoes": {"train": 1, "validation": 1},
    }
    block["training"] |= {"steps": 1, "batch": 4, "validate_every": 1}
    (checkout / "quick.yaml").write_text(yaml.safe_dump(block))
    quick = {
        ".venv/bin/lowalt recording train walk.yaml --out my_radar": "--recognition quick.yaml"
    }
    printed, names = followed("../first_hour", checkout, monkeypatch, quick)
    said = capsys.readouterr().out
    assert (
        "(400, 256) sqrt(W) ('body', 'right inner wing'" in said and "('Bird',)\n[[100.]]" in said
    )
    assert names["alone"].scheme.record["name"] == "A:VRP+TRP+VT" and list(
        names["scores"]["by_snr_percent"]
    ) == [
        "3",
        "inf",
    ]
    assert "windows right" in printed and printed.count("windows hold a target") == 2
    for name, echo in {
        "town": names["echo"],
        "fourth": names["fourth"],
        "hexacopter": names["hexacopter"],
    }.items():
        assert (checkout / f"{name}.png").is_file()
        # In the cells around the target, the strongest line of the map is at the folded speed of
        # the target.
        spectrum = abs(
            np.fft.fftshift(np.fft.fft(np.hanning(400)[:, None] * echo.values, axis=0), axes=0)[
                ::-1
            ]
        )
        cell = int(echo.truth["observed_cell"].mean())
        line = spectrum[:, cell - 1 : cell + 3].max(axis=1)
        place = np.interp(echo.truth["observed_mps"].mean(), echo.speeds_mps, np.arange(400))
        assert line[max(0, int(place) - 25) : int(place) + 25].max() == line.max()
    # 12 dB/km, there and back.
    assert names["lost_db"] == pytest.approx(
        0.012 * 2 * names["dry"].truth["range_m"].mean(), rel=1e-3
    )
    assert names["fourth"].station == "D" and len(names["hexacopter"].parts) == 7
    assert "m600.yaml: 'm600'" in printed and "reading 1; another" in printed


def test_functions_of_extensions_stand_in_the_face_of_the_package():
    functions = extensions.offered("functions")
    assert set(functions) == {"draft_target", "inspect_recording"}
    for name, module in functions.items():
        assert getattr(lowalt, name).__module__ == module
    assert set(functions) <= set(dir(lowalt))
    with pytest.raises(AttributeError, match="no attribute 'hum'"):
        _ = lowalt.hum
