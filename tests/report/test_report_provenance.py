"""Provenance: the revision is git's own, the overlay makes the configuration again, and checksums
are of the files.
"""

import hashlib
import json
import subprocess

import pytest
import yaml

from lowalt.config.layers import canonical, check, load, merge
from lowalt.files.yaml_files import load_yaml
from lowalt.report import provenance

SCHEMA = "workflow/schemas/config.schema.yaml"
BASE = "config/default.yaml"
OTHERS = (
    {
        "run": "other",
        "network": {
            "stations": {"C": None, "tower": {"position_m": [250, 400, 30], "normal_deg": 270}}
        },
    },
    {
        "noise": {"snr_db": [3.0, float("inf")]},
        "recognition": {"seeds": [0, 1], "network": {"backbone": "resnet18"}},
    },
    {"effects": {"clutter": {}, "phase_noise": {}}, "spectra": {"vt": None}},
)


def git(folder, *words):
    identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
    return subprocess.run(
        ["git", "-C", folder, *identity, *words], capture_output=True, text=True, check=True
    ).stdout


def test_the_revision_is_git_s_own_and_says_what_changed_since(tmp_path):
    assert provenance.revision(tmp_path) == "no checkout"
    git(tmp_path, "init", "-q")
    assert provenance.revision(tmp_path) == "no checkout"
    (tmp_path / "one").write_text("1")
    git(tmp_path, "add", "one")
    git(tmp_path, "commit", "-q", "-m", "x")
    commit = git(tmp_path, "rev-parse", "HEAD").strip()
    (tmp_path / "new").write_text("not tracked")
    assert provenance.revision(tmp_path) == commit
    (tmp_path / "one").write_text("2")
    assert provenance.revision(tmp_path) == f"{commit}, 1 tracked file changed since"


def test_the_sum_of_the_code_follows_names_and_content(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    first = provenance.code_sum(tmp_path)
    (tmp_path / "a.nbi").write_text("machine code")
    assert provenance.code_sum(tmp_path) == first
    (tmp_path / "a.py").rename(tmp_path / "b.py")
    second = provenance.code_sum(tmp_path)
    (tmp_path / "b.py").write_text("x = 2\n")
    assert len({first, second, provenance.code_sum(tmp_path)}) == 3


@pytest.mark.parametrize("overlay", OTHERS)
def test_the_overlay_of_the_page_makes_the_same_configuration_again(overlay):
    base = load_yaml(BASE)
    config = check(merge(load_yaml(BASE), overlay), SCHEMA)
    # The stage gets its configuration as JSON, which has no infinity.
    found = provenance.changes(base, json.loads(canonical(config)))
    again = yaml.safe_load(provenance.commands("no checkout", found)[1])
    assert check(merge(load_yaml(BASE), again), SCHEMA) == config
    assert len(str(again)) < 300


def test_the_default_needs_no_overlay():
    assert provenance.changes(load_yaml(BASE), json.loads(canonical(load([BASE], SCHEMA)))) == {}
    assert provenance.commands("abc, 1 tracked file changed since", {}) == (
        "git checkout abc\nmake",
        "",
    )
    assert (
        provenance.commands("abc", {"run": "x"})[0].splitlines()[-1]
        == ".venv/bin/lowalt run again.yaml"
    )


def test_checksums_are_those_of_the_files_and_leave_out_what_is_not_of_the_run(tmp_path):
    names = {}
    for name in ("index", "cloud", "kept", "job"):
        (tmp_path / name).write_text(name)
        names[name] = str(tmp_path / name)
    files = {
        "index": names["index"],
        "clouds": [names["cloud"]],
        "kept_effects": names["kept"],
        "benchmarks": [names["job"]],
    }
    assert provenance.checksums(files | {"again": names["index"]}) == [
        {
            "path": names[name],
            "bytes": len(name),
            "sha256": hashlib.sha256(name.encode()).hexdigest(),
        }
        for name in ("index", "cloud")
    ]
