"""Validator of cloud files: one line a file, what it holds or what is wrong with it."""

import argparse
import sys
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError
from lowalt.targets.cloud import Cloud, read


def summary(cloud: Cloud) -> str:
    """Return one line on a cloud: subtype, source, points and the published count, extent, parts, normals."""
    kinds = [f"{len(cloud.parts_of(kind))} {kind}" for kind in dict.fromkeys(cloud.kinds)]
    extent = " x ".join(f"{value:.3f}" for value in np.ptp(cloud.points, axis=0))
    normals = np.isfinite(cloud.normals).all(1).mean()
    loop = cloud.record.get("loop_mismatch_m")
    closes = f"cycle closes to {loop:.3f} m, " if loop is not None else ""
    doubts = "".join(f", warning: {text}" for text in cloud.record.get("warnings", []))
    published = cloud.record.get("published", {}).get("points_in_published_cloud_approx", "unknown")
    return (
        f"{cloud.subtype} ({cloud.category}, {cloud.record['source']}): {len(cloud.points)} points "
        f"(published: {published}), {extent} m, "
        f"{', '.join(kinds)}, {closes}normals on {normals:.0%}, checksum {cloud.record['checksum'][:12]}{doubts}"
    )


def main(arguments: list[str]) -> int:
    """Print a line a file and return the number of files that break the contract."""
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.validate", description=__doc__)
    line.add_argument("files", nargs="+", type=Path, help="cloud files (.npz)")
    wrong = 0
    for path in line.parse_args(arguments).files:
        try:
            print(f"{path}: {summary(read(path))}")
        except InputError as error:
            wrong += 1
            print(f"wrong: {error}")
    return wrong


if __name__ == "__main__":
    raise SystemExit(min(main(sys.argv[1:]), 1))
