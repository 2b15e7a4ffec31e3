"""One network for any radar: its axis means the same speeds at every radar, no drawn radar is a
measured one, and its table stands next to what the radars' own networks say.
"""

from dataclasses import replace

import any_radar
import numpy as np
import pytest
import yaml
from any_radar import View, alike, drawn_twin, image, own_rows, rendered
from refused import REFUSED, Asked, leaning_for, leant, over_seeds, refusals
from scipy.io import wavfile

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.answers import Answers
from lowalt.extensions.recordings.twin import Twin, radars
from lowalt.extensions.recordings.twin_scenes import intervals
from lowalt.files.csv_tables import read_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import stream
from lowalt.recognition import model_file

SIZE = 32
VIEW = View(0.1, 0.2, 60.0, "logarithmic")
MILLIMETRES = Twin(77e9, "complex", 30e3, 1 / 15e3, 4500, "anti_aliased", 0.0, 12.0)


def line(twin, speed_mps):
    """An interval of a target at one radial speed."""
    hertz = 2 * speed_mps * twin.carrier_hz / SPEED_OF_LIGHT
    return np.exp(2j * np.pi * hertz * twin.symbol_interval_s * np.arange(twin.symbols))


@pytest.mark.parametrize("speed_mps", [3.0, 5.0])
def test_a_line_stands_in_the_row_of_its_speed_at_every_radar(speed_mps):
    edges = VIEW.edges_mps(SIZE)
    expected = SIZE - np.searchsorted(edges, speed_mps)
    twins = [*radars().values(), MILLIMETRES]
    for twin in twins:
        found = image(line(twin, speed_mps), twin, VIEW, SIZE).argmax(axis=0)
        # A transform of 0.1 s at 3.3 GHz has cells of half a metre per second.
        assert np.abs(found - expected).max() <= 1
        unheard = edges[:-1] >= 1.1 * twin.fastest_mps
        picture = rendered(line(twin, speed_mps)[None], twin, [VIEW], 40.0, SIZE)[0, 0]
        assert not picture[::-1][unheard].any() and picture.max() == 255


def test_towards_and_away_look_alike_and_a_one_sided_line_beyond_the_edge_stays_at_its_speed():
    away = image(line(MILLIMETRES, 4.0), MILLIMETRES, VIEW, SIZE)
    towards = image(line(MILLIMETRES, -4.0), MILLIMETRES, VIEW, SIZE)
    np.testing.assert_allclose(away, towards, rtol=1e-6, atol=1e-6 * away.max())
    twin = radars()["cw_24ghz"]
    assert twin.edge_mps < 14.0 < twin.fastest_mps
    found = image(line(twin, 14.0), twin, VIEW, SIZE).argmax(axis=0)
    assert (found == SIZE - np.searchsorted(VIEW.edges_mps(SIZE), 14.0)).all()


def test_drawn_radars_lie_in_their_ranges_and_none_is_a_measured_one():
    block = load_yaml(any_radar.SETTINGS)
    measured = [*radars().values()]
    drawn = [drawn_twin(block, measured, stream(1, "test", number)) for number in range(300)]
    assert drawn[:3] == [drawn_twin(block, measured, stream(1, "test", k)) for k in range(3)]
    carriers = np.array([twin.carrier_hz for twin in drawn])
    assert 2e9 <= carriers.min() < 3e9 and 60e9 < carriers.max() <= 80e9
    for twin in drawn:
        assert Twin.from_settings(vars(twin)) == twin
        assert 0.15 < twin.symbols * twin.symbol_interval_s < 0.61
        one_sided = twin.sampling == "one_sided"
        assert 4.99 < twin.edge_mps * (2 if one_sided else 1) < 60.01
        assert not any(alike(twin, other, block["apart"]) for other in measured)
    assert {(twin.channel, twin.sampling) for twin in drawn} == {
        (channel, one) for channel, of in block["samplings"].items() for one in of
    }
    # A radar that is drawn as a measured one is drawn again.
    first = drawn_twin(block, [], stream(1, "test", 0))
    near = replace(first, carrier_hz=1.05 * first.carrier_hz)
    again = drawn_twin(block, [near], stream(1, "test", 0))
    assert alike(first, near, block["apart"]) and not alike(again, near, block["apart"])


@pytest.mark.slow
def test_the_table_has_each_labelled_recording_next_to_the_radar_s_own_network(
    tmp_path, monkeypatch
):
    """Networks of two steps: what they say is of no use, where it stands is."""
    images = []
    courses = set()
    known_windows = []

    def drawn_from(twin, scene, *given):
        """Draw intervals and note from which scene."""
        courses.add((scene.get("course"), "scene" in scene.get("second", {})))
        return intervals(twin, scene, *given)

    def refused_by(known, *given):
        """Count refusals and note how many windows set the constant."""
        known_windows.append(len(known))
        return refusals(known, *given)

    def noted(*given):
        """Make images and note of how many intervals."""
        images.append(len(given[0]))
        return rendered(*given)

    def of_one_class(path):
        """Rows of the class asked about: others change none of its rows, but cost bootstraps."""
        asked = ("cw_24ghz", "tuning", "Pedestrian")
        return [row for row in own_rows(path) if (row[0], row[4], row[6]) == asked]

    monkeypatch.setattr(any_radar, "intervals", drawn_from)
    monkeypatch.setattr(any_radar, "refusals", refused_by)
    monkeypatch.setattr(any_radar, "rendered", noted)
    monkeypatch.setattr(any_radar, "own_rows", of_one_class)
    folder = tmp_path / "inputs/walker_24ghz"
    folder.mkdir(parents=True)
    rate = 6000
    time = np.arange(5 * rate) / rate
    wave = np.cos(2 * np.pi * 2 * 3.0 * 24e9 / SPEED_OF_LIGHT * time) * (time > 1)
    noise = np.random.default_rng(0).standard_normal(len(time))
    tone = (20000 * (0.2 * wave + 0.01 * noise)).astype(np.int16)
    wavfile.write(folder / "PCM2900_Best_Walking_Data.wav", rate, tone)
    room = np.random.default_rng(1).integers(-9, 9, (8000, 8))
    (tmp_path / "inputs/fourth").mkdir()
    np.savetxt(tmp_path / "inputs/fourth/roomtone.txt", room, "%d")
    # A car in front of another radar has a label, and is not asked about as one without a class.
    wavfile.write(tmp_path / "inputs/fourth/Car40kmh.wav", rate, tone)
    block = load_yaml(any_radar.SETTINGS)
    block |= {"radars": {"train": 2, "validation": 1, "test": 2}, "receivers": 1}
    block["echoes"] = {"usual": 1, "any speed": 1, "none of these": 2}
    steps = {"any": 2, "refusing": 3}
    for name, network in block["networks"].items():
        network["steps"] = steps[name]
    block |= {"carrier_hz": [8e9, 10e9], "fastest_mps": [8.0, 9.0], "symbols": [200, 500]}
    block["recognition"] |= {
        "seeds": [0, 1],
        "training": {"batch": 4, "validate_every": 1},
    }
    (tmp_path / "settings.yaml").write_text(yaml.safe_dump(block))
    options = {
        "inputs": tmp_path / "inputs",
        "out": tmp_path / "out",
        "models": tmp_path / "models",
        "settings": tmp_path / "settings.yaml",
    }
    any_radar.main([word for key, path in options.items() for word in (f"--{key}", str(path))])
    rows = read_csv(tmp_path / "out/measured-any-radar.csv", *any_radar.COLUMNS)
    assert [(row["radar"], row["half"], row["class"]) for row in rows] == [
        (radar, "tuning", "Pedestrian") for radar in ("cw_24ghz", "any")
    ]
    assert {row["windows"] for row in rows} == {"12"}
    # Three folds have an interval of each class; then both networks are asked about the recording.
    assert images[:7] == [4, 4, 4, 4, 4, 12, 12]
    # The network that refuses learns from two sets of scenes, and from two echoes of no class.
    assert images[7:22] == [4, 4, 4, 4, 2, 2, 4, 4, 2, 4, 4, 4, 4, 2, 2]
    # Of the scenes at any speed, radars take one after the other.
    assert {("pass", False), ("pass", True), ("to_and_fro", False)} <= courses
    assert known_windows == [8, 8]
    for name, count in steps.items():
        for seed in (0, 1):
            trained = model_file.read(tmp_path / f"models/{name}-{seed}/model.safetensors")
            assert trained.identity["settings"]["training"]["steps"] == count
    kept = read_csv("results/reference/measured-accuracy.csv")
    own = [row for row in kept if (row["radar"], row["half"]) == ("cw_24ghz", "tuning")]
    of_class = next(row for row in own if row["class"] == "Pedestrian")
    for key in ("right_percent", "low", "named_percent"):
        # The kept cells of each file are rounded as well.
        assert float(rows[0][f"own_{key}"]) == pytest.approx(float(of_class[key]), rel=1e-4)
    simulated = read_csv(tmp_path / "out/measured-any-radar-simulated.csv", *any_radar.SIMULATED)
    assert len(simulated) == 8 and {row["windows"] for row in simulated} == {"2"}
    refused = read_csv(tmp_path / "out/measured-refused.csv", *REFUSED)
    assert {float(row["kept_percent"]) for row in refused} == {99.0, 95.0, 90.0, 80.0}
    walks = [row for row in refused if row["half"] == "tuning"]
    assert {(row["radar"], row["what"], row["windows"]) for row in walks} == {
        ("cw_24ghz", "Pedestrian", "12")
    }
    foreign = {row["radar"] for row in refused if row["half"] == "foreign"}
    assert foreign == {*radars(), "hb100"}
    drawn = tmp_path / "out/refused-empty-room-at-24-GHz.png"
    assert [*tmp_path.glob("out/*.png")] == [drawn] and drawn.read_bytes()[:4] == b"\x89PNG"


def test_a_share_of_the_known_windows_is_kept_whatever_the_network_says_of_them():
    rng = np.random.default_rng(0)
    shares = rng.dirichlet(np.ones(5), 1000)
    for kept_percent in (50.0, 90.0, 95.0):
        leaning = leaning_for(shares, kept_percent)
        said = leant(shares, leaning)
        assert 100 * (said.argmax(axis=1) < 4).mean() == pytest.approx(kept_percent, abs=0.2)
        np.testing.assert_allclose(said.sum(axis=1), 1)
        # The constant does not change which known class is the most probable.
        np.testing.assert_array_equal(said[:, :4].argmax(axis=1), shares[:, :4].argmax(axis=1))


def test_windows_count_as_named_where_they_get_a_known_class():
    """A recording of four windows: a bird, a walker that is refused, a hand that is named, noise."""
    shares = np.eye(5)[[1, 4, 0, 2]] * 0.9 + 0.02
    there = np.array([True, True, True, False])
    said = Answers(
        np.arange(4.0), there, shares, ~there & False, np.full(4, np.nan), ~there & False, 20.0, []
    )
    one = Asked("a", "test", ["Bird", "Pedestrian", "hand", "hand"], said)
    known = np.full((10, 5), 0.2)
    counted = refusals(known, (shares, ["Bird", "Pedestrian", "fan", "rain"]), [one, one], [95])
    assert counted[95, "a", "test", "Bird"] == (2, 2, 2, 2)
    assert counted[95, "a", "test", "Pedestrian"] == (2, 2, 0, 0)
    assert counted[95, "a", "test", "hand"] == (4, 2, 2, 2)
    assert counted[95, "random radars", "simulated", "rain"] == (1, 1, 1, 0)
    other = {key: value._replace(named=0) for key, value in counted.items()}
    rows = {row[3]: row for row in over_seeds([counted, other])}
    assert rows["hand"] == [95, "a", "test", "hand", 4, 50.0, 25.0, 0.0, 50.0, 50.0]
