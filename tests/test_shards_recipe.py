"""A recipe makes the whole data set again, byte for byte, and refuses what it cannot."""

import json
import tarfile

import pytest
import yaml

from dataset import build, publish
from lowalt.__main__ import main as lowalt
from lowalt.config.layers import load
from lowalt.files.errors import InputError
from lowalt.shards import recipe
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from test_dataset import configuration, dataset  # noqa: F401


@pytest.fixture(scope="module")
def finished(dataset, tmp_path_factory):  # noqa: F811
    """A finished run's folder and its recipe."""
    folder = tmp_path_factory.mktemp("run")
    write_run(dataset, folder, "image")
    (folder / "config.yaml").write_text(yaml.safe_dump(configuration()))
    recipe.main(["pack", "--run", str(folder), "--out", str(folder / "small.recipe.tar")])
    return folder


def test_a_recipe_unpacks_into_the_same_bytes(finished, tmp_path, monkeypatch, capsys):
    # The records lie elsewhere for who unpacks.
    monkeypatch.chdir(tmp_path)
    recipe.main(["unpack", str(finished / "small.recipe.tar"), "--out", str(tmp_path / "made")])
    assert "equal to the recipe's checksums" in capsys.readouterr().out
    names = sorted(path.relative_to(finished) for path in finished.glob("shards/*"))
    assert len(names) == 13
    assert all((tmp_path / "made" / name).read_bytes() == (finished / name).read_bytes() for name in names)


def changed(finished, path, **head):
    """The recipe with some entries of its head changed."""
    with tarfile.open(finished / "small.recipe.tar") as old, tarfile.open(path, "w") as new:
        for member in old.getmembers():
            data = old.extractfile(member).read()
            if member.name == "recipe.json":
                data = json.dumps(json.loads(data) | head).encode()
                member.size = len(data)
            import io

            new.addfile(member, io.BytesIO(data))
    return path


def test_other_versions_and_damage_are_refused_and_other_samples_told(finished, tmp_path, capsys):
    with pytest.raises(InputError, match=r"lowalt 9\.9"):
        recipe.unpack(changed(finished, tmp_path / "version.tar", lowalt="9.9"), tmp_path / "made")
    (tmp_path / "text.tar").write_text("no archive")
    with pytest.raises(InputError, match="not a recipe"):
        recipe.unpack(tmp_path / "text.tar", tmp_path / "made")
    damage = {
        r"published\.Crow: missing key": {"published": {"Crow": {}}},
        "config: value 3": {"config": 3},
        "seed: value -1": {"config": configuration() | {"seed": -1}},
    }
    for words, head in damage.items():
        with pytest.raises(InputError, match=words):
            recipe.unpack(changed(finished, tmp_path / "head.tar", **head), tmp_path / "made")
    other = changed(finished, tmp_path / "seed.tar", config=configuration(seed=5))
    with pytest.raises(SystemExit):
        recipe.main(["unpack", str(other), "--out", str(tmp_path / "made")])
    assert capsys.readouterr().out.startswith("motion: motion/seen-00000.csv differs")
    with pytest.raises(InputError, match="no shards"):
        (tmp_path / "empty" / "clouds").mkdir(parents=True)
        for name in ("config.yaml", *(f"clouds/{path.name}" for path in finished.glob("clouds/*"))):
            (tmp_path / "empty" / name).write_bytes((finished / name).read_bytes())
        (tmp_path / "empty" / "clouds" / "shards.npz").write_bytes(b"a cloud by its folder, a shard by its name only")
        recipe.pack(tmp_path / "empty", tmp_path / "empty.tar")


def test_a_run_s_data_set_opens_in_a_folder_without_its_tables(tmp_path, monkeypatch):
    config = load(["config/default.yaml", "config/tiny.yaml"], "workflow/schemas/config.schema.yaml")
    assert config["targets"]["table"] == "config/targets.csv"
    here = Dataset(config, tmp_path)
    monkeypatch.chdir(tmp_path)
    there = Dataset(config, tmp_path)
    assert there.config == config and there.published == here.published and len(there) == len(here) == 160


def test_a_configuration_that_a_path_names_is_checked_as_that_of_a_run(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(yaml.safe_dump(configuration()))
    assert Dataset(path).config["seed"] == configuration()["seed"]
    path.write_text(yaml.safe_dump(configuration(seed="x")))
    with pytest.raises(InputError, match="seed: value 'x', expected type integer"):
        Dataset(path)


def test_an_index_behind_a_link_is_checked_where_its_shards_are(tmp_path, capsys):
    folder = tmp_path / "größe und maß"
    publish(build(tmp_path / "made", "signal"), folder)
    (tmp_path / "link.json").symlink_to(folder / "index.json")
    assert lowalt(["verify", str(tmp_path / "link.json")]) == 0
    assert "every byte is as it was written" in capsys.readouterr().out
