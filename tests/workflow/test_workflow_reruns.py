"""Reruns are minimal and explained: for every change the jobs of a dry run are those that a model
of the stages names.

The finished run is made by `snakemake --touch`: empty files, but every job recorded with its
settings, inputs and code, which is all that Snakemake's decisions rest on. The model of what
follows from what is written down here again, job by job, and knows nothing of the Snakefile.
"""

import json
import os
import re

import pytest
import yaml
from test_workflow import ROOT, workplace

from rerun_model import (
    CARD,
    CHUNKS,
    CLOUD,
    DISTANCES,
    ECHO,
    EVALUATE,
    GALLERY,
    GROUPS,
    INDEX,
    MANIFEST,
    MESH,
    MOTION,
    NOISE,
    OVERLAY,
    REPORT,
    SETTINGS,
    SHARD,
    TABLES,
    TILES,
    TRAIN,
    TRAININGS,
    VIEWS,
    WHOLE,
    Change,
    added,
    code,
    grown,
    next_jobs,
    with_what_follows,
)
from snakemake_runs import run
from snakemake_texts import declared

pytest.importorskip("snakemake")
pytestmark = pytest.mark.workflow

CHANGES = {
    # The settings of each stage.
    "seed": Change(WHOLE - MANIFEST, overlay={"seed": 5}),
    "guard subcarriers": Change(
        ECHO | TILES | SHARD | INDEX, overlay={"network": {"guard_subcarriers": 20}}
    ),
    "scene": Change(ECHO, ("power.npy",), overlay={"effects": {"adc": {}}}),
    "SNR list": Change(NOISE | SHARD, overlay={"noise": {"snr_db": [9, float("inf")]}}),
    "colour map": Change(TILES | INDEX | TRAIN, overlay={"images": {"colour_map": "magma"}}),
    "more motion models": Change(
        set(),
        ("Missing output files",),
        overlay={"motion": {"models": 20}},
        expected=grown("00001"),
    ),
    "an SNR added": Change(
        set(),
        ("Missing output files",),
        overlay={"added": [{"snr_db": [13]}]},
        expected=added("s1", GROUPS, motion=False),
    ),
    "a subtype added": Change(
        set(),
        ("Missing output files",),
        overlay={"added": [{"subtypes": ["AITO M9 2024"]}]},
        expected=added("t1", ["seen"], motion=True) | {("cloud", "aito-m9-2024")},
    ),
    "a station more": Change(
        {("echo", *chunk, "D") for chunk in CHUNKS} | NOISE | TILES | SHARD | INDEX | MANIFEST,
        ("Missing output files", "Params have changed", "Set of input files has changed"),
        overlay={
            "network": {
                "stations": {"D": {"position_m": [800.0, 800.0, 25.0], "normal_deg": 225.0}}
            }
        },
    ),
    "kind of shards": Change(
        set(),
        overlay={"shards": {"kind": "signal"}},
        expected=with_what_follows(SHARD | SETTINGS | MANIFEST, images=False),
    ),
    "evaluation batch": Change(EVALUATE, overlay={"recognition": {"evaluation": {"batch": 32}}}),
    "protocol": Change(
        TABLES | MANIFEST,
        ("Set of input files has changed",),
        overlay={"recognition": {"protocols": ["unseen"]}},
    ),
    "scheme": Change(
        TABLES | MANIFEST,
        ("Set of input files has changed",),
        overlay={"recognition": {"schemes": ["ABC:VRP+TRP+VT"]}},
    ),
    "a second training seed": Change(
        {(rule, *training[:2], "1") for rule in ("train", "evaluate") for training in TRAININGS}
        | TABLES
        | MANIFEST,
        ("Missing output files",),
        overlay={"recognition": {"seeds": [0, 1]}},
    ),
    # Files of the user.
    "a target's record": Change(
        {("cloud", "crow")},
        edit=(
            "config/targets/bird.yaml",
            "length: [0.348, m, authors]",
            "length: [0.349, m, authors]",
        ),
    ),
    "a target's published row": Change(
        {("cloud", "nio-et5t-2023"), *((work) for work in MOTION if work[1] == "unseen"), *REPORT},
        edit=("config/targets.csv", "NIO ET5T 2023,,4,,,,,,4.8,", "NIO ET5T 2023,,4,,,,,,4.9,"),
    ),
    "a mesh": Change({("cloud", "dji-mini-2")}, (MESH,), edit=(f"inputs/{MESH}", "", "edited\n")),
    "another row of the table of schemes": Change(
        TABLES,
        ("config/schemes.csv",),
        edit=("config/schemes.csv", "A:VRP,A,VRP,attention", "A:VRP,A,VRP,mean"),
    ),
    "the row of a scheme that is trained": Change(
        {work for work in TRAIN if work[2] == "a-vrp-trp-vt"} | TABLES,
        edit=(
            "config/schemes.csv",
            "A:VRP+TRP+VT,A,VRP+TRP+VT,attention",
            "A:VRP+TRP+VT,A,VRP+TRP+VT,mean",
        ),
    ),
    "published accuracy": Change(
        TABLES | REPORT,
        ("published_accuracy.csv",),
        edit=("config/published_accuracy.csv", "", "\n"),
    ),
    "text of the report": Change(
        REPORT, ("page.html",), edit=("src/lowalt/report/page.html", "", "<!-- -->\n")
    ),
    # The code of each stage.
    "code of clouds": code("targets/bird.py", CLOUD),
    "code of the gallery": code("targets/gallery.py", GALLERY),
    "code of motion": code("motion/__main__.py", MOTION),
    "code of echoes": code("echo/__main__.py", ECHO),
    "code of noise": code("noise/__main__.py", NOISE),
    "code of tiles": code("tiles/png.py", TILES | TRAIN | EVALUATE | VIEWS | SHARD),
    "code of shards": code("shards/write.py", SHARD | INDEX),
    "code of the card": code("shards/card.py", CARD),
    "code of views": code("recognition/views.py", VIEWS | TRAIN | EVALUATE),
    "code of training": code("recognition/training.py", TRAIN | EVALUATE),
    "code of tables": code("recognition/tables.py", TABLES),
    "code of distances": code("recognition/distances.py", DISTANCES),
    "code of the report": code("report/pivots.py", REPORT),
    "nothing": Change(set(), ()),
}

QUICK = (
    "seed",
    "more motion models",
    "an SNR added",
    "a station more",
    "protocol",
    "a target's record",
    "a mesh",
    "the row of a scheme that is trained",
    "text of the report",
    "code of tiles",
    "nothing",
)
"""Changes that are planned in every run of the tests. What the others rest on stands in the rule
files, see the tests of the settings and of the code of each rule."""
SLOW = [name for name in CHANGES if name not in QUICK]


def jobs(text):
    """The jobs of a dry run as (rule, wildcards except the run's name), each with the reason that
    is named.
    """
    found = {}
    for rule, body in re.findall(r"^(?:local)?rule (\w+):\n((?:    .*\n)*)", text, re.MULTILINE):
        if rule == "all":
            continue
        rule = "echo" if rule == "echo_in_scene" else rule
        wildcards = re.search(r"^    wildcards: (.*)$", body, re.MULTILINE)
        names = dict(pair.split("=", 1) for pair in wildcards[1].split(", ")) if wildcards else {}
        names.pop("run", None)
        order = (
            "subtype",
            "size",
            "protocol",
            "scheme",
            "train_seed",
            "group",
            "fold",
            "part",
            "station",
        )
        found[(rule, *(names[name] for name in order if name in names))] = body[
            body.index("reason:") :
        ]
    return found


@pytest.fixture(scope="module")
def dry_runs(tmp_path_factory, request):
    """What a dry run says after each change of a finished run that a test of this session asks
    about.
    """
    asked = set()
    for item in request.session.items:
        if "dry_runs" in getattr(item, "fixturenames", ()):
            asked.add(item.callspec.params["name"])
    folder = workplace(tmp_path_factory.mktemp("reruns"))
    (folder / "src/sitecustomize.py").unlink()
    # One subtype has meshes of the user; a dry run asks only whether they are there and what they
    # hold.
    record = yaml.safe_load((ROOT / "config/targets/real.yaml").read_text())["DJI Mini 2"]
    (folder / "mesh.yaml").write_text(yaml.safe_dump({"DJI Mini 2": record}))
    for part in record["parts"].values():
        path = folder / "inputs" / part["meshes"][0]["file"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("solid\n")
    records = yaml.safe_load((ROOT / "config/default.yaml").read_text())["targets"]["records"]
    overlay = OVERLAY | {"targets": OVERLAY["targets"] | {"records": [*records, "mesh.yaml"]}}
    (folder / "overlay.yaml").write_text(yaml.safe_dump(overlay))
    plan = {
        name: (yaml.safe_dump(change.overlay), change.edit)
        for name, change in CHANGES.items()
        if name in asked
    }
    (folder / "changes.json").write_text(json.dumps(plan))
    support = ROOT / "tests/support"
    environment = os.environ | {
        "PYTHONPATH": f"{folder / 'src'}:{support}",
        "LOWALT_INPUTS": str(folder / "inputs"),
    }
    status, text = run(folder, [], environment, "import rerun_driver; rerun_driver.run()")
    assert status == 0, text[-4000:]
    said = json.loads((folder / "said.json").read_text())
    assert set(jobs(said["whole"])) == WHOLE
    return said


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)]
)
def test_a_change_re_runs_the_jobs_that_it_touches_and_names_the_reason(dry_runs, name):
    change = CHANGES[name]
    found = jobs(dry_runs[name])
    missing = change.jobs - set(found)
    more = set(found) - change.jobs
    assert (sorted(missing), sorted(more)) == ([], []), dry_runs[name][-600:]
    # A job that follows from another names that one's files; the others must name the change
    # itself.
    followers = with_what_follows({after for job in change.jobs for after in next_jobs(job)})
    reasons = [found[job] for job in change.jobs - followers - TILES - SETTINGS - MANIFEST]
    assert all(any(word in reason for word in change.reasons) for reason in reasons), "\n".join(
        reasons
    )
    assert all(any(word in reason for reason in found.values()) for word in change.reasons)


@pytest.mark.parametrize("name", [name for name in CHANGES if name.startswith("code of")])
def test_a_rule_declares_the_source_files_that_are_edited_here(name):
    """Its jobs then run again, as after an edit of `code of tiles` and after one of real jobs in
    test_workflow.py.
    """
    change = CHANGES[name]
    file = change.edit[0].removeprefix("src/lowalt/")
    assert all(file in declared(rule) for rule in {job[0] for job in change.first})
