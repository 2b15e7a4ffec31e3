"""The size of a chunk for shards of a wanted size, computed before anything is made."""

import argparse

from lowalt.config.command import run
from lowalt.config.layers import load_yaml
from lowalt.config.network import Network
from lowalt.config.plan import snrs_of
from lowalt.config.splits import FOLDS
from lowalt.files.errors import InputError
from lowalt.shards.tar import BLOCK

RECORD_BYTES = 2048
"""Space of a sample's JSON record in the tar, padded."""
IMAGE_BYTES = 300_000
"""Space allowed for a sample's tile; the measured averages are in results/benchmarks/images.csv."""


def sample_bytes(kind: str, stations: int, symbols: int, snrs: int = 1) -> int:
    """Return the approximate bytes of a sample in a shard of a kind, padding included.

    kind: "image", "signal" or "recipe"; snrs: SNRs of each motion model, which share one echo in a recipe shard.
    """
    data = IMAGE_BYTES if kind == "image" else 128 + 8 * stations * symbols
    return (2 * BLOCK + RECORD_BYTES + data + -data % BLOCK) // (snrs if kind == "recipe" else 1)


def models_per_chunk(target_bytes: float, sample: int, subtypes: int, snrs: int, split: dict) -> int:
    """Return the motion models of each subtype in a chunk for which its largest shard comes closest to a target size.

    sample: bytes of a sample; subtypes, snrs: how many of each a chunk has; split: the shares of the folds. The result
    is a multiple of the split's block, as chunks must be, and at least one block.
    Raises: InputError where the target is not positive.
    """
    if not target_bytes > 0:
        raise InputError(f"shards: target size {target_bytes!r}, expected a positive number of bytes")
    shares = [split[name] for name in FOLDS]
    largest_of_block = sample * subtypes * snrs * max(shares)
    return sum(shares) * max(1, round(target_bytes / largest_of_block))


def main(arguments: list[str]) -> None:
    """Print the motion.models_per_chunk for which a run's largest shards come closest to a target size."""
    options = argparse.ArgumentParser(prog="python -m lowalt.shards.size", description=main.__doc__)
    options.add_argument("--config", required=True, help="the run's merged configuration (.yaml)")
    options.add_argument("--subtypes", type=int, required=True, help="subtypes of the larger group")
    options.add_argument(
        "--target-mb", type=float, default=1000, help="wanted size of the train shards (default 1000 MB)"
    )
    given = options.parse_args(arguments)
    config = load_yaml(given.config)
    network = Network.from_settings(config["network"])
    snrs = len(snrs_of(config))
    sample = sample_bytes(config["shards"]["kind"], len(network.stations), network.symbols, snrs)
    print(models_per_chunk(1e6 * given.target_mb, sample, given.subtypes, snrs, config["split"]))


if __name__ == "__main__":
    run(main)
