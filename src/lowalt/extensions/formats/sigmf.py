"""Signals as SigMF recordings: one per station, an annotation for each sample.

The samples stand one after the other.

`python -m lowalt.extensions.formats.sigmf --index INDEX --out FOLDER`. The sample rate is the
symbol
rate: the signals are the echoes' values symbol by symbol. Facts for
which the standard has no field are in the namespace `lowalt`.
Source: SigMF specification 1.2 (core namespace, annotations).
"""

import argparse
import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lowalt import __version__
from lowalt.config.command import run
from lowalt.config.network import Network
from lowalt.config.splits import FOLDS
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.shards.plan import GROUPS
from lowalt.shards.read import ShardSet

KEPT = ("key", "category", "subtype", "group", "model", "fold", "snr_db", "noise", "motion")
"""Fields of a sample's record that go into its annotation."""


def metadata(shards: ShardSet, network: Network, number: int, digest: str) -> dict:
    """Return the SigMF metadata of one station's recording of all samples.

    number: the station's number in the network; digest: SHA-512 of the data file in hexadecimal.
    """
    station = network.stations[number]
    annotations = []
    for sample in range(len(shards)):
        entry = shards.record(sample)
        annotation = {
            "core:sample_start": sample * network.symbols,
            "core:sample_count": network.symbols,
            "core:label": entry["category"],
            "core:comment": f"{entry['subtype']}, motion model {entry['model']}",
        }
        for name in KEPT:
            # JSON has no infinity: without noise the annotation names no SNR.
            if name != "snr_db" or entry["noise"]:
                annotation[f"lowalt:{name}"] = entry[name]
        annotation["lowalt:geometry"] = entry["geometry"][station.name]
        annotations.append(annotation)
    return {
        "global": {
            "core:datatype": "cf32_le",
            "core:sample_rate": 1 / network.symbol_interval_s,
            "core:version": "1.2.0",
            "core:sha512": digest,
            "core:author": "lowalt",
            "core:recorder": f"lowalt {__version__}",
            "core:description": f"Simulated symbol-domain echoes at base station {station.name}",
            "core:extensions": [{"name": "lowalt", "version": __version__, "optional": True}],
            "lowalt:station": station.name,
            "lowalt:position_m": list(station.position_m),
            "lowalt:normal_rad": station.normal_rad,
        },
        "captures": [{"core:sample_start": 0, "core:frequency": station.frequency_hz}],
        "annotations": annotations,
    }


def export(shards: ShardSet, folder: str | Path) -> list[Path]:
    """Write {station}.sigmf-data and {station}.sigmf-meta of each station into `folder`.

    Return the paths of the metadata.
    Raises: InputError where the shards hold images, or naming a damaged sample.
    """
    if shards.kind == "image":
        raise InputError(
            f"{shards.index_path}: shards of kind 'image', expected 'signal', 'recipe' or 'cube'"
        )
    network = Network.from_settings(shards.index["render"]["network"])
    written = []
    for number, station in enumerate(network.stations):
        data = Path(folder) / f"{station.name}.sigmf-data"
        digest = hashlib.sha512()
        with replacing(data) as temporary, temporary.open("wb") as file:
            for sample in range(len(shards)):
                span = np.ascontiguousarray(shards.signal(sample)[number], "<c8").tobytes()
                digest.update(span)
                file.write(span)
        written.append(data.with_suffix(".sigmf-meta"))
        with replacing(written[-1]) as temporary:
            about = metadata(shards, network, number, digest.hexdigest())
            text = json.dumps(about, indent=1, allow_nan=False)
            temporary.write_text(text + "\n")
    return written


def main(arguments: Iterable[str]) -> None:
    """Export the signals of a data set as SigMF recordings, one per station."""
    line = argparse.ArgumentParser(
        prog="python -m lowalt.extensions.formats.sigmf", description=main.__doc__
    )
    line.add_argument("--index", required=True, help="index of a data set of signals")
    line.add_argument("--groups", nargs="+", default=list(GROUPS), choices=GROUPS)
    line.add_argument("--folds", nargs="+", default=list(FOLDS), choices=FOLDS)
    line.add_argument("--out", required=True, help="folder to write into")
    options = line.parse_args(arguments)
    export(ShardSet(options.index, options.groups, options.folds), options.out)


if __name__ == "__main__":
    run(main)
