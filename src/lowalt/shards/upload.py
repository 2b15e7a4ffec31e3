"""Publishing a data set on the Hugging Face hub: `python -m lowalt.shards.upload --index INDEX --repository USER/NAME`.

The token is read from the environment (HF_TOKEN), never from the command line. Every byte is checked first: a damaged
data set is not published.
"""

import argparse
from pathlib import Path
from typing import Any

from lowalt.config.command import run
from lowalt.files import hub_upload
from lowalt.files.errors import InputError
from lowalt.shards.index import load
from lowalt.shards.verify import faults


def published_files(index_path: str | Path) -> list[str]:
    """Return the files of a data set that are published, relative to the index's folder, sorted.

    Raises: InputError naming the first fault where the data set is damaged or has no data card.
    """
    for line in faults(index_path):
        raise InputError(f"{index_path}: {line}, expected an undamaged data set with its data card")
    folder = Path(index_path).parent
    load(index_path)
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def upload(index_path: str | Path, repository: str, client: Any, private: bool = True) -> int:
    """Create the repository where there is none, upload every file of the data set and return their number.

    client: a `huggingface_hub.HfApi` with its token, or an object with the same methods.
    Raises: InputError where the data set is damaged or the repository's name is not USER/NAME.
    """
    hub_upload.check_repository(repository)
    names = published_files(index_path)
    message = f"Data set {load(index_path)['sha256'][:12]}"
    hub_upload.send(client, repository, "dataset", Path(index_path).parent, names, message, private)
    return len(names)


def main(arguments: list[str]) -> None:
    """Check every byte of a data set and upload it with the token in HF_TOKEN."""
    options = argparse.ArgumentParser(prog="python -m lowalt.shards.upload", description=main.__doc__)
    options.add_argument("--index", required=True, help="the data set's index")
    hub_upload.add_options(options, "dataset")
    given = options.parse_args(arguments)
    count = upload(given.index, given.repository, hub_upload.client(), private=not given.public)
    print(f"{given.repository}: {count} files")


if __name__ == "__main__":
    run(main)
