"""Class probabilities (`lowalt.recognition.inference`) on one rank and on several, by a network that is a formula."""

from types import SimpleNamespace

import numpy as np
import pytest
import torch
from torch import nn

from lowalt.files.errors import InputError
from lowalt.recognition import inference
from lowalt.recognition.inference import Machine, probabilities
from lowalt.recognition.matrix_products import MatrixProduct


class Formula(nn.Module):
    """Logits of three classes: the sample's number, its square over ten, and nought; mirrored, its sign is turned."""

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
    both = [softmax(np.stack([sign * numbers, numbers**2 / 10, 0.0 * numbers], -1)) for sign in (1, -1)]
    return np.mean(both, 0) if mirror else both[0]


@pytest.mark.parametrize("mirror", [False, True])
def test_answers_stand_in_the_order_asked_for_and_a_mirrored_input_counts_as_much(mirror):
    asked, samples = np.array([4, 0, 2, 1, 3, 7, 5]), Numbers()
    machine = Machine(torch.device("cpu"), "fp32")
    model = Formula().train()
    found = probabilities(model, samples, asked, machine, 3, mirror)
    np.testing.assert_allclose(found, by_hand(asked.astype(float), mirror), rtol=1e-6)
    assert samples.read == [[4, 0, 2], [1, 3, 7], [5]] and found.dtype == np.float64 and not model.training


def test_ranks_take_whole_batches_in_turn_and_their_sum_is_the_answer_of_one(monkeypatch):
    asked, parts = np.arange(10), []
    monkeypatch.setattr(inference.distributed, "all_reduce", lambda values: parts.append(values.clone()))
    for rank, read in ((0, [[0, 1, 2], [6, 7, 8]]), (1, [[3, 4, 5], [9]])):
        samples = Numbers()
        probabilities(Formula(), samples, asked, Machine(torch.device("cpu"), "fp32", rank, 2), 3)
        assert samples.read == read
    np.testing.assert_allclose(sum(parts), by_hand(asked.astype(float), False), rtol=1e-6)
    assert not ((parts[0] != 0) & (parts[1] != 0)).any()


def test_ranks_that_train_unlike_things_are_refused_and_alike_ones_are_not(monkeypatch):
    sent = []
    monkeypatch.setattr(inference.distributed, "all_reduce", lambda values, how: sent.append(values.clone()))
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
        with pytest.raises(InputError, match="rank 1 computes in fp32 and stands at step 3, another rank differs"):
            machine.agree("a", 3)


def test_a_process_without_gpu_is_the_rank_that_its_environment_says(monkeypatch):
    begun = []
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(inference, "distributed", SimpleNamespace(
        is_initialized=lambda: bool(begun), init_process_group=begun.append))  # fmt: skip
    for name in ("WORLD_SIZE", "LOCAL_RANK", "RANK"):
        monkeypatch.delenv(name, raising=False)
    assert Machine.here("fp32") == Machine(torch.device("cpu"), "fp32", 0, 1) and not begun
    monkeypatch.setenv("WORLD_SIZE", "4")
    monkeypatch.setenv("RANK", "3")
    for _ in range(2):
        assert Machine.here("bf16") == Machine(torch.device("cpu"), "bf16", 3, 4) and begun == ["gloo"]
    alone, many = Machine(torch.device("cpu"), "fp32"), Machine(torch.device("cpu"), "bf16", 0, 2)
    monkeypatch.setattr(nn.parallel, "DistributedDataParallel", lambda model: ("wrapped", model))
    assert alone.parallel(1) == 1 and many.parallel(1) == ("wrapped", 1)
    with alone.autocast():
        assert not torch.is_autocast_enabled("cpu")
    with many.autocast():
        assert torch.is_autocast_enabled("cpu") and torch.get_autocast_dtype("cpu") == torch.bfloat16


def test_evaluation_without_workers_reads_in_its_own_process():
    block = {"batch": 4, "threads": 1, "precision": "fp32", "mirror": True}
    assert inference.evaluation(block) == [4, 1, "fp32", True, 0]
    assert inference.evaluation(block | {"workers": 3})[-1] == 3


def test_a_model_in_fp32_on_a_processor_computes_the_same_as_matrix_products():
    torch.manual_seed(2)
    images = torch.randn(3, 4, 3, 3)
    model = nn.Sequential(nn.Conv2d(4, 6, 1), nn.ReLU(), nn.Conv2d(6, 5, 3))
    expected = model(images)
    kept = Machine(torch.device("cpu"), "bf16").placed(model)
    assert [type(layer) for layer in kept] == [nn.Conv2d, nn.ReLU, nn.Conv2d]
    placed = Machine(torch.device("cpu"), "fp32").placed(model)
    assert [type(layer) for layer in placed] == [MatrixProduct, nn.ReLU, MatrixProduct]
    assert placed[0].weight.is_contiguous(memory_format=torch.channels_last)
    torch.testing.assert_close(placed(images), expected, rtol=1e-5, atol=1e-6)


def test_more_processes_than_gpus_are_refused(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 1)
    monkeypatch.setenv("WORLD_SIZE", "2")
    monkeypatch.setenv("LOCAL_RANK", "1")
    with pytest.raises(InputError, match=r"process 1 of this machine finds 1 GPUs"):
        Machine.here("fp32")
