"""The CMU recordings that `config/targets/real.yaml` and the tests use, from their official addresses.

"The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding from NSF
EIA-0196217." It is free for use in research and products, but must not be resold, even in converted form.
Run `python -m lowalt.targets.download --out FOLDER`; FOLDER is then what LOWALT_INPUTS names.
"""

import argparse
import hashlib
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.download import download, fetch_each
from lowalt.files.errors import InputError

OFFICIAL = "http://mocap.cs.cmu.edu/subjects"

SHA256 = {
    "02/02.asf": "c50c9cf21fa50dcea0b597e8caf5a2191975cd20999935cc50ab60d44382de9b",
    "02/02_01.amc": "e196f67e5cee0bb575e2ed105082231166a13f81f6ff7b460f6078ed66c8e43a",
    "02/02_02.amc": "c0905969083149ff73b52a26d2121c889081a6b19aa743173dd1d575e31ec697",
    "02/02_03.amc": "a79e7127adfefb15566093a02d3e030cb67cd6c9e9773be95cc26c66b908aad0",
    "05/05.asf": "a4c6127051f30c90b758ccb81f471b7375fc15b92d82ba6bf3e0d2e2d224dd90",
    "05/05_01.amc": "7e2270ccdbbe313861cd38d957a02ee1d90561589e0745cc713230d4558f3fe7",
    "07/07.asf": "f1fbd8abcd9073d24189d5f33b7220974b0ac4b5223fabbb0cc07799ec7a93b3",
    "07/07_01.amc": "97cdb8296c5a9a37a2eaca7ce214b9dbaef49016f7e28c22c5b74688fcd8e0e3",
    "07/07_02.amc": "8cd7cbba57ed6675dd647c9427ba6f7b676d514c4e7e4ad6d27c7d10a665df68",
    "07/07_03.amc": "f4a74d4239d54c33ab773079a0759e2a7d61ae15074d2af2e33b4025d7bd44d1",
    "07/07_12.amc": "45bcfde7b24708406d90d53aff7eb1bdd20dcb52fa7979aa0216379042b60746",
    "09/09.asf": "cc3aab1866fe8149dda70fbbee7cfe2d45506ea38bef31122ac97f94505a33ce",
    "09/09_01.amc": "8ce3d9e2b0e12db6650810177f75afc34fa64c8aa79f2fe4bddaec35e7b71ad2",
    "09/09_02.amc": "74f2a66e16e800abd98e1c7894c0bcbdd5b7f0ee80665fc2ebff4c16dfe256c5",
    "09/09_06.amc": "00e5ba506ae51456f75a46037a05e8a1ed60b07d0ae9539f43f2e543044121a3",
    "09/09_07.amc": "5e6b06e6b9f89182edcd8cf41eacb7668385df255f2be5683719a9398c8941fd",
    "09/09_10.amc": "487d4a5a2ba915952d78220ecf6b1cd572cb8a7b06fb59836eae574df2d5c360",
    "35/35.asf": "9b4888836cbd13cdab14a86c53a6b7765ccae48ddc7075d8c5e03ac34bc08364",
    "35/35_01.amc": "efe882ca211915da0c70d7a1ac565660c75e373171f64e199ede283b921850d3",
    "131/131.asf": "0dee16ca41ae3d9363a53b05096e96ae00132ab9a9b7aaa002f986318a4e4dfd",
    "131/131_01.amc": "6abb97090d6ca328ea5b92099f8433bbe2a3892e98f749dd13362f86362125f9",
}
"""SHA-256 of the files this project was made with, by subject and name, with line ends as LF: copies of the database
differ in their line ends."""

PINNED_BYTES = {"07/07_12.amc": 187_672}
"""Number of bytes that are pinned of a file: the known copy of 07_12.amc ends within its last frame, frame 245."""


def checksum(name: str, path: Path) -> str:
    """Return the SHA-256 (64 hexadecimal digits) of a recording's file as it is pinned: line ends as LF, and only the
    bytes that are pinned."""
    content = path.read_bytes().replace(b"\r\n", b"\n")
    return hashlib.sha256(content[: PINNED_BYTES.get(name)]).hexdigest()


def fetch(name: str, folder: Path, base: str = OFFICIAL) -> bool:
    """Put the file `name` (SS/SS.asf or SS/SS_TT.amc) into `folder`/cmu; return False where it already was there.

    Nothing is kept unless its SHA-256 is the pinned one.
    Raises: InputError naming the address for an unknown name, a failed download or a wrong checksum.
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
    line.add_argument("--out", required=True, type=Path, help="folder of inputs; files go to its cmu/")
    line.add_argument("--base", default=OFFICIAL, help="address of the folder of subjects")
    line.add_argument("names", nargs="*", help="SS/SS.asf or SS/SS_TT.amc; all by default")
    options = line.parse_args(arguments)
    fetch_each(options.names or SHA256, lambda name: fetch(name, options.out, options.base))


if __name__ == "__main__":
    run(main)
