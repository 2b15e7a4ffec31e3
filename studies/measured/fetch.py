"""The measured recordings from their public addresses, each with its pinned SHA-256.

    python studies/measured/fetch.py --out FOLDER [--sources studies/measured/further.yaml]
    [--check]

With --check nothing is fetched: the files that FOLDER lacks, or holds with other content, are
named. Only the vehicle recordings carry a licence (MIT, University of Cape Town 2025). The makers
of the others state none: fetch those for your own comparison and do not pass them on. FOLDER is
then what `make measured INPUTS=FOLDER` takes.
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


RAW = "https://raw.githubusercontent.com"
"""Where a file of a repository at a commit is read."""


def fetch(name: str, address: str, pinned: str, folder: Path) -> bool:
    """Download the file `name` (SET/FILE) into `folder` from its address.

    Return False where it already was there. Nothing is kept unless its SHA-256 is the pinned one.
    Raises: InputError naming the address and what failed there, the download or the checksum.
    """
    target = folder / name
    if target.is_file() and sha256(target) == pinned:
        return False
    download(address, target, pinned)
    return True


def addresses(sources: dict) -> dict[str, tuple[str, str]]:
    """Return SET/FILE -> (its address, SHA-256) of a sources file: sets, each a list of
    `repository`, `commit`, `folder` and `files`."""
    places = {}
    for name, folders in sources.items():
        for entry in folders:
            for file, pinned in entry["files"].items():
                path = urllib.parse.quote(f"{entry['folder']}/{file}".lstrip("/"))
                places[f"{name}/{file}"] = (
                    f"{RAW}/{entry['repository']}/{entry['commit']}/{path}",
                    pinned,
                )
    return places


def lacking(wanted: dict[str, tuple[str, str]], folder: Path) -> list[str]:
    """Return a line for every file of `addresses` that is not in `folder`, or is there with another
    SHA-256.
    """
    lines = []
    for name, (address, pinned) in wanted.items():
        target = folder / name
        if not target.is_file():
            lines.append(f"{name}: missing, see {address}")
        elif sha256(target) != pinned:
            lines.append(f"{name}: SHA-256 is {sha256(target)}, expected {pinned}")
    return lines


def main(arguments: list[str]) -> None:
    """Fetch all recordings, or check a copy of them.

    Raises: as `fetch_each`; InputError with the count of files that a copy lacks.
    """
    line = argparse.ArgumentParser("fetch.py", description=__doc__.splitlines()[0])
    line.add_argument("--out", required=True, type=Path, help="folder of the measured sets")
    line.add_argument(
        "--sources", type=Path, default=SOURCES, help="addresses and checksums (.yaml)"
    )
    line.add_argument(
        "--check", action="store_true", help="fetch nothing, name the files that the folder lacks"
    )
    options = line.parse_args(arguments)
    wanted = addresses(load_yaml(options.sources, "sources of recordings"))
    if not options.check:
        return fetch_each(wanted, lambda name: fetch(name, *wanted[name], options.out))
    lines = lacking(wanted, options.out)
    print(
        "\n".join(
            lines or [f"{options.out}: all {len(wanted)} files of {options.sources.name} are there"]
        )
    )
    if lines:
        raise InputError(
            f"{options.out}: lacks {len(lines)} of {len(wanted)} files of {options.sources.name}"
        )


if __name__ == "__main__":
    run(main)
