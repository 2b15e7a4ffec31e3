"""A user's own file that answers is confirmed.

It is frozen with all that it reads, before its code runs.
"""

import json
import subprocess

import numpy as np
import pytest
import small_benchmark

from lowalt.__main__ import main
from lowalt.extensions.benchmark import confirm, definition
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS
from lowalt.extensions.benchmark.part_samples import columns_of
from lowalt.files.errors import InputError

TRACK = TRACKS["unseen"]
OWN = '''
from pathlib import Path

import numpy as np
from levels import level

TRAINED_ON = "unseen", "train"
FILES = ["levels.py", "mine.npz"]

weights = np.load(Path(__file__).with_name("mine.npz"))["weights"]


def predict(signals, images):
    """Probabilities by the mean of each image."""
    logits = level(images) @ weights
    shares = np.exp(logits - logits.max(1, keepdims=True))
    return shares / shares.sum(1, keepdims=True)
'''


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A file of predictions with a module and an array that it reads, and a small benchmark."""
    small_benchmark.shrink(monkeypatch)
    monkeypatch.setattr(confirm, "USUAL", 1)
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "levels.py").write_text(
        "def level(images):\n    return images.mean((2, 3)) / 255\n"
    )
    np.savez(tmp_path / "mine.npz", weights=np.random.default_rng(0).normal(size=(9, 4)))
    yield tmp_path / "own.py"
    small_benchmark.clear()


def test_the_test_set_follows_from_the_file_and_all_that_it_reads(own, capsys, monkeypatch):
    assert main(f"benchmark confirm --predict {own} --track unseen --json".split()) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert "with your rights and at your own risk" in printed.err
    assert found["samples"] == 4 * 2 * 2
    sums = subprocess.run(
        ["sha256sum", "own.py", "levels.py", "mine.npz"],
        cwd=own.parent,
        capture_output=True,
        check=True,
    ).stdout
    assert found["seed"] == definition.root_seed(sums + b"lowalt-40 v1")
    assert confirm.confirm_predictions(own, TRACK).percent == tuple(found["percent"])
    # The file's answers are those of the samples of this root seed.
    samples = confirm.FreshSamples(TRACK, found["seed"], columns_of(TRACK), 24)
    signals, images = samples.signals_and_images()
    assert signals.shape == (16, 3, 400) and np.allclose(np.mean(abs(signals) ** 2, axis=-1), 1)
    weights = np.load(own.with_name("mine.npz"))["weights"]
    right = (images.mean((2, 3)) / 255 @ weights).argmax(1) == samples.facts.label
    assert found["percent"][0] == pytest.approx(100 * right.mean())
    for name in ("levels.py", "mine.npz"):
        path = own.with_name(name)
        whole = path.read_bytes()
        if name == "levels.py":
            path.write_bytes(whole + b"\n")
        else:
            np.savez(path, weights=weights, more=0)
        assert confirm.confirm_predictions(own, TRACK).seed != found["seed"]
        path.write_bytes(whole)


FAULTS = {
    "an unnamed module": (
        ('["levels.py", "mine.npz"]', '["mine.npz"]'),
        "reads .*levels.py, which its FILES does not",
    ),
    "an unnamed array": (
        ('["levels.py", "mine.npz"]', '["levels.py"]'),
        "reads .*mine.npz, which its FILES does not",
    ),
    "a missing file": (
        ('"mine.npz"]', '"mine.npz", "gone.npz"]'),
        "FILES names 'gone.npz', which is not a file",
    ),
    "another track": (
        ('"unseen", "train"', '"seen", "train"'),
        "states TRAINED_ON = .'seen', 'train'., and the track",
    ),
    "another part": (
        ('"unseen", "train"', '"unseen", "test"'),
        "states TRAINED_ON = .'unseen', 'test'.",
    ),
    "no statement": (('TRAINED_ON = "unseen", "train"', ""), "does not state what it trained on"),
    "a computed list": (
        ('["levels.py", "mine.npz"]', "list(range(3))"),
        "FILES is computed, expected it written out",
    ),
    "no function": (("def predict", "def answer"), "has no function predict"),
    "logits": (
        ("return shares / shares.sum(1, keepdims=True)", "return -1 - shares"),
        "expected a number from 0 to 1",
    ),
    "an error": (
        ("logits = level(images)", "logits = level(image)"),
        "NameError: name 'image' is not defined",
    ),
    "an end of the process": (
        ("logits = level(images) @ weights", "raise SystemExit(0)"),
        "SystemExit: 0",
    ),
    "statistics of the test": (
        ("level(images) @", "(level(images) - level(images).mean(0)) @"),
        "when it is alone",
    ),
    "no Python": (("def predict", "de predict"), "not a Python file"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_file_that_is_not_frozen_or_breaks_a_rule_is_refused(own, fault, monkeypatch):
    (old, new), sentence = FAULTS[fault]
    assert old in OWN
    own.write_text(OWN.replace(old, new))
    with pytest.raises(InputError, match=sentence) as caught:
        confirm.confirm_predictions(own, TRACK)
    assert "\n" not in str(caught.value)


def test_a_model_and_a_file_are_asked_for_one_at_a_time(own, capsys):
    assert main(["benchmark", "confirm", "--track", "unseen"]) == 2
    assert main(f"benchmark confirm default-unseen --predict {own} --track unseen".split()) == 2
    assert "expected either a model or --predict FILE.py" in capsys.readouterr().err
