"""What CONTRIBUTING.md promises: where it says that one new file is enough, one new file is enough."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
EFFECT = '''"""DC offset: the mixer's own oscillator leaks into its output and adds a constant to every sample."""

import numpy as np

from lowalt.effects.waveform import Frame

SOURCE = "T. Schenk, RF Imperfections in High-rate Wireless Systems, Springer 2008, ch. 2"
DEFAULTS = {"share": 0.5}


def idle(settings: dict) -> bool:
    """Return True where nothing leaks."""
    return settings["share"] == 0


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the samples (N, M) plus `share` times their largest value."""
    return samples + settings["share"] * np.abs(samples).max()
'''
ENTRY = """      dc_offset:
        description: a constant that the mixer adds to every sample
        type: [object, "null"]
        additionalProperties: false
        properties: {share: {description: "constant over the largest sample", type: number, minimum: 0, maximum: 1}}
"""


def test_one_new_file_and_its_schema_entry_add_an_effect_that_is_run_documented_and_priced(tmp_path):
    for name in ("src", "config", "workflow"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / "src/lowalt/effects/receiver/dc_offset.py").write_text(EFFECT)
    schema = tmp_path / "workflow/schemas/config.schema.yaml"
    text = schema.read_text()
    assert text.count("      adc:\n") == 1
    schema.write_text(text.replace("      adc:\n", ENTRY + "      adc:\n"))
    (tmp_path / "scene.yaml").write_text("run: leaky\neffects: {dc_offset: {share: 0.25}}\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "src")}

    def python(*arguments):
        run = subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        assert run.returncode == 0, run.stderr
        return run.stdout

    found = python("-m", "lowalt", "explain", "scene.yaml", "--sample", "Crow:0", "--station", "A")
    # Documented: its place, its parameter and its source. Priced: milliseconds added. Run: the signal is another.
    (line,) = [line for line in found.splitlines() if line.startswith("dc_offset")]
    assert re.fullmatch(r"dc_offset \(receiver\): share 0\.25 \| \+-?\d+\.\d\d ms", line)
    assert "ch. 2" in found
    assert float(re.search(r"rms change (\S+),", found)[1]) > 0.01
    program = (
        "from lowalt.common.config import load; from lowalt.measure.effects_calls import calls\n"
        "schema = 'workflow/schemas/config.schema.yaml'\n"
        "print(*calls(load(['config/default.yaml'], schema), schema))"
    )
    names = python("-c", program).split()
    # Its place in the chain is the last of the receiver's, before detection begins.
    assert names.index("adc") + 1 == names.index("dc_offset") == names.index("canceller") - 1


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "README.md", "design/interfaces.md"])
def test_every_path_and_module_that_a_document_names_exists(name):
    text = (ROOT / name).read_text()
    files = r"[\w.-]+/[\w./-]*\w\.(?:py|yaml|csv|md|html|png|smk)"
    paths = set(re.findall(rf"`({files})`", text))
    # Names in capitals stand for any name, and results are there only after a run.
    paths = {path for path in paths if not re.search(r"(^|/)[A-Z]+[/.]|^results/(?!reference)", path)}
    modules = {found.rstrip(".") for found in re.findall(r"`(?:python -m )?(lowalt\.[a-z_.]+)", text)}
    # Short paths are those of the package.
    missing = [path for path in paths if not (ROOT / path).exists() and not (ROOT / "src/lowalt" / path).exists()]
    for module in modules:
        parts = module.split(".")
        # A function may stand behind its module.
        candidates = [ROOT / "src" / "/".join(parts), ROOT / "src" / "/".join(parts[:-1])]
        if not any(path.is_dir() or path.with_suffix(".py").is_file() for path in candidates):
            missing.append(module)
    assert not missing
    assert paths or modules


def test_every_name_in_the_list_of_words_stands_in_the_code():
    source = "\n".join(path.read_text() for path in (ROOT / "src").rglob("*.py"))
    known = set(re.findall(r"[A-Za-z_]\w+", source + (ROOT / "config/default.yaml").read_text()))
    known |= {path.stem for path in (ROOT / "src").rglob("*")} | {"config", "src"}
    rows = [line for line in (ROOT / "design/words.md").read_text().splitlines() if line.startswith("| ")]
    named = {
        word for row in rows for code in re.findall(r"`([^`]+)`", row) for word in re.findall(r"[A-Za-z_]\w+", code)
    }
    assert len(rows) > 50 and len(named) > 50
    assert not named - known - {"py", "RUN"}
