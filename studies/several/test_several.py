"""The study of several targets: which classes are in a beam, and average precision where it is known."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from lowalt.recognition.samples import Facts

CLASSES = ["UAV", "Bird", "Vehicle"]


@pytest.fixture(scope="module")
def study():
    """The program, whose name several studies have."""
    pytest.importorskip("sklearn")
    spec = importlib.util.spec_from_file_location("several_study", Path(__file__).with_name("study.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("count", "birds"), [([0, 0], [False, True]), ([2, 2], [True, True])])
def test_the_classes_in_a_beam_are_those_of_the_target_and_its_companions(study, count, birds):
    empty, names = np.zeros(2), np.array(["DJI Mini 2", "Owl"])
    facts = Facts(names, names, np.array([0, 3]), *[empty] * 6)
    config = {"seed": 1, "effects": {"companions": {"subtypes": ["Crow"], "count": count}}}
    found = study.present(facts, config, CLASSES, {"DJI Mini 2": "UAV", "Owl": "Bird", "Crow": "Bird"})
    assert found.T.tolist() == [[True, False], birds, [False, False]]


def test_right_answers_are_precise_and_equal_answers_are_as_precise_as_the_class_is_frequent(study):
    rng = np.random.default_rng(2)
    label, rows = np.arange(60) % 3, np.arange(60)
    wanted = (label[:, None] == np.arange(3)) | (rng.random((60, 3)) < 0.3)
    right = study.precisions(wanted[None].astype(float), wanted, label, rows)
    np.testing.assert_allclose(right, 1)
    guessed = study.precisions(np.full((2, 60, 3), 0.5), wanted, label, rows)
    np.testing.assert_allclose(guessed[0, :3], wanted.mean(0))
    beside = [wanted[label != number, number].mean() for number in range(3)]
    np.testing.assert_allclose(guessed[1], [*beside, np.mean(beside)])
