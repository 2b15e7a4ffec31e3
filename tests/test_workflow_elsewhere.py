"""A run from another folder than the checkout: source files by whole paths, the user's files before the package's."""

from pathlib import Path

import pytest

from lowalt.common.shipped import located
from lowalt.common.yaml_files import load_yaml
from lowalt.workflow.sources import code, sources

ROOT = Path(__file__).parent.parent


@pytest.fixture(autouse=True)
def checkout(monkeypatch):
    """Paths of the default configuration are relative to the checkout."""
    monkeypatch.chdir(ROOT)


def test_code_is_the_sources_relative_to_the_checkout_or_absolute_elsewhere(tmp_path, monkeypatch):
    here = code("lowalt.noise")
    assert "src/lowalt/noise/awgn.py" in here
    assert [ROOT / path for path in here] == list(sources("lowalt.noise"))
    code.cache_clear()
    monkeypatch.chdir(tmp_path)
    assert all(Path(path).is_absolute() for path in code("lowalt.noise"))
    code.cache_clear()


def test_files_of_the_checkout_are_found_from_elsewhere_and_own_ones_come_first(tmp_path, monkeypatch):
    config = load_yaml("config/default.yaml")
    assert located(config, ROOT) == config
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").mkdir()
    (tmp_path / "config/schemes.csv").touch()
    found = located(config, ROOT)
    assert found["targets"]["table"] == str(ROOT / "config/targets.csv")
    assert found["targets"]["records"] == [str(ROOT / path) for path in config["targets"]["records"]]
    assert found["recognition"]["table"] == "config/schemes.csv" and found["report"]["accuracy"] is None
    assert located(found, ROOT) == found
