"""Cubes of whole numbers: rounded by at most half a step, stored and made again alike, and as large
as was said.
"""

import io
import json
from types import SimpleNamespace

import numpy as np
import pytest
from test_dataset import configuration

from lowalt.__main__ import main
from lowalt.config.layers import plain
from lowalt.config.splits import FOLDS
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet, card, faults
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.shards.hub import features
from lowalt.shards.sizes import sample_bytes
from lowalt.shards.stored_cubes import restored, rounded
from lowalt.spectra.cube import TRUTH
from lowalt.workflow import space
from stage_runs import run_stages


def values(parts) -> np.ndarray:
    """Cells (1, M) whose real and imaginary parts are these, one after the other."""
    return np.array(parts, np.float32).view(np.complex64)[None]


@pytest.mark.parametrize(
    "largest", [1.0, 0.75, 3.3e38, 2.0**-149, 1.7e-41, 5e-36, 32767.0, 32767.4, 32767.6, 65535.9]
)
def test_a_part_comes_back_within_half_a_step_and_a_step_is_a_power_of_two(largest):
    rng = np.random.default_rng(3)
    parts = (largest * rng.uniform(-1, 1, 4000)).astype(np.float32)
    parts[7], parts[8] = largest, -largest
    whole, step = rounded(values(parts))
    again = restored(whole, step).view(np.float32)[0]
    assert whole.dtype == np.int16 and whole.shape == (1, 2000, 2) and again.dtype == np.float32
    assert np.frexp(step)[0] == 0.5
    assert (np.abs(again.astype(float) - parts.astype(float)) <= step / 2).all()
    # The largest part has more than 16383 steps, unless float32 has no smaller step.
    assert abs(whole.astype(int)).max() >= 16383 or step == 2.0**-149
    # Whole numbers of steps come back as they are.
    assert (restored(*rounded(values(again))).view(np.float32)[0] == again).all()


def test_cells_that_are_zero_stay_zero():
    whole, step = rounded(np.zeros((3, 5), np.complex64))
    assert not whole.any() and step > 0 and not restored(whole, step).any()


def test_cells_that_are_not_finite_are_refused():
    for value in (np.nan, np.inf):
        with pytest.raises(InputError, match="not finite"):
            rounded(np.full((2, 3), value, np.complex64))


def scene(cells: str | None) -> dict:
    """A configuration of cubes of one subtype, stored as a type."""
    config = configuration(shards={"kind": "cube", **({"cells": cells} if cells else {})})
    config["targets"]["select"] = ["DJI Mini 2"]
    return config


@pytest.fixture(scope="module")
def datasets():
    """The same samples as complex64 and as int16."""
    exact = Dataset(scene(None))
    return {"complex64": exact, "int16": Dataset(scene("int16"), exact.clouds)}


@pytest.fixture(scope="module")
def written(datasets, tmp_path_factory):
    """Both data sets as their stages write them."""
    return {
        name: ShardSet(run_stages(made, tmp_path_factory.mktemp(name), "cube"))
        for name, made in datasets.items()
    }


def test_stored_cubes_are_the_exact_ones_within_half_a_step_and_take_half_the_disk(written):
    exact, whole = written.values()
    assert exact.keys.tolist() == whole.keys.tolist() and len(whole) == 8
    for number in range(len(whole)):
        steps = [block["step"] for block in whole.record(number)["cube"].values()]
        pairs = zip(exact.cubes(number), whole.cubes(number), steps, strict=True)
        for place, (cube, near, step) in enumerate(pairs):
            change = near.cells.astype(complex) - cube.cells
            assert 0 < max(abs(change.real).max(), abs(change.imag).max()) <= step / 2
            assert step / 2 < 2**-15 * max(abs(cube.cells.real).max(), abs(cube.cells.imag).max())
            assert (near.chosen == cube.chosen).all() and (near.truth == cube.truth).all()
            assert (whole.signal(number)[place] == near.signal).all()
        record = whole.record(number)
        assert [block.pop("step") for block in record["cube"].values()] == steps
        assert record == exact.record(number)
    assert whole.index["bytes"] < 0.55 * exact.index["bytes"]


def test_rounded_cubes_are_written_and_made_again_with_equal_bytes(
    written, datasets, tmp_path, capsys
):
    shards = written["int16"]
    dataset = datasets["int16"]
    assert write_run(dataset, tmp_path, "cube") == shards.index
    numbers = {dataset.key(number): number for number in range(len(dataset))}
    key = shards.keys[5].decode()
    assert dataset.members(numbers[key], "cube") == shards.members(5)
    (tmp_path / "config.yaml").write_text(json.dumps({"run": "rounded"}))
    card.write(shards.index_path, tmp_path / "config.yaml")
    assert list(faults(shards.index_path)) == []
    assert "int16" in (shards.index_path.parent / "README.md").read_text().split("\n---\n")[0]
    assert main(["remake", str(shards.index_path), key]) == 0
    assert "equal in every byte" in capsys.readouterr().out


@pytest.mark.parametrize("number", ["complex64", "int16"])
def test_the_size_that_is_said_is_the_files_size(
    number, written, datasets, tmp_path, monkeypatch, capsys
):
    dataset = datasets[number]
    index = written[number].index
    stated = space.cubes_size(dataset.config, dataset.plan)
    assert stated["samples"] == dataset.plan.samples == index["samples"] == 8
    assert stated["bytes"] == 8 * stated["sample_bytes"] == 8 * sample_bytes(dataset.config)
    # A file ends with two empty blocks, filled up to 10 240 bytes.
    assert stated["bytes"] == pytest.approx(index["bytes"] - 3 * 10240, rel=0.01)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(space, "free_bytes", lambda folder: 0)
    (group,), rule = dataset.plan.groups, SimpleNamespace(name="shard")
    chunk = {"group": group, "part": "00000"}
    jobs = [
        SimpleNamespace(rule=rule, output=[], wildcards_dict=chunk | {"fold": fold})
        for fold in FOLDS
    ]
    workflow = SimpleNamespace(dag=SimpleNamespace(needrun_jobs=lambda: jobs))
    with pytest.raises(InputError, match=rf"the run will write {stated['bytes'] / 1e6:.1f} MB"):
        space.before(workflow, dataset.plan, dataset.config)
    each = stated["sample_bytes"] / 1e6
    whole = stated["bytes"] / 1e9
    said = capsys.readouterr().err
    assert (
        said
        == f"cube shards: {each:.2f} MB per sample, {whole:.3f} GB in all (8 samples, {number})\n"
    )


def test_explain_says_the_size_first(tmp_path, capsys):
    overlay = tmp_path / "cube.yaml"
    overlay.write_text(
        json.dumps(
            plain(
                {
                    "run": "cube",
                    "shards": {"kind": "cube", "cells": "int16"},
                    "targets": {"select": ["DJI Mini 2"]},
                    "motion": {"models": 10, "models_per_chunk": 10},
                    "noise": {"snr_db": [3, 13]},
                }
            )
        )
    )
    assert main(["explain", str(overlay), "--no-table"]) == 0
    assert capsys.readouterr().out.startswith("cube shards: ")
    assert main(["explain", str(overlay), "--no-table", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["shards"]
    assert said["samples"] == 20 and said["bytes"] == 20 * said["sample_bytes"]


def test_cubes_with_companions_have_a_card_that_types_their_truth(tmp_path):
    config = scene(None) | {
        "effects": {"companions": {"subtypes": ["DJI Mini 2"], "count": [0, 2], "spread_m": 9.0}}
    }
    dataset = Dataset(config)
    write_run(dataset, tmp_path, "cube")
    (tmp_path / "config.yaml").write_text(json.dumps({"run": "company"}))
    card.write(tmp_path / "shards/index.json", tmp_path / "config.yaml")
    shards = ShardSet(tmp_path / "shards/index.json")
    assert (
        {len(shards.cubes(number)[0].others) for number in range(len(shards))}
        == {len(shards.record(number)["companions"]) for number in range(len(shards))}
        != {0}
    )
    cube = next(entry for entry in features(shards)[2]["struct"] if entry["name"] == "cube")
    others = next(entry for entry in cube["struct"][0]["struct"] if entry["name"] == "others")
    assert [entry["name"] for entry in others["list"]] == list(TRUTH)
    _, stored = shards.members(0)
    data = features(shards)[3]
    for _ in range(np.load(io.BytesIO(stored)).ndim):
        data = data["list"]
    assert data == "float32"
