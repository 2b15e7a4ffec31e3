"""Downloads the CMU recordings that `config/targets/real.yaml` and the tests use.

They come from their official addresses.

"The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with
funding from NSF EIA-0196217." It is free for use in research and products, but must not be resold,
even in converted form. Run `python -m lowalt.targets.download --out FOLDER`; FOLDER is then what
LOWALT_INPUTS names.
"""

import argparse
import hashlib
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.errors import InputError
from lowalt.files.pinned_download import download, fetch_each
from lowalt.files.yaml_files import load_yaml

OFFICIAL = "http://mocap.cs.cmu.edu/subjects"

SHA256 = load_yaml(Path(__file__).with_name("cmu_recordings.yaml"))
"""Checksum of each file by subject and name."""

PINNED_BYTES = {"07/07_12.amc": 187_672}
"""Number of bytes that are pinned of a file.

The known copy of 07_12.amc ends within its last frame, frame 245.
"""


def checksum(name: str, path: Path) -> str:
    """Return the SHA-256 (64 hexadecimal digits) of a recording's file.

    It is that of the file as it is pinned: line ends as LF, and only the bytes that are pinned.
    """
    content = path.read_bytes().replace(b"\r\n", b"\n")
    return hashlib.sha256(content[: PINNED_BYTES.get(name)]).hexdigest()


def fetch(name: str, folder: Path, base: str = OFFICIAL) -> bool:
    """Put the file `name` into `folder`/cmu; return False where it already was there.

    name: SS/SS.asf or SS/SS_TT.amc.

    Nothing is kept unless its SHA-256 is the pinned one.
    Raises: InputError naming the address for an unknown name, a failed download or a wrong
    checksum.
    """
    if name not in SHA256:
        raise InputError(f"{name}: no pinned checksum, expected one of {sorted(SHA256)}")
    target = folder / "cmu" / name
    if target.is_file() and checksum(name, target) == SHA256[name]:
        return False
    download(f"{base}/{name}", target, SHA256[name], lambda path: checksum(name, path))
    return True


def main(arguments: list[str]) -> None:
    """Fetch the named files, all by default.

    Raises: as `fetch_each`.
    """
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.download", description=__doc__)
    line.add_argument(
        "--out", required=True, type=Path, help="folder of inputs; files go to its cmu/"
    )
    line.add_argument("--base", default=OFFICIAL, help="address of the folder of subjects")
    line.add_argument("names", nargs="*", help="SS/SS.asf or SS/SS_TT.amc; all by default")
    options = line.parse_args(arguments)
    fetch_each(options.names or SHA256, lambda name: fetch(name, options.out, options.base))


if __name__ == "__main__":
    run(main)
