"""The moving average of weights: by its formula, and bit for bit that of timm, which lists weights every time."""

import torch
from timm.utils import ModelEmaV3
from torch import nn

from lowalt.recognition.moving_average import MovingAverage
from lowalt.recognition.recipe import averaging


def test_averages_follow_the_formula_and_timm_bit_for_bit():
    torch.manual_seed(3)
    model = nn.Sequential(nn.Linear(3, 4), nn.BatchNorm1d(4))
    ours, timms = MovingAverage(model, 0.9), ModelEmaV3(model, decay=0.9)
    weights, means, decay = [], [], 0.9
    for step in range(1, 8):
        model(torch.randn(5, 3)).sum().backward()
        with torch.no_grad():
            for value in model.parameters():
                value -= 0.1 * torch.randn_like(value)
        weights.append(model[0].weight.detach().double().clone())
        means.append(model[1].running_mean.double().clone())
        for average in (ours, timms):
            average.decay = averaging(decay, step)
            average.update(model)
        shares = torch.tensor([decay**age for age in range(step - 1, -1, -1)], dtype=torch.float64)
        shares /= shares.sum()
        for seen, found in ((weights, ours.module[0].weight), (means, ours.module[1].running_mean)):
            expected = sum(share * value for share, value in zip(shares, seen, strict=True))
            torch.testing.assert_close(found.double(), expected, rtol=1e-5, atol=1e-6)
        assert ours.module[1].num_batches_tracked == step
        state = timms.module.state_dict()
        assert all(torch.equal(value, state[name]) for name, value in ours.module.state_dict().items())


def test_an_average_goes_on_after_its_own_and_the_models_weights_are_loaded():
    model = nn.Linear(2, 2)
    average = MovingAverage(model, 0.5)
    model.load_state_dict({"weight": torch.full((2, 2), 3.0), "bias": torch.zeros(2)})
    average.module.load_state_dict({"weight": torch.full((2, 2), 1.0), "bias": torch.zeros(2)})
    average.update(model)
    assert torch.equal(average.module.weight, torch.full((2, 2), 2.0))
