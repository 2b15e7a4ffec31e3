"""Where a run's configuration, profile and cores come from, and words of command lines that stand
for numbers.
"""

import argparse
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from lowalt.__main__ import main as lowalt_command
from lowalt.commands import explain, workflow
from lowalt.config.layers import overlaid
from lowalt.files.errors import InputError
from lowalt.files.shipped import SHIPPED


def given(**changes):
    usual = {
        "overlay": [],
        "configfile": [],
        "target": [],
        "cores": None,
        "dry_run": False,
        "printshellcmds": False,
    }
    return SimpleNamespace(**{**usual, "profile": None, **changes})


def test_outside_a_checkout_a_run_gets_the_package_s_configuration_and_profile(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    head = [sys.executable, "-m", "snakemake", "--snakefile", str(workflow.SNAKEFILE)]
    base = str(SHIPPED / "config/default.yaml")
    profile = ["--workflow-profile", str(SHIPPED / "profiles/default")]
    assert workflow.command(given()) == [*head, "--cores", "all", *profile, "--configfile", base]
    (tmp_path / "profiles").mkdir()
    (tmp_path / "mine.yaml").write_text("seed: 3")
    line = workflow.command(given(configfile=[Path("mine.yaml")]))
    assert line == [*head, "--cores", "all", "--configfile", base, "mine.yaml"]
    # How many cores there are is the cluster's matter, unless it is said.
    (tmp_path / "profiles/slurm").mkdir()
    (tmp_path / "profiles/slurm/config.yaml").write_text("")
    cluster = given(profile=Path("profiles/slurm"))
    assert workflow.command(cluster) == [
        *head,
        "--workflow-profile",
        "profiles/slurm",
        "--configfile",
        base,
    ]
    cluster.cores = "4"
    assert workflow.command(cluster)[5:7] == ["--cores", "4"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cores": "two"}, "--cores 'two', expected a whole number"),
        ({"cores": "0"}, "--cores '0', expected a whole number"),
        ({"profile": Path("profiles/slrum")}, "--profile profiles/slrum: no config.yaml there"),
        ({"profile": Path("config/tiny.yaml")}, "--profile config/tiny.yaml: no config.yaml there"),
        ({"overlay": [Path("none.yaml")]}, "no file at none.yaml"),
    ],
)
def test_a_run_is_refused_before_snakemake_starts(changes, words):
    with pytest.raises(InputError, match=words):
        workflow.command(given(**changes))


def test_a_run_whose_cache_cannot_be_made_is_refused_by_its_folder(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file/cache"))
    with pytest.raises(InputError, match=r"file/cache/snakemake.*: .*, expected XDG_CACHE_HOME: a"):
        workflow.command(given())


def test_a_sample_to_explain_is_a_subtype_and_a_number():
    assert explain._sample("Crow:3") == ("Crow", 3) and explain._sample("a:b:12") == ("a:b", 12)
    for wrong in ("Crow", ":3", "Crow:", "Crow:-1", "Crow:1.5"):
        with pytest.raises(argparse.ArgumentTypeError, match="expected SUBTYPE:MODEL"):
            explain._sample(wrong)


def test_the_page_of_a_run_is_refused_where_its_folder_names_code(tmp_path, monkeypatch, capsys):
    config = overlaid([])
    config["recognition"]["network"]["backbone"] = "evil.py:f"
    folder = tmp_path / "results/copied"
    folder.mkdir(parents=True)
    (folder / "config.yaml").write_text(yaml.safe_dump(config | {"run": "copied"}))
    monkeypatch.chdir(tmp_path)
    started = []
    monkeypatch.setattr(workflow, "ended", lambda options: started.append(options) or {"status": 0})
    assert lowalt_command(["report", "results/copied"]) == 2
    assert "evil.py:f" in capsys.readouterr().err and not started


def test_run_passes_overlays_targets_and_the_exit_status_on(tmp_path, monkeypatch, capsys):
    line = workflow.command(
        given(overlay=[Path("config/tiny.yaml")], target=["data"], cores="2", dry_run=True)
    )
    assert line[3:] == [
        "--snakefile",
        str(workflow.SNAKEFILE),
        "--cores",
        "2",
        "--configfile",
        "config/tiny.yaml",
        "--dry-run",
        "--",
        "data",
    ]
    assert workflow.SNAKEFILE.is_file()
    assert lowalt_command(["run", str(tmp_path / "none.yaml")]) == 2
    assert "configuration: no file at" in capsys.readouterr().err
    # 137 is how shells name the end by SIGKILL.
    for code, seen in ((7, 7), (-9, 137)):
        monkeypatch.setattr(
            workflow.subprocess, "run", lambda line, code=code, **_: given(returncode=code)
        )
        assert lowalt_command(["run"]) == seen
    monkeypatch.setattr(workflow, "SNAKEFILE", tmp_path / "Snakefile")
    assert lowalt_command(["run"]) == 2 and "has no workflow" in capsys.readouterr().err
