"""The real workflow on a tiny overlay: it runs, repeats to the byte, and re-runs only what a change
touches.
"""

import base64
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from lowalt.config.layers import load_yaml
from lowalt.config.network import Network
from lowalt.echo import Rigid, echo_signal
from lowalt.files.atomic import slug
from lowalt.motion import poses, read_table
from lowalt.targets.cloud import read
from lowalt.workflow.closing import averages
from snakemake_runs import run
from snakemake_texts import MODULE, RULES, SPY, declared

pytest.importorskip("snakemake")
pytestmark = pytest.mark.workflow

ROOT = Path(__file__).parents[2]
OVERLAY = {
    "run": "test",
    "targets": {"select": ["DJI Mini 2", "Crow", "NIO ET5T 2023", "Walking Pedestrian 5"]},
    "motion": {"models": 3, "models_per_chunk": 3},
    "split": {"train": 1, "val": 1, "test": 1},
    "noise": {"snr_db": [8, float("inf")]},
    "echo": {"job": "chunk"},
    "recognition": {
        "schemes": ["A:VRP+TRP+VT"],
        "protocols": ["seen"],
        "training": {"steps": 2, "validate_every": 1},
    },
}

ODD = "o'brien läb $(touch y)"
"""Name of a folder that a shell would take apart."""


def workplace(folder: Path) -> Path:
    """A copy of the project without results, so that a test may edit what it likes."""
    for name in ("workflow", "config", "profiles", "src", "envs"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "Snakefile", folder)
    (folder / ".venv").symlink_to(sys.prefix)
    (folder / "imports").mkdir()
    (folder / "src/sitecustomize.py").write_text(SPY)
    (folder / "overlay.yaml").write_text(yaml.safe_dump(OVERLAY))
    return folder


def snakemake(folder: Path, *arguments: str, cores: int = 2, status: int = 0) -> str:
    """Run snakemake, by an interpreter in the workplace, and return what it printed."""
    environment = {**os.environ, "PYTHONPATH": str(folder / "src")}
    environment.pop("LOWALT_INPUTS", None)
    environment |= {
        "LOWALT_TEST_IMPORTS": str(folder / "imports"),
        "LOWALT_TEST_PACKAGE": str(folder / "src/lowalt"),
    }
    program = f"sys.executable = {str(folder / '.venv/bin/python')!r}; snakemake.cli.main()"
    line = ["--cores", str(cores), "--configfile", "overlay.yaml", *arguments]
    found, text = run(folder, line, environment, program)
    assert found == status, text[-6000:]
    return text


def planned(folder: Path, *arguments: str) -> set[str]:
    """The rules a dry run would execute."""
    text = snakemake(folder, "--dry-run", "--printshellcmds", *arguments)
    return set(re.findall(r"^(?:local)?rule (\w+):", text, re.MULTILINE))


def checksums(folder: Path) -> dict[str, str]:
    """SHA-256 of every file of a run's data set."""
    base = folder / "results/test"
    names = ("clouds/*.npz", "motion/*.csv", "echo/*/*.npy", "noisy/*.npy", "shards/*")
    files = [path for name in names for path in base.glob(name)]
    return {
        str(path.relative_to(base)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files
    }


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """A workplace of an odd name in which all stages have run, on two cores."""
    folder = workplace(tmp_path_factory.mktemp("two-cores") / ODD)
    snakemake(folder)
    return folder


def test_the_whole_workflow_runs_in_a_folder_of_an_odd_name(finished):
    base = finished / "results/test"
    assert json.loads((base / "report.json").read_text())["accuracy"] == "results/test/accuracy.csv"
    assert "A:VRP+TRP+VT" in (base / "report.html").read_text()
    assert not list(finished.parent.rglob("y"))


def test_no_job_asks_for_the_network(finished):
    """The run was made with the network refused; here the refusal itself is seen to work."""
    environment = os.environ | {
        "PYTHONPATH": str(finished / "src"),
        "LOWALT_TEST_IMPORTS": str(finished / "imports"),
    }
    for program in (
        "import socket; socket.create_connection(('127.0.0.1', 9))",
        "import urllib.request as r; r.urlopen('http://localhost:9')",
    ):
        asked = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, text=True
        )
        assert asked.returncode and "a job asked for the network" in asked.stderr


@pytest.mark.slow
def test_the_first_run_of_a_new_user_recognises_far_more_than_chance(tmp_path):
    """Four classes: chance is 25 %, and the sampling error of the 16 test samples of `seen` is some
    11 points.
    """
    folder = workplace(tmp_path)
    shutil.copy(folder / "config/tiny.yaml", folder / "overlay.yaml")
    snakemake(folder)
    found = averages(folder / "results/tiny/accuracy.csv")
    assert {protocol for _, protocol in found} == {"seen", "unseen"} and min(found.values()) > 60.0


@pytest.mark.slow
def test_one_core_and_two_a_job_a_station_and_one_for_all_give_the_same_bytes(finished, tmp_path):
    alone = workplace(tmp_path)
    (alone / "overlay.yaml").write_text(yaml.safe_dump(OVERLAY | {"echo": {"job": "station"}}))
    snakemake(alone, "--", "data", cores=1)
    found = checksums(finished)
    other = checksums(alone)
    # The card states the configuration, and with it how echoes were split into jobs.
    for name in ("shards/README.md", "shards/SHA256SUMS"):
        assert found.pop(name) != other.pop(name)
    assert len(found) > 25
    assert other == found
    jobs = {path.name for path in (finished / "results/test/benchmarks/echo").iterdir()}
    assert jobs == {f"{path.stem}.jsonl" for path in (finished / "results/test/motion").iterdir()}


DOWNSTREAM = ["cloud", "motion", "echo", "noise", "tiles", "shard", "index", "card"]


def following(first: str) -> set[str]:
    """The rules from `first` on."""
    return set(DOWNSTREAM[DOWNSTREAM.index(first) :])


def test_a_shard_that_is_deleted_by_hand_is_made_again(finished):
    shard = min((finished / "results/test/shards").glob("*.tar"))
    away = shard.rename(shard.with_suffix(".away"))
    rules = planned(finished, "--", "data")
    _ = away.rename(shard)
    assert rules - {"data"} == following("tiles")


# Here jobs have really run; tests/workflow/test_workflow_reruns.py changes each setting and the
# code of each stage.
def test_edited_code_re_runs_its_stage_and_what_follows(finished):
    path = finished / "src/lowalt/echo/api.py"
    before = path.read_text()
    path.write_text(before + "\n# edited\n")
    try:
        rules = planned(finished, "--", "data") - {"data"}
    finally:
        path.write_text(before)
    assert rules == following("echo")


def test_a_scene_s_effect_changes_the_signals_it_is_about_and_no_other_byte(finished, tmp_path):
    folder = tmp_path / "scene"
    # Copies keep their times, so that only what the effect touches is made again.
    shutil.copytree(finished, folder, symlinks=True)
    path = tmp_path / "scene.yaml"
    path.write_text(yaml.safe_dump({"effects": {"rotor_spread": {}}}))
    # One chunk is enough: it has a drone, which the effect is about, and a bird.
    chunk = finished / "results/test/noisy/seen-00000.npy"
    snakemake(
        folder, "--configfile", "overlay.yaml", str(path), "--", f"results/test/noisy/{chunk.name}"
    )
    rows = read_table(finished / "results/test/motion" / f"{chunk.stem}.csv")
    before = np.load(chunk)
    after = np.load(folder / "results/test/noisy" / chunk.name)
    changed = [one.tobytes() != other.tobytes() for one, other in zip(before, after, strict=True)]
    assert changed == [row["category"] == "UAV" for row in rows] and set(changed) == {True, False}


def test_declared_code_holds_every_module_the_jobs_really_imported(finished):
    seen = {}
    for path in (finished / "imports").iterdir():
        command, *files = path.read_text().split("\n")
        rule = RULES.get(command) or RULES.get(command.split()[0])
        if rule:
            seen.setdefault(rule, set()).update(files)
    assert set(seen) == set(RULES.values())
    for rule, imported in seen.items():
        assert imported <= declared(rule), rule
        assert "files/errors.py" in imported


VOUCHING = {"SHA256SUMS": ("clouds/", "motion/"), "index.json": ("",), "model.safetensors": ("",)}
"""Inputs that hold checksums of other files, or stand for the folder that one job writes: prefixes
of the others.
"""
OF_OTHER_KINDS = {"shard": {"echo"}}
"""Settings that a stage asks for and this kind of data set has no use for: only cubes are made from
echoes again.
"""


def said_by_jobs(folder: Path) -> dict[str, dict[str, set[str]]]:
    """By each job's log file: `inputs` and `outputs` of its rule; `opened`, the files that it read;
    `absent`, the keys that it asked its settings for in vain."""
    jobs = {}
    for path in filter(Path.is_file, (folder / ".snakemake/metadata").rglob("*")):
        record = json.loads(path.read_text())
        name = base64.b64decode(
            "".join(path.relative_to(folder / ".snakemake/metadata").parts)
        ).decode()
        for log in record["log"]:
            job = jobs.setdefault(
                log, {name: set() for name in ("inputs", "outputs", "opened", "absent")}
            )
            job["inputs"] |= {*record["input"]}
            job["outputs"].add(name)
    for path in (folder / "opened").iterdir():
        found = json.loads(path.read_text())
        if found["log"] in jobs:
            jobs[found["log"]]["opened"] |= {*found["opened"]}
            jobs[found["log"]]["absent"] |= {*found["absent"]}
    return jobs


def undeclared(folder: Path) -> dict[str, list[str]]:
    """By each job's log file: files that it read and its rule does not name, other than code and
    schemas, for which no named file vouches; and keys of the configuration that it asked its
    settings for in vain."""
    keys = set(
        re.findall(
            r"^ *(?:- )?(\w+):", (folder / "results/test/config.yaml").read_text(), re.MULTILINE
        )
    )
    elsewhere = ("..", ".venv/", ".snakemake/", "src/lowalt.egg-info/")
    found = {}
    for log, job in said_by_jobs(folder).items():
        vouched = tuple(
            str(Path(name).parent) + "/" + prefix
            for name in job["inputs"]
            for prefix in VOUCHING.get(Path(name).name, ())
        )
        read = {
            name
            for name in job["opened"] - job["inputs"] - job["outputs"]
            if (folder / name).is_file()
            and not name.startswith(elsewhere + vouched)
            and not re.search(r"\.py|\.schema\.yaml$", name)
        }
        missed = job["absent"] & keys - OF_OTHER_KINDS.get(
            Path(log).relative_to("results/test/logs").parts[0], set()
        )
        if read or missed:
            found[log] = sorted(read | missed)
    return found


def test_every_file_and_every_setting_that_a_job_reads_is_named_by_its_rule(finished):
    jobs = said_by_jobs(finished)
    assert sum(bool(job["opened"]) for job in jobs.values()) > 20
    assert undeclared(finished) == {}


FLIGHT = "time_s,x_m,y_m,z_m\n0,200,100,60\n2.5,220,105,62\n5,240,120,64\n9,270,150,60\n"
MOVED = {
    "motion": {
        "looks": 3,
        "track": "flight.csv",
        "sizes_m": {"UAV": [0.25, 0.4], "Bird": [0.2, 0.6]},
    }
}
"""Settings that a configuration may leave out, and a file that one of them names."""
REMOVED = {
    "flight log": (
        "workflow/rules/motion.smk",
        "        track=motion.track,\n",
        "",
        "motion/seen-00000.csv",
    ),
    "style sheet": (
        "src/lowalt/workflow/stages/report.py",
        '".html", ".css", ".js"',
        '".html", ".js"',
        "report.html",
    ),
    "index tables": (
        "workflow/rules/shards.smk",
        re.compile("        tables=.*\n"),
        "",
        "shards/index.json",
    ),
    "card template": (
        "workflow/rules/shards.smk",
        "        template=shards.card_template,\n",
        "",
        "shards/README.md",
    ),
    "sizes_m": (
        "src/lowalt/workflow/stages/motion.py",
        ' "sizes_m",',
        "",
        "motion/seen-00000.csv",
    ),
    "records": (
        "workflow/rules/recognition.smk",
        re.compile("        about=.*RUN.trainings.,\n"),
        "",
        "accuracy.csv",
    ),
}
"""Inputs and settings that a rule could lose while its command still runs: file, text, its
substitute, a product.
"""


def remade(finished: Path, folder: Path, product: str, edit: tuple = ()) -> Path:
    """A copy of a finished workplace in which the jobs that an edit touches, and the one of a
    product, ran again.
    """
    shutil.copytree(finished, folder, symlinks=True)
    shutil.rmtree(folder / "opened")
    if edit:
        file, old, new = edit
        text = (folder / file).read_text()
        other = (
            re.sub(old, new, text, count=1)
            if isinstance(old, re.Pattern)
            else text.replace(old, new, 1)
        )
        assert other != text
        (folder / file).write_text(other)
    if product.startswith("motion/"):
        (folder / "flight.csv").write_text(FLIGHT)
        (folder / "overlay.yaml").write_text(
            yaml.safe_dump(OVERLAY | {"motion": OVERLAY["motion"] | MOVED["motion"]})
        )
    names = [f"results/test/{name}" for name in (product, "config.yaml")]
    # Without the product its job runs, whatever its rule says.
    (folder / names[0]).unlink()
    snakemake(
        folder,
        "--rerun-triggers",
        "params",
        "--allowed-rules",
        RULE_OF[product],
        "configuration",
        "--",
        *names,
    )
    return folder


RULE_OF = {
    "motion/seen-00000.csv": "motion",
    "report.html": "report",
    "shards/index.json": "index",
    "shards/README.md": "card",
    "accuracy.csv": "tables",
}


def test_the_flight_log_and_settings_that_may_be_left_out_are_named_by_the_rule_of_motion(
    finished, tmp_path
):
    folder = remade(finished, tmp_path / "moved", "motion/seen-00000.csv")
    (job,) = [
        job for log, job in said_by_jobs(folder).items() if "/motion/" in log and job["opened"]
    ]
    assert "flight.csv" in job["opened"]
    assert undeclared(folder) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", REMOVED)
def test_an_input_or_a_setting_that_is_taken_from_a_rule_is_noticed(finished, tmp_path, name):
    *edit, product = REMOVED[name]
    assert undeclared(remade(finished, tmp_path / "removed", product, tuple(edit)))


def test_any_one_sample_is_made_again_alone_from_its_row(finished):
    base = finished / "results/test"
    network = Network.from_settings(load_yaml(finished / "config/default.yaml")["network"])
    number = 1
    row = read_table(base / "motion/unseen-00000.csv")[1]
    cloud = read(base / "clouds" / f"{slug(row['subtype'])}.npz")
    motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
    aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
    alone = echo_signal(network, network.station("B"), motion, cloud.rcs_m2, aim).signal
    stored = np.load(base / "echo/unseen-00000/B.npy")[number]
    np.testing.assert_array_equal(alone.astype(np.complex64), stored)


def test_another_workflow_in_another_folder_uses_this_one_as_a_module(finished, tmp_path):
    (tmp_path / "Snakefile").write_text(MODULE.format(root=finished))
    environment = {**os.environ, "PYTHONPATH": str(finished / "src")}
    status, text = run(tmp_path, ["--cores", "2"], environment)
    assert status == 0, text
    for name in ("motion/unseen-00000.csv", "clouds/crow.npz"):
        path = tmp_path / "results/test" / name
        if path.exists():
            assert path.read_bytes() == (finished / "results/test" / name).read_bytes(), name
    size = (finished / "results/test/motion/unseen-00000.csv").stat().st_size
    assert int((tmp_path / "size.txt").read_text()) == size
    assert not (tmp_path / "config").exists()


def test_the_catalogue_s_snakefile_plans_the_same_run(finished):
    """It reads the other file, by which nothing of a finished run is left to do."""
    text = snakemake(finished, "--dry-run", "--printshellcmds", "--snakefile", "workflow/Snakefile")
    assert "Nothing to be done" in text and not re.findall(
        r"^(?:local)?rule (\w+):", text, re.MULTILINE
    )


def test_snakemake_s_own_report_shows_figures_and_tables(finished, tmp_path):
    snakemake(finished, "--report", str(tmp_path / "report.html"), "--", "clouds")
    page = (tmp_path / "report.html").read_text()
    assert "results/test/clouds.png" in page and "Calibration point clouds of all subtypes" in page
