"""The measured recordings from their public addresses, each with its pinned SHA-256.

    python studies/measured/fetch.py --out FOLDER [--sources studies/measured/further.yaml]

Only the vehicle recordings carry a licence (MIT, University of Cape Town 2025). The makers of the others state none:
fetch those for your own comparison and do not pass them on. FOLDER is then what `make measured INPUTS=FOLDER` takes.
"""

import argparse
import urllib.parse
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.atomic import sha256
from lowalt.files.errors import InputError
from lowalt.files.pinned_download import download, fetch_each
from lowalt.files.yaml_files import load_yaml

SOURCES = Path(__file__).with_name("sources.yaml")


def fetch(name: str, places: list[str], pinned: str, folder: Path) -> bool:
    """Download the file `name` (SET/FILE) into `folder` from the first of its addresses `places` that has it.

    Return False where it already was there. Nothing is kept unless its SHA-256 is the pinned one.
    Raises: InputError naming the file, every address and what failed there, a download or the checksum.
    """
    target = folder / name
    if target.is_file() and sha256(target) == pinned:
        return False
    failures = []
    for address in places:
        try:
            download(address, target, pinned)
            return True
        except InputError as error:
            failures.append(str(error))
    raise InputError(f"{name}: {'; '.join(failures)}")


def addresses(sources: dict) -> dict[str, tuple[list[str], str]]:
    """Return SET/FILE -> (its addresses, SHA-256) of a sources file: sets, each a list of `addresses` and `files`."""
    places = {}
    for name, folders in sources.items():
        for entry in folders:
            for file, pinned in entry["files"].items():
                quoted = [f"{base}/{urllib.parse.quote(file)}" for base in entry["addresses"]]
                places[f"{name}/{file}"] = quoted, pinned
    return places


def main(arguments: list[str]) -> None:
    """Fetch all recordings.

    Raises: as `fetch_each`.
    """
    line = argparse.ArgumentParser("fetch.py", description=__doc__.splitlines()[0])
    line.add_argument("--out", required=True, type=Path, help="folder of the measured sets")
    line.add_argument("--sources", type=Path, default=SOURCES, help="addresses and checksums (.yaml)")
    options = line.parse_args(arguments)
    wanted = addresses(load_yaml(options.sources, "sources of recordings"))
    fetch_each(wanted, lambda name: fetch(name, *wanted[name], options.out))


if __name__ == "__main__":
    run(main)
