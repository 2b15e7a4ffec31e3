"""What CONTRIBUTING.md promises: where it says that one new file is enough, one new file is enough."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lowalt.files.package_plan import EXTENSIONS, ROOMS

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src/lowalt"
EFFECT = '''"""DC offset: the mixer's own oscillator leaks into its output and adds a constant to every sample."""

import numpy as np

from lowalt.scene.waveform import Look

SOURCE = "T. Schenk, RF Imperfections in High-rate Wireless Systems, Springer 2008, ch. 2"
DEFAULTS = {"share": 0.5}
IDLE = [{"share": 0}]


def receive(settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return the samples (N, M) plus `share` times their largest value."""
    return samples + settings["share"] * np.abs(samples).max()
'''
ENTRY = """      dc_offset:
        description: a constant that the mixer adds to every sample
        type: [object, "null"]
        additionalProperties: false
        properties: {share: {description: "constant over the largest sample", type: number, minimum: 0, maximum: 1}}
"""


SPECTRUM = '''"""Power: the mean power of a window, the same in every row. For trying out a new spectrum."""

from dataclasses import dataclass

import numpy as np

from lowalt.spectra.fourier import segments

TITLE = "mean power"
SOURCE = "any textbook, ch. 3"
SIGNED = True
ZERO_FIRST = False


@dataclass(frozen=True)
class Settings:
    """`window` and `hop` in symbols."""

    window: int
    hop: int


DEFAULTS = Settings(32, 1)


def rows(settings):
    """Return the number of rows."""
    return 16


def speeds(settings, frequency_hz, symbol_interval_s):
    """Return the speeds of the first and the last row."""
    return -1.0, 1.0


def definition(signals, settings, name, frequency_hz, symbol_interval_s):
    """Return the power of every window, (..., symbols) -> (..., 16, windows)."""
    power = np.mean(abs(segments(signals, settings.window, settings.hop, name)) ** 2, axis=-1)
    return np.repeat(power[..., None, :], 16, axis=-2)


def tables(settings, frequency_hz, symbol_interval_s):
    """Return no tables."""
    return ()


def fill(re, im, settings, tables, out):
    """Fill out (16, starts) float32."""
    power = np.convolve(re * re + im * im, np.full(settings.window, 1 / settings.window), "valid")
    out[:] = power[: out.shape[1]]
'''
SPECTRUM_ENTRY = """      power:
        description: mean power of a window
        type: object
        additionalProperties: false
        required: [window, hop]
        properties: {window: {type: integer, minimum: 2}, hop: {type: integer, minimum: 1}}
"""
TRIAL = """
import json
import numpy as np
from lowalt.__main__ import main
from lowalt.config.layers import load
from lowalt.recognition.augment import augment
from lowalt.recognition.schemes import columns_in, scheme
from lowalt.scene import explanation
from lowalt.scene.effects import PLACES
from lowalt.spectra import spectrum
from lowalt.tiles.render import Renderer, split

print(json.dumps([*PLACES]))
for overlays in ([], ["more.yaml"]):
    config = load(["config/default.yaml", *overlays], "workflow/schemas/config.schema.yaml")
    tiles = Renderer.from_settings({key: config[key] for key in ("network", "spectra", "images")})
    rng = np.random.default_rng(1)
    signals = rng.standard_normal((3, 400, 2)).view(np.complex128)[..., 0].astype(np.complex64)
    tile = tiles.tile(signals)
    images = split(tile, len(tiles.spectra))
    row = {"scheme": "BC:VRP+POWER", "stations": "BC", "spectra": "VRP+POWER", "fusion": "mean"}
    row |= {"backbone": "", "protocols": "seen"}
    seen = scheme(row, "here", ["A", "B", "C"])
    facts = {"spectra": list(tiles.spectra), "shape": tile.shape}
    if "power" in tiles.spectra:
        facts["columns"] = columns_in(seen.columns, list(tiles.spectra), 3, "here")
        blank = dict.fromkeys(("mirror", "shift_doppler", "shift_time", "contrast", "mask_time", "drop_view"), 0.0)
        chosen = images[facts["columns"]][None]
        facts["zeros"] = augment(chosen, seen.columns, {**blank, "mask_doppler": 1.0}, rng)[0].min(axis=(1, 2)).tolist()
        values = np.empty((256, 256), np.float32)
        tiles.values(signals[0], 0, "power", values)
        whole = spectrum("power").definition(signals[0], tiles.spectra["power"], "power", 1.0, 1.0)
        facts["mean"] = float(abs(values.mean() / whole.mean() - 1))
    print(json.dumps(facts))
main(["spectra", "more.yaml"])
# All other effects would be tried in turn.
explanation.PLACES = {"dc_offset": PLACES["dc_offset"]}
main(["explain", "scene.yaml", "--sample", "Crow:0", "--sources"])
"""


def enter(folder: Path, before: str, entry: str) -> None:
    """Write an entry into the schema of a copy of the tree, before the line `before`."""
    schema = folder / "workflow/schemas/config.schema.yaml"
    text = schema.read_text()
    assert text.count(before) == 1
    schema.write_text(text.replace(before, entry + before))


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """What TRIAL prints in a copy of the tree with one more effect and one more spectrum."""
    folder = tmp_path_factory.mktemp("tree")
    for name in ("src", "config", "workflow"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    # Machine code that is compiled for either tree serves both.
    for compiled in (ROOT / "src").rglob("__pycache__"):
        (folder / compiled.relative_to(ROOT)).symlink_to(compiled)
    (folder / "src/lowalt/scene/effects/receiver/dc_offset.py").write_text(EFFECT)
    enter(folder, "      adc:\n", ENTRY)
    (folder / "scene.yaml").write_text("run: leaky\neffects: {dc_offset: {share: 0.25}}\n")
    (folder / "src/lowalt/spectra/kinds/power.py").write_text(SPECTRUM)
    enter(folder, "      vrp: &fourier\n", SPECTRUM_ENTRY)
    (folder / "more.yaml").write_text(
        "run: more\nspectra: {power: {window: 16, hop: 2}, trp: null}\n"
    )
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    run = subprocess.run(
        [sys.executable, "-c", TRIAL], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.splitlines()


def test_one_new_file_and_its_schema_entry_add_an_effect_that_is_run_documented_and_priced(lines):
    # Run: the signal is another. Priced: its milliseconds. Documented: its source.
    line, source = [line for line in lines if line.startswith("dc_offset")]
    assert float(re.fullmatch(r"dc_offset +named +(\S+)%( +\S+%)+ +-?\d+\.\d", line)[1]) > 1
    assert "ch. 2" in source
    # Its place in the chain is the last of the receiver's, before detection begins.
    names = json.loads(lines[0])
    assert names.index("adc") + 1 == names.index("dc_offset") == names.index("canceller") - 1


def test_one_new_file_and_its_schema_entry_add_a_spectrum_that_is_run_documented_and_priced(lines):
    pattern = (
        r"power \(mean power\): 16 rows, 192 windows, zero at index 128, \d+\.\d\d ms per image \|"
        r" window 16"
    )
    (line,) = [number for number, line in enumerate(lines) if re.match(pattern, line)]
    assert lines[line + 1] == "  any textbook, ch. 3"
    before, found = map(json.loads, lines[1:3])
    # The configuration decides: without an entry there, the new file changes nothing.
    assert before == {"spectra": ["vrp", "trp", "vt"], "shape": [768, 768]}
    assert found["spectra"] == ["vrp", "vt", "power"] and found["shape"] == [768, 768]
    assert found["columns"] == [3, 5, 6, 8]
    assert found["zeros"] == [0, 128, 0, 128]
    assert found["mean"] < 0.02


# The page of fates names what is gone, that of words has a test of its own.
DESIGN = sorted(
    f"design/{path.name}"
    for path in (ROOT / "design").glob("*.md")
    if path.stem not in ("fates", "words")
)


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "README.md", *DESIGN])
def test_every_path_and_module_that_a_document_names_exists(name):
    text = (ROOT / name).read_text()
    files = r"[\w.-]+/[\w./-]*\w\.(?:py|yaml|csv|md|html|png|smk)"
    paths = set(re.findall(rf"`({files})`", text))
    # Names in capitals stand for any name, and results are there only after a run.
    paths = {
        path for path in paths if not re.search(r"(^|/)[A-Z]+[/.]|^results/(?!reference)", path)
    }
    modules = {
        found.rstrip(".") for found in re.findall(r"`(?:python -m )?(lowalt\.[a-z_.]+)", text)
    }
    # Short paths are those of the package, or of one of its rooms.
    places = (ROOT, ROOT / "src/lowalt", *(ROOT / "src/lowalt").iterdir())
    missing = [path for path in paths if not any((place / path).exists() for place in places)]
    for module in modules:
        parts = module.split(".")
        # A function may stand behind its module.
        candidates = [ROOT / "src" / "/".join(parts), ROOT / "src" / "/".join(parts[:-1])]
        if not any(path.is_dir() or path.with_suffix(".py").is_file() for path in candidates):
            missing.append(module)
    assert not missing
    assert paths or modules


def test_paths_of_the_table_of_changes_are_of_the_checkout_or_of_the_package():
    """Those that begin with no folder of the checkout are relative to the package."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    table = text.partition("## Where do I change")[2].partition("## Tests")[0]
    paths = set(re.findall(r"`([a-z_]+/[a-z_./]+)`", table))
    wrong = []
    for path in paths:
        base = ROOT if (ROOT / path.partition("/")[0]).is_dir() else PACKAGE
        if not (base / path).exists():
            wrong.append(path)
    assert len(paths) > 30
    assert not wrong


def test_every_name_in_the_list_of_words_stands_in_the_code():
    source = "\n".join(path.read_text() for path in (ROOT / "src").rglob("*.py"))
    known = set(re.findall(r"[A-Za-z_]\w+", source + (ROOT / "config/default.yaml").read_text()))
    known |= {path.stem for path in (ROOT / "src").rglob("*")} | {"config", "src"}
    rows = [
        line
        for line in (ROOT / "design/words.md").read_text().splitlines()
        if line.startswith("| ")
    ]
    named = {
        word
        for row in rows
        for code in re.findall(r"`([^`]+)`", row)
        for word in re.findall(r"[A-Za-z_]\w+", code)
    }
    assert len(rows) > 30 and len(named) > 30
    assert not named - known - {"py", "RUN"}


def test_every_folder_is_described_once_with_files_to_begin_with():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    rows = re.findall(r"^\| `([\w/]+)/` \| .+ \| (`.+`) \|$", text, re.MULTILINE)
    assert [folder for folder, _ in rows] == [*ROOMS, *(sorted(EXTENSIONS, key=text.index))]
    missing = [
        f"{folder}/{name}"
        for folder, names in rows
        for name in re.findall(r"`([^`]+)`", names)
        if not (PACKAGE / folder / name).is_file()
    ]
    assert not missing
    tracked = {path.name for path in ROOT.iterdir() if path.is_dir() and path.name[0] != "."}
    described = set(re.findall(r"^\| (`\w+/`.*?) \|", text, re.MULTILINE))
    named = {name for cell in described for name in re.findall(r"`(\w+)/`", cell)}
    assert named >= tracked - {"src", "build", "site", "wheels", "notebooks", "logs"}


def test_names_in_brackets_after_a_path_stand_in_that_file():
    named = [
        (path, word)
        for path, words in re.findall(
            r"`([\w./-]+\.py)` \(((?:`\w+`(?:, )?)+)\)", (ROOT / "CONTRIBUTING.md").read_text()
        )
        for word in re.findall(r"`(\w+)`", words)
    ]
    assert len(named) >= 5
    wrong = []
    for path, word in named:
        file = next(base / path for base in (PACKAGE, ROOT) if (base / path).is_file())
        if not re.search(rf"^(def|class)? ?{word}\b", file.read_text(), re.MULTILINE):
            wrong.append((path, word))
    assert not wrong
