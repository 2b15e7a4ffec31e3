"""Configuration and clouds make a whole data set again elsewhere, byte for byte; what a path names
is checked.
"""

import pytest
import yaml
from test_dataset import configuration, dataset  # noqa: F401

from dataset import build as small
from dataset import publish
from lowalt.__main__ import main as lowalt
from lowalt.config.layers import load, plain
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet, manifest
from lowalt.shards.build import main, write_run
from lowalt.shards.dataset import Dataset
from options import words
from stage_runs import check_members


def test_a_configuration_and_clouds_are_a_whole_data_set(dataset, tmp_path, monkeypatch, capsys):  # noqa: F811
    run = tmp_path / "run"
    write_run(dataset, run, "image")
    manifest.main(words("write", run=run, manifest=tmp_path / "run.sha256"))
    (run / "config.yaml").write_text(yaml.safe_dump(plain(configuration())))
    # The records lie elsewhere for who gets the two.
    monkeypatch.chdir(tmp_path)
    whole = {"config": "run/config.yaml", "clouds": "run/clouds"}
    main(words(**whole, out="again"))
    manifest.main(words("check", run="again", manifest="run.sha256"))
    assert "are equal to run.sha256" in capsys.readouterr().out
    assert len(list((tmp_path / "again/shards").iterdir())) == 13
    (run / "config.yaml").write_text(yaml.safe_dump(plain(configuration(seed=5))))
    main(words(**whole, out="other"))
    with pytest.raises(SystemExit):
        manifest.main(words("check", run="other", manifest="run.sha256"))
    assert capsys.readouterr().out.startswith("motion: motion/seen-00000.csv differs")


def test_each_chunk_has_the_motion_models_after_those_of_the_chunk_before(tmp_path):
    config = configuration()
    config["targets"]["select"] = ["Owl"]
    config["motion"] |= {"models": 8, "models_per_chunk": 4}
    two = Dataset(config)
    write_run(two, tmp_path, "signal")
    assert len(two.plan.chunks) == 2
    check_members(two, ShardSet(tmp_path / "shards/index.json"))


def test_a_run_s_data_set_opens_in_a_folder_without_its_tables(tmp_path, monkeypatch):
    config = load(
        ["config/default.yaml", "config/tiny.yaml"], "workflow/schemas/config.schema.yaml"
    )
    assert config["targets"]["table"] == "config/targets.csv"
    here = Dataset(config, tmp_path)
    monkeypatch.chdir(tmp_path)
    there = Dataset(config, tmp_path)
    assert (
        there.config == config
        and there.published == here.published
        and len(there) == len(here) == 160
    )


def test_a_configuration_that_a_path_names_is_checked_as_that_of_a_run(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump(configuration()))
    assert Dataset(path).config["seed"] == configuration()["seed"]
    path.write_text(yaml.safe_dump(configuration(seed="x")))
    for opened in (
        lambda: Dataset(path),
        lambda: main(["--config", str(path), "--out", str(tmp_path / "none")]),
    ):
        with pytest.raises(InputError, match="seed: value 'x', expected type integer"):
            opened()


def test_an_index_behind_a_link_is_checked_where_its_shards_are(tmp_path, capsys):
    folder = tmp_path / "größe und maß"
    publish(small(tmp_path / "made", "signal"), folder)
    (tmp_path / "link.json").symlink_to(folder / "index.json")
    assert lowalt(["verify", str(tmp_path / "link.json")]) == 0
    assert "every byte is as it was written" in capsys.readouterr().out
