"""Noise: complex white Gaussian noise at set SNRs on the clean symbol-domain signals."""

from lowalt.noise.awgn import add_noise

__all__ = ["add_noise"]
