"""The report: tables are read and pivoted as written, faults are named."""

import json
from types import SimpleNamespace

import pytest

from lowalt.files.errors import InputError
from lowalt.report.inputs import FILES, Inputs
from lowalt.report.page import SECTIONS, TEMPLATES, rendered
from lowalt.report.sections import other_runs, overview, recognition_cost, simulation_cost
from lowalt.report.stage_times import stage_times


def test_stage_times_sum_over_jobs_and_survive_short_ones(tmp_path):
    lines = [
        {"rule_name": "echo", "wildcards": {}, "s": 2.0, "cpu_time": 1.5, "max_rss": 100.0},
        {"rule_name": "echo", "wildcards": {}, "s": 3.0, "cpu_time": "NA", "max_rss": None},
        {
            "rule_name": "cloud",
            "wildcards": {"subtype": "crow"},
            "s": 1.0,
            "cpu_time": 0.5,
            "max_rss": 50.0,
        },
    ]
    paths = [tmp_path / f"{index}.jsonl" for index in range(3)]
    for path, line in zip(paths, lines, strict=True):
        path.write_text(json.dumps(line) + "\n")
    echo, cloud = stage_times(paths)
    assert echo == {"rule": "echo", "jobs": 2, "wall_s": 5.0, "cpu_s": 1.5, "peak_mib": 100.0}
    assert cloud["jobs"] == 1
    paths[0].write_text("not json\n")
    with pytest.raises(InputError, match=r"0\.jsonl: not an extended benchmark"):
        stage_times(paths)


@pytest.fixture
def bare(tmp_path):
    """A manifest whose files do not exist, without any name that a manifest may leave out."""
    files = {name: str(tmp_path / f"{name}.csv") for name in FILES}
    return files | {"clouds": ["a.npz"], "benchmarks": ["b.jsonl"]}


def test_a_manifest_names_each_file_once_and_a_wrong_one_is_refused(tmp_path, bare):
    path = tmp_path / "report.json"
    path.write_text(json.dumps(bare | {"transfer": "t.csv"}))
    found = Inputs.read(path)
    assert (
        found.paths("clouds") == ["a.npz"]
        and "transfer" in found
        and found.paths("predictions") == []
    )
    with pytest.raises(InputError, match=r"accuracy: no file at .*accuracy\.csv"):
        found.path("accuracy")
    for wrong, words in (
        ({**bare, "colours": "x"}, r"unknown \['colours'\]"),
        ({name: bare[name] for name in bare if name != "index"}, r"missing \['index'\]"),
    ):
        path.write_text(json.dumps(wrong))
        with pytest.raises(InputError, match=r"report\.json: .*" + words):
            Inputs.read(path)
    path.write_text("{")
    with pytest.raises(InputError, match=r"report\.json: not a manifest"):
        Inputs.read(path)


def test_a_section_that_a_run_may_lack_is_left_out(bare):
    run = SimpleNamespace(inputs=Inputs(bare))
    for section in (recognition_cost, simulation_cost, other_runs):
        assert section.values(run) is None
    assert rendered("other_runs", None) == ""


def test_every_section_has_a_template_and_every_template_a_section():
    names = set(SECTIONS)
    assert len(names) == len(SECTIONS)
    assert names == {path.stem for path in (TEMPLATES / "sections").glob("*.html")}
    assert names | {"__init__"} == {path.stem for path in (TEMPLATES / "sections").glob("*.py")}


def test_the_first_words_are_the_best_schemes_beside_the_paper_s_and_once_what_one_seed_says():
    rows = [
        {
            "protocol": protocol,
            "scheme": name,
            "snr_db": "avg",
            "accuracy_percent": value,
            "seeds": "1",
        }
        for protocol in ("seen", "unseen")
        for name, value in (("A", "80.0"), ("ABC", "92.5"))
    ]
    published = [
        {"protocol": "unseen", "scheme": "ABC", "snr_db": "avg", "accuracy_percent": "97.8"}
    ]
    seen, unseen = overview.accuracies(rows, published)
    assert (unseen["scheme"], unseen["percent"], unseen["paper"]) == ("ABC", 92.5, 97.8)
    assert seen["paper"] is None
    words = overview.verdict([seen, unseen], 4)
    assert words.startswith("Chance level is 25 %. The paper's data are not public")
    assert words.count("One training seed") == 1
    assert overview.verdict([seen | {"seeds": 3}], 2) == "Chance level is 50 %."
