"""The table of a whole `make`: processes fall into parts, times add up, and every process notes its
own.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

from from_clone import CAUSES, NOTES, causes, part, table


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["python", "-m", "lowalt.tiles", "--settings", "{}"], "tiles"),
        (["python", "-m", "lowalt.recognition", "train", "--views", "a"], "recognition train"),
        (["/env/bin/python", "/env/bin/snakemake", "--cores", "2"], "Snakemake"),
        (["/env/bin/python", "-m", "snakemake", "--cores", "2"], "Snakemake"),
        (["/env/bin/python", "/env/bin/lowalt", "sample", "DJI Mini 2", "0"], "machine code"),
        (["python", "-c", "import lowalt.recognition.runs, lowalt.report.__main__"], "bytecode"),
        (["python", "-m", "pip", "install", "snakemake"], None),
        (["python", "-c", "import tomllib"], None),
    ],
)
def test_a_command_line_belongs_to_a_stage_to_snakemake_or_to_neither(words, name):
    assert part(words) == name


def test_times_of_stages_add_up_and_what_is_left_of_the_processor_time_is_set_up_s():
    def ended(words, begin, end, cpu):
        imports = {"torch": 0.5, "yaml": 0.125}
        return {
            "words": words.split(),
            "begin": begin,
            "end": end,
            "cpu": cpu,
            "start": 0.25,
            "imports": imports,
        }

    notes = [
        ended("python -m lowalt.echo", 10, 16, 5),
        ended("python -m lowalt.echo", 12, 14, 1),
        ended("python -m lowalt.tiles", 16, 18, 2),
        ended("python .venv/bin/snakemake", 9, 19, 1.5),
        ended("python -m venv .venv", 0, 3, 3),
    ]
    rows = {row["part"]: row for row in table(notes, 2, 20.0, 14.0, {"set-up": 8.0})}
    assert (rows["echo"]["processes"], rows["echo"]["wall_s"], rows["echo"]["cpu_s"]) == (2, 8, 6)
    # Two processes start for 0.25 s and import for 0.625 s each.
    spent = {name: rows["echo"][name] for name in CAUSES if rows["echo"][name]}
    assert spent == {"start_s": 0.5, "torch_s": 1.0, "others_s": 0.25, "work_s": 4.25}
    assert rows["echo"]["percent"] == 80 and rows["Snakemake"]["percent"] == 100
    assert rows["make"] == {
        "part": "make",
        "processes": 5,
        "wall_s": 20.0,
        "cpu_s": 14.0,
        "percent": 25.0,
    }
    assert rows["set-up"]["wall_s"] == 8.0 and rows["set-up"]["cpu_s"] == 14.0 - 9.5


def test_a_process_notes_its_words_and_its_processor_time_by_cause(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(NOTES)
    busy = (
        "import time; begin = time.process_time()\nwhile time.process_time() < begin + {}: pass\n"
    )
    for name, seconds, more in (("outer", 0.1, "import inner\n"), ("inner", 0.2, "")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(
            busy.format(seconds) + more + "from . import part\n"
        )
        (tmp_path / name / "part.py").write_text("")
    program = "import outer\n" + busy.format(0.3)
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "LOWALT_NOTES": str(tmp_path)}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)
    (note,) = map(json.loads, (path.read_text() for path in tmp_path.glob("*.json")))
    assert note["words"][1:] == ["-c", program]
    assert 0.6 <= note["cpu"] <= note["end"] - note["begin"] + 0.5
    # An import counts without those inside it, so the parts add up to the whole.
    assert 0.1 <= note["imports"]["outer"] < 0.2 <= note["imports"]["inner"] < 0.3
    assert note["start"] > 0 and 0.3 <= causes([note])["work_s"] < 0.4
