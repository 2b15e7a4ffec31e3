"""Class probabilities (`lowalt.recognition.inference`) on one rank and on several, by a network
that is a formula.
"""

import numpy as np
import pytest
import torch
from torch import nn

from lowalt.files.errors import InputError
from lowalt.recognition import inference
from lowalt.recognition.inference import Machine, probabilities


class Formula(nn.Module):
    """Logits of three classes: the sample's number, its square over ten, and nought; mirrored, its
    sign is turned.
    """

    classes = 3

    def forward(self, images):
        number = images.double()
        return torch.stack([number, number**2 / 10, 0 * number], -1)

    @staticmethod
    def mirrored(images):
        return -images


class Numbers:
    """Samples whose image is their number; notes which were read together."""

    def __init__(self):
        self.read = []

    def inputs(self, numbers):
        self.read.append(numbers.tolist())
        return numbers.astype(np.float32)


def softmax(logits):
    shares = np.exp(logits - logits.max(-1, keepdims=True))
    return shares / shares.sum(-1, keepdims=True)


def by_hand(numbers, mirror):
    both = [
        softmax(np.stack([sign * numbers, numbers**2 / 10, 0.0 * numbers], -1)) for sign in (1, -1)
    ]
    return np.mean(both, 0) if mirror else both[0]


@pytest.mark.parametrize("mirror", [False, True])
def test_answers_stand_in_the_order_asked_for_and_a_mirrored_input_counts_as_much(mirror):
    asked = np.array([4, 0, 2, 1, 3, 7, 5])
    samples = Numbers()
    machine = Machine(torch.device("cpu"), "fp32")
    model = Formula().train()
    found = probabilities(model, samples, asked, machine, 3, mirror)
    np.testing.assert_allclose(found, by_hand(asked.astype(float), mirror), rtol=1e-6)
    assert (
        samples.read == [[4, 0, 2], [1, 3, 7], [5]]
        and found.dtype == np.float64
        and not model.training
    )


def test_ranks_that_train_unlike_things_are_refused_and_alike_ones_are_not(monkeypatch):
    sent = []
    monkeypatch.setattr(
        inference.distributed, "all_reduce", lambda values, how: sent.append(values.clone())
    )
    machine = Machine(torch.device("cpu"), "fp32", 1, 2)
    for identity, steps in (("a", 3), ("a", 3), ("b", 3), ("a", 4)):
        machine.agree(identity, steps)
    Machine(torch.device("cpu"), "fp32").agree("c", 0)
    assert len(sent) == 4 and torch.equal(sent[0], sent[1])

    found = [sent[1]]

    def largest(values, how):
        assert how == torch.distributed.ReduceOp.MAX
        values.copy_(torch.maximum(values, found[0]))

    monkeypatch.setattr(inference.distributed, "all_reduce", largest)
    machine.agree("a", 3)
    for found[0] in sent[2:]:
        with pytest.raises(
            InputError, match="rank 1 computes in fp32 and stands at step 3, another rank differs"
        ):
            machine.agree("a", 3)


def test_more_processes_than_gpus_are_refused(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 1)
    monkeypatch.setenv("WORLD_SIZE", "2")
    monkeypatch.setenv("LOCAL_RANK", "1")
    with pytest.raises(InputError, match=r"process 1 of this machine finds 1 GPUs"):
        Machine.here("fp32")
