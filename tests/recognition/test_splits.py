"""Folds and streams: exact shares, names decide and nothing else."""

import pytest

from lowalt.config.splits import fold
from lowalt.files.errors import InputError
from lowalt.numerics.streams import digest, stream

SPLIT = {"by": "motion", "train": 8, "val": 1, "test": 1}


def test_full_blocks_have_exact_shares():
    folds = [fold(SPLIT, 5, "Crow", model) for model in range(200)]
    assert [folds.count(name) for name in ("train", "val", "test")] == [160, 20, 20]
    assert [folds[:10].count(name) for name in ("train", "val", "test")] == [8, 1, 1]
    unequal = [fold({**SPLIT, "val": 2, "test": 5}, 5, "Crow", model) for model in range(150)]
    assert [unequal.count(name) for name in ("train", "val", "test")] == [80, 20, 50]


def test_a_motion_model_never_leaks_and_the_papers_way_does():
    assert len({fold(SPLIT, 5, "Crow", 3, snr) for snr in (3.0, 8.0, 13.0)}) == 1
    paper = {**SPLIT, "by": "sample"}
    mixed = [
        len({fold(paper, 5, "Crow", model, snr) for snr in (3.0, 8.0, 13.0)}) for model in range(50)
    ]
    assert max(mixed) > 1
    shares = [fold(paper, 5, "Crow", model, 3.0) for model in range(100)]
    assert shares.count("train") == 80


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"by": "model"}, "by is 'model'"),
        ({"train": 0}, "shares"),
        ({"val": -1}, "shares"),
        ({"by": "sample"}, "SNR"),
    ],
)
def test_bad_split_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        fold({**SPLIT, **change}, 1, "Crow", 0)


def test_stream_keys_cannot_run_together():
    keys = [("a", "bc"), ("ab", "c"), ("abc",), ("3",), (3,), (3.5,), ("3.5",)]
    assert len({digest(1, "x", *key) for key in keys}) == len(keys)
    assert digest(1, "x", 3) == digest(1, "x", 3.0)
    assert digest(1, "x") != digest(2, "x")
    assert stream(1, "x", "a").random() == stream(1, "x", "a").random()
    with pytest.raises(TypeError, match="list"):
        digest(1, "x", [1])
