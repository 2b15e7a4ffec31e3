"""Write the checksums of finished runs, for a new version of the benchmark.

`python -m lowalt.extensions.benchmark RESULTS` does it.
"""

import argparse

from lowalt.config.command import run, warn_in_one_line
from lowalt.extensions.benchmark import costs, frozen_bytes
from lowalt.extensions.benchmark.definition import REFERENCE


def main(arguments: list[str]) -> None:
    """Write the checksums of all parts and of the samples that a test makes again."""
    line = argparse.ArgumentParser(
        prog="python -m lowalt.extensions.benchmark", description=main.__doc__
    )
    line.add_argument("results", help="folder of the finished runs, such as results")
    line.add_argument("--samples", action="store_true", help="only the samples, which need no run")
    line.add_argument(
        "--out", default=REFERENCE, help=f"folder to write into (default: {REFERENCE})"
    )
    line.add_argument(
        "--costs", action="store_true", help="only the costs of the runs that are there"
    )
    options = line.parse_args(arguments)
    warn_in_one_line()
    if options.costs:
        costs.write(options.results, options.out)
        return
    frozen_bytes.write_samples(options.out)
    if not options.samples:
        frozen_bytes.write(options.results, options.out)


if __name__ == "__main__":
    run(main)
