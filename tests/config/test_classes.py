"""Classes are the words of the table of targets, stations those of the network: all go from clouds
to the page.
"""

import json
import re

import numpy as np
import pytest
import yaml

from chain import SIZE, SNRS, TARGETS, WAVE, recognised, reported, simulated
from lowalt.config import classes
from lowalt.config.layers import load, merge
from lowalt.config.network import Network, station_names
from lowalt.files.atomic import sha256
from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.recognition import schemes
from lowalt.report.page import PARTS
from lowalt.targets.records import load_table
from lowalt.targets.records import merge as merged
from pages import sound

STATIONS = ("west", "A", "east", "B2", "north")
"""Not in alphabetical order, of one letter and of more."""
PLACES = {
    name: {"position_m": [100.0 * number, 20.0 * number, 25.0], "normal_deg": 60.0 + 10 * number}
    for number, name in enumerate(STATIONS)
}
FIVE = {**TARGETS, "Glider": "Fixed-wing", "DJI Avata": "UAV"}
TWO = {"Heron": "Large bird", "Crow": "Small bird", "Eagle": "Large bird"}
TABLE = "config/targets.csv"


def rows(targets):
    """Rows of a table of targets: those of the published craft under these names and classes."""
    row = load_table(TABLE)["DJI Mini 2"]
    return {name: row | {"name": name, "category": category} for name, category in targets.items()}


@pytest.mark.parametrize(
    ("count", "targets"), [(1, FIVE), (5, TWO)], ids=["five classes", "five stations"]
)
def test_every_command_takes_the_classes_of_the_table_and_any_stations(tmp_path, count, targets):
    pytest.importorskip("torch")
    names = tuple(dict.fromkeys(targets.values()))
    network = WAVE | {"stations": {name: PLACES[name] for name in STATIONS[:count]}}
    schema = "workflow/schemas/config.schema.yaml"
    config = load(["config/default.yaml"], schema) | {
        "run": "own",
        "network": network,
        "noise": {"snr_db": SNRS},
    }
    clouds = simulated(tmp_path, network, targets)
    stations = sorted(STATIONS[:count])
    from lowalt.recognition.runs import load as load_model
    from lowalt.recognition.score import score
    from lowalt.shards import ShardSet
    from lowalt.shards.card import description
    from lowalt.shards.croissant import metadata

    shards = ShardSet(tmp_path / "index.json")
    assert shards.classes == names
    for number in range(len(shards)):
        entry = shards.record(number)
        assert names[entry["label"]] == entry["category"] == targets[entry["subtype"]]
        assert shards.labels[number] == entry["label"]
    # Rows of the tile are the stations, in the order in which their sub-bands follow each other.
    assert shards.tile(0).shape == (count * 32, 3 * 32)
    assert [station.name for station in Network.from_settings(network).stations] == stations
    table = {"name": "samples.csv", "path": "samples.csv", "bytes": 1, "sha256": "0"}
    listed = f"Class: {', '.join(f'{n} {name}' for n, name in enumerate(names))}."
    assert listed in json.dumps(metadata(shards.index, table, {}))
    assert f"({', '.join(map(classes.plural, names))})" in description(shards)
    scheme = recognised(tmp_path, network, config, clouds, targets)
    views = np.load(tmp_path / "views-train.npz")["views"]
    # Of five motion models of a subtype three are for training and one for the test, at every SNR.
    assert views.shape == (3 * len(SNRS) * len(targets), 3 * count, SIZE, SIZE)
    assert count == 1 or not np.array_equal(views[:, :3], views[:, 3:6])
    trained = load_model(tmp_path / "model/model.safetensors")
    assert trained.classes == names and trained.model.classifier.out_features == len(names)
    predictions = read_csv(tmp_path / "p.csv")
    columns = [f"p_{classes.word(name)}" for name in names]
    assert [name for name in predictions[0] if name.startswith("p_")] == columns
    assert len(score(tmp_path / "p.csv", tmp_path / "index.json", "seen")["confusion"]) == len(
        names
    )
    (average,) = [line for line in read_csv(tmp_path / "accuracy.csv") if line["snr_db"] == "avg"]
    assert average["scheme"] == scheme and int(average["samples"]) == len(SNRS) * len(targets)
    confusion = read_csv(tmp_path / "confusion.csv")
    assert (
        {row["category"] for row in confusion}
        == {row["predicted"] for row in confusion}
        == set(names)
    )
    for name in names:
        of_class = sum(int(row["samples"]) for row in confusion if row["category"] == name)
        assert of_class == len(SNRS) * list(targets.values()).count(name)
    header = (tmp_path / "alarms.csv").read_text().splitlines()[0].split(",")
    words = [classes.word(name) for name in names[1:]]
    ends = ("percent", "low", "high")
    assert header[4:] == [f"{rate}_{end}" for rate in ("detected", *words) for end in ends]
    text = reported(tmp_path, config, clouds, rows(targets))
    # Parts that the run has nothing for are left out.
    assert sound(text).links[1:] == [
        f"#{part.id}" for part in PARTS if f'<section id="{part.id}"' in text
    ]
    assert f"<code>{sha256(tmp_path / 'index.json')}</code>" in text
    assert f"{count} base station" in text and f"<td>{scheme}</td>" in text
    # A panel of the viewer for the truth, the echo and each of the three spectra of each station.
    assert [text.count(f">{station}: ") for station in stations] == [5] * count
    shown = json.loads(re.search(r'id="viewer-data">(.*?)</script>', text)[1])
    assert shown["classes"] == list(names)
    assert {sample["category"] for sample in shown["samples"]} == set(names)
    assert all(targets[sample["subtype"]] == sample["category"] for sample in shown["samples"])


def test_a_station_of_the_layer_below_is_taken_out_and_a_scheme_must_name_known_ones(tmp_path):
    schema = "workflow/schemas/config.schema.yaml"
    overlay = {"network": {"stations": {"A": None, "C": None, "tower": PLACES["west"]}}}
    path = tmp_path / "overlay.yaml"
    path.write_text(yaml.safe_dump(overlay))
    config = load(["config/default.yaml", path], schema)
    assert station_names(config["network"]) == ["B", "tower"]
    path.write_text(
        yaml.safe_dump(merge(config, {"network": {"stations": {"B": None, "tower": None}}}))
    )
    with pytest.raises(InputError, match="stations"):
        load([path], schema)
    table = tmp_path / "schemes.csv"
    table.write_text(
        ",".join(schemes.COLUMNS) + "\nboth,B+tower,VRP,mean,,seen\none,tower,VRP,mean,,seen\n"
    )
    assert schemes.named(table, "both", ["B", "tower"]).stations == (0, 1)
    assert schemes.named(table, "one", ["B", "tower"]).stations == (1,)
    with pytest.raises(
        InputError, match=r"line 2: stations 'B\+tower', expected some of \('A', 'B'\)"
    ):
        schemes.named(table, "both", ["A", "B"])


def test_labels_are_places_in_the_order_of_first_rows():
    table = {name: {"category": category} for name, category in FIVE.items()}
    assert classes.classes_of(table) == ("UAV", "Bird", "Vehicle", "Pedestrian", "Fixed-wing")
    assert classes.classes_of(load_table(TABLE)) == classes.CATEGORIES
    reverse = dict(reversed(table.items()))
    assert classes.classes_of(reverse)[:2] == ("UAV", "Fixed-wing")
    assert classes.label(("B", "A"), {"subtype": "x", "category": "A"}) == 1
    with pytest.raises(InputError, match=r"x: category 'C', expected one of \['B', 'A'\]"):
        classes.label(("B", "A"), {"subtype": "x", "category": "C"})


def test_names_of_classes_stay_apart_as_columns():
    for pair in (("Fixed wing", "fixed-wing"), ("UAV", "uav")):
        with pytest.raises(InputError, match="differ in their letters"):
            classes.classes_of({name: {"category": name} for name in pair})
    for bad in ("", "3D", "a,b", "x" * 41):
        with pytest.raises(InputError, match="expected a letter"):
            classes.classes_of({"one": {"category": bad}})


def test_a_class_of_its_own_needs_to_know_what_it_is_like():
    row = load_table(TABLE)["DJI Mini 2"] | {"category": "Other"}
    with pytest.raises(InputError, match="here: category is 'Other', expected a key `like`"):
        merged(row, {"source": "builtin"}, "here")
    with pytest.raises(InputError, match="here: like: value 'Plane'"):
        merged(row, {"source": "builtin", "like": "Plane"}, "here")
    with pytest.raises(
        InputError, match=r"no \['speed_lo', 'speed_hi'\], expected m/s for a target like a Vehicle"
    ):
        merged(row, {"source": "builtin", "like": "Vehicle"}, "here")


def test_heights_are_looked_up_by_subtype_then_class_then_what_it_is_like():
    from lowalt.motion.drawing import heights

    block = {"height_m": {"UAV": [1, 2], "Plane": [3, 4], "Glider": [5, 6]}}
    assert heights(block, "Glider", "Plane", "UAV") == [5, 6]
    assert heights(block, "Cessna", "Plane", "UAV") == [3, 4]
    assert heights(block, "Cessna", "Other", "UAV") == [1, 2]


def test_a_training_names_the_class_without_samples_and_wants_two():
    torch = pytest.importorskip("torch")
    from lowalt.recognition import runs, training

    class Source:
        """Samples of the label 0 alone."""

        facts = type("Facts", (), {"label": np.zeros(3, int)})

    settings = {"seed": 1, "training": None, "augmentation": {}, "classes": ["Bat", "Bird"]}
    block = load(["config/default.yaml"], "workflow/schemas/config.schema.yaml")["recognition"][
        "training"
    ]
    with pytest.raises(InputError, match=r"no training sample of \['Bird'\]"):
        training.Trainer(
            torch.nn.Linear(1, 2),
            {"train": Source, "validation": Source},
            [0],
            settings | {"training": block},
            None,
            None,
        )
    given = settings | {
        "training": block,
        "size": 24,
        "colour_map": "gray",
        "network": {},
        "classes": ["Bat"],
    }
    with pytest.raises(InputError, match="expected two or more"):
        runs.train({}, None, "seen", given, None)
