"""Settings that a file brings, each damaged in many ways and signed again: refused in one line, or
the same result.
"""

import copy
import json
import math
import resource
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import yaml

import lowalt
import model_files
from lowalt.__main__ import main
from lowalt.config.layers import merge, overlaid
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import model_file, runs, samples, train_evaluate
from lowalt.recognition.__main__ import main as recognition
from lowalt.shards import ShardSet, index
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.shards.remake import number_of, opened
from lowalt.tiles.tile_files import Tiles
from small_configuration import configuration
from trainings import SCHEME, SETTINGS, write_views

SHIPPED = Path(__file__).parents[1] / "results/zoo/default-seen.safetensors"
DAMAGE = (
    None,
    True,
    -1,
    0,
    0.5,
    10**30,
    20_000,
    math.nan,
    "",
    "x\ny",
    "../x",
    [],
    {},
    [[]],
    [-1],
    {"x": 1},
    ["a", "a"],
)
RUNS = "def run(size):\n    open('made', 'w').close()\n"


@pytest.fixture
def signals(tmp_path, monkeypatch):
    """Signals of the default network, in the folder in which the commands run."""
    path = tmp_path / "a.npy"
    np.save(path, np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4).astype(np.complex64))
    return path


def leaves(value, path=()):
    """Paths of all values in nested mappings and lists, inner ones too."""
    inner = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, entry in inner:
        yield (*path, key)
        yield from leaves(entry, (*path, key))


def damaged(block):
    """Copies of a block, each with one value damaged, dropped or joined by an unknown key; each
    value in two ways.
    """
    for turn, path in enumerate(leaves(block)):
        for new in (*DAMAGE, "drop", "add")[turn % 10 :: 10]:
            found = copy.deepcopy(block)
            inner = found
            for key in path[:-1]:
                inner = inner[key]
            if new == "drop":
                del inner[path[-1]]
            elif new == "add" and isinstance(inner, dict):
                inner["unknown"] = 1
            else:
                inner[path[-1]] = new
            yield path, new, found


def line_of(call, *given):
    """What a call returns, or the one line with which it refuses."""
    try:
        return call(*given)
    except InputError as error:
        assert str(error) and "\n" not in str(error)
        return "refused"


@pytest.mark.parametrize("part", ["model", "input"])
def test_a_model_file_with_a_damaged_setting_is_refused_in_one_line_or_answers_the_same(
    part, signals, tmp_path
):
    from lowalt.recognition.predict_sample import predict

    content = model_file.read(SHIPPED)
    path = tmp_path / "a.safetensors"

    def asked():
        """The answer of the file."""
        model, settings = runs.opened(path)
        return list(predict(model, signals, settings).values()) if settings else "refused"

    model_file.write(path, content)
    good = asked()
    counted = {"refused": 0, "same": 0}
    for where, new, block in damaged(getattr(content, part)):
        model_file.write(path, replace(content, **{part: block}))
        found = line_of(asked)
        counted["refused" if found == "refused" else "same"] += 1
        # Other images, or fewer stations, change the answer, as they may.
        if part == "model" and where[:2] != ("scheme", "stations"):
            assert found in ("refused", good), (where, new)
        assert found == "refused" or np.isfinite(found).all(), (where, new)
    assert counted["refused"] > 3 * counted["same"] > 0


def test_an_index_with_a_damaged_setting_is_refused_in_one_line_or_makes_samples(tmp_path):
    write_run(
        Dataset(configuration(effects={"receiver_noise": {}, "adc": {"bits": 8}})),
        tmp_path,
        "signal",
    )
    path = tmp_path / "shards/index.json"
    whole = json.loads(path.read_text())
    key = ShardSet(path).keys[0].decode()
    counted = {"refused": 0, "made": 0}
    for _, _, block in damaged({name: whole[name] for name in ("kind", "render", "echo")}):
        content = {**whole, **block}
        content["sha256"] = index._checksum(content)
        path.write_text(json.dumps(content))

        def remade():
            """Faults of a sample made again by the index as it is now."""
            remaker = opened(path)
            return remaker.faults(number_of(remaker.shards, key))

        counted["refused" if line_of(remade) == "refused" else "made"] += 1
    assert counted["refused"] > 3 * counted["made"] > 0


def test_no_file_names_code_and_its_user_may(trained, tmp_path, monkeypatch, capsys, signals):
    _, state = model_files.load(trained / "model.safetensors")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "code.py").write_text(RUNS)
    state["network"] = {**state["network"], "backbone": "code.py:run"}
    model_files.save("a.safetensors", "{}", state)
    content = model_file.of_run("a.safetensors")
    in_scheme = {**content.model, "scheme": {**content.model["scheme"], "backbone": "code.py:run"}}
    model_file.write("b.safetensors", replace(content, model=in_scheme))
    for name in ("a.safetensors", "b.safetensors"):
        assert main(["predict", name, str(signals)]) == 2
        told = capsys.readouterr().err
        assert (
            told.count("\n") == 1
            and "which a file may not choose; expected `--backbone FILE.py:FUNCTION`" in told
        )
    for out in ("a.safetensors", "b.safetensors"):
        with pytest.raises(InputError, match="may not choose"):
            recognition(["export", "--settings", "{}", "--model", "a.safetensors", "--out", out])
    assert not (tmp_path / "made").exists()
    with pytest.raises(InputError, match=r"code\.py:run"):
        runs.load("a.safetensors", "code.py:run")
    assert (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("network", "heads", 1),
        ("size", None, 64),
        ("colour_map", None, "viridis"),
        ("scheme", "fusion", "mean"),
    ],
)
def test_a_model_that_contradicts_its_identity_is_refused(part, key, value, trained, tmp_path):
    identity, state = model_files.load(trained / "model.safetensors")
    state[part] = {**state[part], key: value} if key else value
    model_files.save(tmp_path / "a.safetensors", identity, state)
    with pytest.raises(
        InputError,
        match=rf"a\.safetensors: {part}{'.' + key if key else ''} is .*, with which it was trained",
    ):
        runs.load(tmp_path / "a.safetensors")


def test_a_run_names_no_code_and_its_caller_may(tmp_path, monkeypatch):
    from test_recognition_train_evaluate import CHANGES

    monkeypatch.chdir(tmp_path)
    (tmp_path / "code.py").write_text(RUNS)
    config = merge(overlaid([]), CHANGES)
    config["recognition"]["network"]["backbone"] = "code.py:run"
    (tmp_path / "run/shards").mkdir(parents=True)
    (tmp_path / "run/config.yaml").write_text(yaml.safe_dump(config))
    (tmp_path / "run/shards/index.json").write_text("{}")
    monkeypatch.setattr(
        train_evaluate, "ShardSet", lambda index: SimpleNamespace(classes=("UAV", "Bird"))
    )
    with pytest.raises(
        InputError, match=r"^run: its backbone 'code\.py:run' is code, which a file may not choose"
    ):
        lowalt.train("run", "A:VT", "seen")
    del config["recognition"]
    (tmp_path / "run/config.yaml").write_text(yaml.safe_dump(config))
    for call in (
        lambda: lowalt.train("run"),
        lambda: lowalt.evaluate(runs.Trained(*[None] * 7), "run"),
    ):
        with pytest.raises(
            InputError, match=r"run/config\.yaml: .*missing key\(s\) \['recognition'\]"
        ):
            call()
    assert not (tmp_path / "made").exists()


def test_a_model_on_code_of_its_user_answers_where_he_names_it(tmp_path, monkeypatch):
    from test_recognition import GOOD

    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(GOOD)
    block = {**SETTINGS["network"], "backbone": "mine.py:small", "heads": 5}
    fresh = runs.built(SCHEME, block, 32, "gray", 4)
    state = {name: SETTINGS[name] for name in ("size", "seed", "colour_map", "classes")}
    state |= {
        "scheme": SCHEME.record,
        "protocol": "seen",
        "network": block,
        "weights": fresh.state_dict(),
    }
    model_files.save("a.safetensors", "{}", state)
    image = torch.randint(0, 255, (2, 4, 32, 32), dtype=torch.uint8)
    with torch.inference_mode():
        assert torch.allclose(
            runs.load("a.safetensors", "mine.py:small").model(image), fresh.eval()(image), atol=1e-5
        )


def test_a_network_larger_than_its_weights_takes_limited_memory(trained, tmp_path):
    _, state = model_files.load(trained / "model.safetensors")
    large = {"hidden": 65536, "intra_depth": 64, "inter_depth": 64, "feed_forward": 64.0}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for name in ("vit_giant_patch14_224", "test_vit2"):
        state["network"] = {**state["network"], **large, "backbone": name}
        model_files.save(tmp_path / "a.safetensors", "{}", state)
        with pytest.raises(InputError, match=r"do not fit its network|not a trained model"):
            runs.load(tmp_path / "a.safetensors")
    # The limit is one of new address space; what earlier tests left mapped and empty may fill
    # besides.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 2 * 1_900_000


def test_facts_of_other_shapes_offsets_in_words_and_null_bytes_are_refused_in_one_line(tmp_path):
    views, tiles, text = (tmp_path / name for name in ("views.npz", "tiles.npz", "a.yaml"))
    with np.load(write_views(views, 5)) as data:
        good = dict(data)
    for name, value in (
        ("range_m", np.array(1.0)),
        ("label", good["label"].astype(str)),
        ("fold", np.array("train")),
    ):
        np.savez(views, **{**good, name: value})
        assert line_of(samples.ViewSamples, [views], [0], {("seen", "train")}) == "refused"
    np.savez(tiles, data=np.zeros(6, np.uint8), offsets=np.array(["0", "6"]))
    assert line_of(Tiles, tiles) == "refused"
    text.write_bytes(bytes(9))
    assert line_of(load_yaml, text) == "refused"


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_weights_that_are_not_finite_are_refused(value, trained, tmp_path):
    identity, state = model_files.load(trained / "model.safetensors")
    name = next(iter(state["weights"]))
    state["weights"][name] = torch.full_like(state["weights"][name], value)
    model_files.save(tmp_path / "a.safetensors", identity, state)
    with pytest.raises(InputError, match=f"{name} has a NaN or an infinity"):
        runs.load(tmp_path / "a.safetensors")


def test_a_folder_or_an_archive_is_no_sample(tmp_path, capsys):
    (tmp_path / "a.png").mkdir()
    with (tmp_path / "a.npy").open("wb") as file:
        np.savez(file, x=np.zeros(3, complex))
    for name, word in (("a.png", "no file at"), ("a.npy", "an archive of arrays")):
        assert main(["predict", str(SHIPPED), str(tmp_path / name)]) == 2
        told = capsys.readouterr().err
        assert told.count("\n") == 1 and word in told
