"""The general kernel: reference range, terms of every point, sums over points. It serves any geometry and any array."""
