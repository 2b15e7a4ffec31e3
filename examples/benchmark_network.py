"""A network of your own for the benchmark: the function that examples/benchmark_network.yaml names.

.venv/bin/lowalt run config/lowalt-40-v1.yaml examples/benchmark_network.yaml trains it, and its
prediction file results/my-network/predictions/unseen/abc-vrp-trp-vt/0.csv is a submission as it
stands.
"""

from torch import nn


def small(size: int) -> nn.Module:
    """Map images (B, 3, size, size) to features (B, 64)."""
    return nn.Sequential(
        nn.Conv2d(3, 32, 3, stride=2, padding=1),
        nn.GELU(),
        nn.Conv2d(32, 64, 3, stride=2, padding=1),
        nn.GELU(),
        nn.AdaptiveAvgPool2d(1),
        nn.Flatten(),
    )
