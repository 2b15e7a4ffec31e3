"""A run from another folder than the checkout: source files by whole paths, the user's files before
the package's.
"""

from pathlib import Path
from types import SimpleNamespace

from lowalt.files.shipped import SHIPPED, as_named, located
from lowalt.files.yaml_files import load_yaml
from lowalt.workflow.sources import code, sources
from lowalt.workflow.stages.report import ReportStage
from lowalt.workflow.stages.shards import ShardsStage

ROOT = Path(__file__).parents[2]


def test_code_is_the_sources_relative_to_the_checkout_or_absolute_elsewhere(tmp_path, monkeypatch):
    here = code("lowalt.noise")
    assert "src/lowalt/noise/awgn.py" in here
    assert [ROOT / path for path in here] == list(sources("lowalt.noise"))
    code.cache_clear()
    monkeypatch.chdir(tmp_path)
    assert all(Path(path).is_absolute() for path in code("lowalt.noise"))
    code.cache_clear()


def test_files_of_the_checkout_are_found_from_elsewhere_and_own_ones_come_first(
    tmp_path, monkeypatch
):
    config = load_yaml("config/default.yaml")
    assert located(config, ROOT) == config
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").mkdir()
    (tmp_path / "config/schemes.csv").touch()
    found = located(config, ROOT)
    assert found["targets"]["table"] == str(ROOT / "config/targets.csv")
    assert found["targets"]["records"] == [
        str(ROOT / path) for path in config["targets"]["records"]
    ]
    assert (
        found["recognition"]["table"] == "config/schemes.csv"
        and found["report"]["accuracy"] is None
    )
    assert located(found, ROOT) == found


def test_what_a_run_keeps_names_the_package_s_files_alike_wherever_it_is_installed(
    tmp_path, monkeypatch
):
    config = load_yaml("config/default.yaml") | {"run": "a folder/ä"}
    monkeypatch.chdir(tmp_path)
    elsewhere = located(config, ROOT)
    assert elsewhere != config and as_named(elsewhere, ROOT) == config == as_named(config, ROOT)
    assert located(as_named(elsewhere, ROOT), ROOT) == elsewhere
    # The same name means another file here, so the path stays.
    (tmp_path / "config").mkdir()
    (tmp_path / "config/targets.csv").touch()
    assert as_named(elsewhere, ROOT)["targets"]["table"] == str(ROOT / "config/targets.csv")
    assert as_named(elsewhere, ROOT)["recognition"]["table"] == "config/schemes.csv"


def test_the_kept_configuration_and_the_page_s_have_no_path_of_this_machine(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    config = located(load_yaml(ROOT / "config/default.yaml"), SHIPPED)
    run = SimpleNamespace(config=config, records={})
    assert str(SHIPPED) in config["targets"]["table"]
    for text in (ShardsStage(run).configuration(None), ReportStage(run).settings(None)):
        assert str(SHIPPED) not in text and "config/targets.csv" in text
