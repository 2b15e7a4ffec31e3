"""Choosing on validation: what a fold holds out, what is never opened, and what the tables say, by construction."""

import csv
import json

import numpy as np
import pytest

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError
from lowalt.recognition import choose, predictions, protocols, recipe, samples
from lowalt.recognition.trial import main as trial_main
from trainings import SETTINGS, TRAINING

SUBTYPES = [(f"{name} {number}", label) for label, name in enumerate("UBVP") for number in range(5)]


def facts(models=10, folds=("train", "val"), group="seen"):
    rows = [
        (f"{name}-{model}-{snr:g}", name, model, snr, group, folds[model % len(folds)], label)
        for name, label in SUBTYPES for model in range(models) for snr in (3.0, np.inf)
    ]  # fmt: skip
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    nan = np.full((len(rows), 3), np.nan)
    return samples.Facts(*columns, nan, nan)


def test_every_subtype_is_held_out_once_and_never_trained_on_then():
    found, held = facts(), []
    for fold in range(3):
        parts = choose.parts(found, fold, 3)
        rows = np.concatenate(list(parts.values()))
        assert len(set(rows.tolist())) == len(rows)
        names = {part: set(found.subtype[numbers].tolist()) for part, numbers in parts.items()}
        assert names["train"] == names["validation"] and not names["train"] & names["held"]
        assert set(found.fold[parts["train"]].tolist()) == {"train"}
        assert set(found.fold[parts["validation"]].tolist()) == {"val"}
        assert {label for name, label in SUBTYPES if name in names["held"]} == set(range(4))
        held += sorted(names["held"])
    assert sorted(held) == sorted(name for name, _ in SUBTYPES)


def test_nothing_that_a_table_tests_on_is_opened():
    tested = {pair for protocol in protocols.FOLDS for part in ("test", "seen_test")
              for pair in protocols.FOLDS[protocol].get(part, ())}  # fmt: skip
    assert not choose.PAIRS & tested
    for wrong in (facts(folds=("train", "test")), facts(group="unseen")):
        with pytest.raises(InputError, match=r"choices: samples of .*, expected .* alone"):
            choose.parts(wrong, 0, 3)
    assert [choose.held_out(facts(), fold, 2)[:3] for fold in (0, 1)] == [["U 0", "U 2", "U 4"], ["U 1", "U 3", "B 1"]]
    assert choose.held_out(facts(), 4, 5) == ["U 4", "B 4", "V 4", "P 4"]
    for fold, count in ((3, 3), (-1, 3), (0, 1), (0, 6)):
        with pytest.raises(InputError, match=f"fold {fold} of {count}"):
            choose.held_out(facts(), fold, count)


def test_the_candidates_are_those_of_the_file_and_change_only_what_there_is():
    table = choose.read(choose.TABLE)
    block = load_yaml("config/default.yaml")["recognition"]
    settled = [choose.settled(block, changes) for changes in map(table.changes, table.candidates)]
    assert table.extra("also-sizes-that-no-maker-has-built") == ["invented"] and table.extra("32 pixels") == []
    own = [one for name, one in zip(table.candidates, settled, strict=True) if not table.extra(name)]
    assert all(one not in own[:number] for number, one in enumerate(own))
    for one in settled:
        recipe.check(one["training"])
    assert table.named("32-pixels") == "32 pixels"
    with pytest.raises(InputError, match=r"training\.step is no key"):
        choose.settled(block, {"training": {"step": 3}})
    with pytest.raises(InputError, match="no candidate 'none'"):
        table.named("none")


def trial(folder, candidate, fold, seed, lost):
    """Predictions of a fold: `lost` of ten motion models of every held-out subtype called wrong, the others right."""
    found = facts()
    parts = choose.parts(found, fold, 3)
    found = found.take(np.concatenate([parts["held"], parts["validation"]]))
    held = choose.held_out(facts(), fold, 3)
    wrong = np.isin(found.subtype, held) & (found.model < lost)
    path = folder / candidate / f"{fold}-{seed}.csv"
    predictions.write(path, predictions.from_facts(found, (0,), np.eye(4)[(found.label + wrong) % 4]))
    about = {"candidate": candidate, "fold": fold, "seed": seed, "held": held, "train_processor_s": 10.0 + fold,
             "steps": 7, "batch": 3, "size": 24, "hardware": "test bench"}  # fmt: skip
    path.with_suffix(".json").write_text(json.dumps(about))
    return choose.CandidateTrial(path)


def test_tables_say_what_the_predictions_say(tmp_path):
    trials = [
        trial(tmp_path, name, fold, seed, lost + seed)
        for name, lost in (("base", 4), ("better", 1)) for fold in range(3) for seed in (0, 1, 2)
    ]  # fmt: skip
    choose.write(trials, tmp_path, 1)
    with (tmp_path / "choices.csv").open(newline="") as file:
        base, better = csv.DictReader(file)
    assert (base["candidate"], base["folds"], base["seeds"], base["core_s"]) == ("base", "3", "3", "11.0")
    assert (float(base["held_percent"]), float(better["held_percent"])) == (50.0, 80.0)
    assert float(base["kept_percent"]) == 100.0
    assert [float(base[name]) for name in ("difference_points",)] == [0.0]
    assert float(better["difference_points"]) == 30.0
    # Seeds differ by ten points, and each candidate's are drawn apart: 2.78 sqrt(2) 10 / sqrt(3) on either side, by
    # Student's quantile of four degrees of freedom.
    assert float(better["low"]) == pytest.approx(7.3, abs=3) and float(better["high"]) == pytest.approx(52.7, abs=3)
    with (tmp_path / "choices_subtypes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40 and {row["kept_percent"] for row in rows} == {"100.00"}
    assert {row["held_percent"] for row in rows if row["candidate"] == "better"} == {"80.00"}
    with pytest.raises(InputError, match="'better' has other folds and seeds"):
        choose.tables(trials[:-1], 1)


def test_a_trial_from_the_command_line_trains_without_what_it_predicts(tmp_path, capsys):
    found = facts(models=4)
    views = np.random.default_rng(0).integers(0, 255, (len(found), 9, 24, 24), dtype=np.uint8)
    samples.write(tmp_path / "views.npz", views, found)
    (tmp_path / "choices.yaml").write_text(
        "folds: 3\nscheme: 'A:VT'\ncandidates:\n  quick: {size: 24, training: {steps: 3, validate_every: 3}}\n"
    )
    block = {**SETTINGS, "network": {**SETTINGS["network"], "backbone": "test_resnet"}, "training": TRAINING}
    block["evaluation"] = {"batch": 16, "threads": 1, "precision": "fp32", "mirror": True}
    given = ["--settings", json.dumps(block), "--views", str(tmp_path / "views.npz"), "--candidate", "quick",
             "--candidates", str(tmp_path / "choices.yaml"), "--fold", "1", "--stations", *"ABC"]  # fmt: skip
    trial_main([*given, "--out", str(tmp_path)])
    made = choose.CandidateTrial(tmp_path / "predictions.csv")
    assert set(made.held.subtype.tolist()) == set(choose.held_out(found, 1, 3)) == set(made.about["held"])
    assert set(made.kept.fold.tolist()) == {"val"} and not set(made.kept.subtype.tolist()) & set(made.about["held"])
    assert made.about["train_samples"] == (20 - 8) * 2 * 2 and made.about["steps"] == 3
    assert made.about["mirror"] is True
    # Another run's samples are trained on too, but not those of a held-out subtype.
    other = facts(models=6, folds=("train",))
    samples.write(tmp_path / "extra.npz", views[:1].repeat(len(other), 0), other)
    trial_main([*given, "--extra", str(tmp_path / "extra.npz"), "--out", str(tmp_path / "more")])
    more = choose.CandidateTrial(tmp_path / "more/predictions.csv")
    assert more.about["train_samples"] == (20 - 8) * 2 * (2 + 6)
    assert sorted(more.held.key.tolist()) == sorted(made.held.key.tolist())
