"""`recognition.start` in the workflow: an input of a training, its own steps, and refusals before any job starts."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from configured import Inputs, parts, run_of
from lowalt.common.errors import InputError
from lowalt.workflow import options
from lowalt.workflow.refusals import refuse_starts

ROOT = Path(__file__).parent.parent
ONE, THREE = "A:VRP+TRP+VT", "ABC:VRP+TRP+VT"
STARTS = {
    f"seen/{THREE}": {"from": f"unseen/{THREE}", "steps": 20},
    f"seen/{ONE}": {"from": f"seen/{THREE}", "steps": 5, "rate": 1e-4},
}


@pytest.fixture(autouse=True)
def checkout(monkeypatch):
    """Paths of the default configuration are relative to the checkout."""
    monkeypatch.chdir(ROOT)


class Job(SimpleNamespace):
    """Wildcards of a job, as Snakemake gives them."""

    def get(self, name, default):
        """The value of a wildcard, or the default."""
        return getattr(self, name, default)


def job(protocol, scheme):
    """The wildcards of one training with the training seed 4."""
    return Job(run="default", protocol=protocol, scheme=scheme, train_seed="4")


def test_a_started_training_reads_its_start_and_has_steps_of_its_own():
    _, products, settings = parts({"recognition": {"start": STARTS}})
    _, bare, before = parts()
    one, three, other = job("seen", "a-vrp-trp-vt"), job("seen", "abc-vrp-trp-vt"), job("unseen", "a-vrp-trp-vt")
    base = "results/default/models"
    assert products.training_samples(one)["start"] == f"{base}/seen/abc-vrp-trp-vt/4/model.pt"
    assert products.training_samples(three)["start"] == f"{base}/unseen/abc-vrp-trp-vt/4/model.pt"
    assert products.training_samples(other) == bare.training_samples(other)
    told = json.loads(settings.training(one))["training"]
    assert (told["steps"], told["rate"], told["batch"]) == (5, 1e-4, 32) and "from" not in told
    assert json.loads(settings.training(three))["training"]["steps"] == 20
    assert settings.training(other) == before.training(other)
    assert settings.training(Job(run="default", scheme="a-vrp-trp-vt")) == before.training(Job(run="default"))
    assert options.start(one, Inputs(start="a.pt")) == ["--start", "a.pt"] and options.start(one, Inputs()) == []


def test_an_overlay_that_trains_less_or_takes_a_start_out_has_none():
    unseen = {"protocols": ["unseen"], "start": STARTS}
    assert run_of({"recognition": unseen}).starts == {}
    less = {**STARTS, f"seen/{ONE}": None}
    assert set(run_of({"recognition": {"start": less}}).starts) == {f"seen/{THREE}"}


@pytest.mark.parametrize(
    ("name", "origin", "message"),
    [
        (f"seen/{ONE}", f"seen/B:{ONE[2:]}", "expected one of"),
        (f"unseen/{ONE}", f"seen/{ONE}", "which trains on samples that 'unseen' tests"),
        (f"seen/{THREE}", f"seen/{ONE}", "is a circle"),
        (f"seen/{ONE}", f"seen/{ONE}", "is a circle"),
        ("seen/D:VRP", f"seen/{THREE}", "scheme 'D:VRP': not in"),
        (f"heard/{ONE}", f"seen/{THREE}", "recognition.start"),
    ],
)
def test_a_start_that_cannot_be_meant_is_refused_by_name(name, origin, message):
    circle = {f"seen/{ONE}": {"from": f"seen/{THREE}", "steps": 5}}
    with pytest.raises(InputError, match=message):
        run_of({"recognition": {"start": {**circle, name: {"from": origin, "steps": 5}}}})


def test_starts_may_follow_one_another_and_never_meet_again():
    refuse_starts({"seen/a": {"from": "seen/b"}, "seen/b": {"from": "seen/c"}}, {"seen/a", "seen/b", "seen/c"})
    with pytest.raises(InputError, match="seen/a from seen/b from seen/a is a circle"):
        refuse_starts({"seen/a": {"from": "seen/b"}, "seen/b": {"from": "seen/a"}}, {"seen/a", "seen/b"})
