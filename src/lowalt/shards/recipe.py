"""A recipe of a data set: clouds, configuration, version and checksums in one tar of a few megabytes.

    python -m lowalt.shards.recipe pack --run results/default --out default.recipe.tar
    python -m lowalt.shards.recipe unpack default.recipe.tar --out folder

Unpacking makes every sample again and compares each file with its checksum; another version of this package is refused.
Members: recipe.json (version, configuration, published rows of the targets), manifest.sha256, clouds/*.npz.
"""

import argparse
import io
import json
import re
import tarfile
import tempfile
from pathlib import Path

from lowalt import __version__
from lowalt.config.command import run
from lowalt.config.layers import SCHEMA, check, plain
from lowalt.config.schema import check_brought
from lowalt.files.atomic import existing, replacing, sha256, text_of
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.files.yaml_files import load_yaml
from lowalt.shards import manifest
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.shards.remake import CloudFolder

FORMAT = "lowalt-recipe-1"
COVERED = ("clouds", "motion", "shards")
"""Stages whose files are unpacked; echoes and noisy signals stay in memory."""
MEMBER = re.compile(r"recipe\.json|manifest\.sha256|clouds/[^/]+\.npz")
"""Names of a recipe's members."""


def pack(folder: str | Path, path: str | Path) -> int:
    """Write the recipe of a finished run to `path` and return its size in bytes.

    Raises: InputError where the run's configuration, clouds or shards are missing.
    """
    folder = Path(folder)
    config = load_yaml(folder / "config.yaml")
    # Open the data set for its checks: a configuration that makes no data set makes no recipe.
    dataset = Dataset(config, CloudFolder(folder / "clouds"))
    lines = manifest.text(folder).splitlines(keepends=True)
    kept = [line for line in lines if manifest.stage_of(line.partition("  ")[2]) in COVERED]
    if not any("  shards/" in line for line in kept):
        raise InputError(f"{folder}: has no shards, expected the folder of a finished run")
    head = {"format": FORMAT, "lowalt": __version__, "config": plain(config), "published": dataset.published}
    members = {
        # The order of the published rows decides the order of the classes, so keys are not sorted.
        "recipe.json": json.dumps(head, indent=1).encode(),
        "manifest.sha256": "".join(kept).encode(),
        **{f"clouds/{file.name}": file.read_bytes() for file in sorted((folder / "clouds").glob("*.npz"))},
    }
    with replacing(path) as temporary, tarfile.open(temporary, "w", format=tarfile.USTAR_FORMAT) as archive:
        for name, data in members.items():
            info = tarfile.TarInfo(name)
            info.size, info.mode = len(data), 0o444
            archive.addfile(info, io.BytesIO(data))
    return Path(path).stat().st_size


def _extracted(path: Path, folder: Path) -> dict:
    """The recipe's head; its other members are unpacked into `folder`."""
    try:
        # Refuse compression and sparse members: the unpacked files are then never larger than the tar.
        with tarfile.open(existing(path, "recipe"), "r:") as archive:
            for member in archive:
                if not member.isfile() or member.issparse() or not MEMBER.fullmatch(member.name):
                    raise InputError(f"{path}: member {member.name!r} is no plain file of a recipe")
            archive.extractall(folder, filter="data")
        head = json.loads(text_of(folder / "recipe.json", "recipe"))
        found, version = head["format"], head["lowalt"]
    except (tarfile.TarError, OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"{path}: not a recipe ({error})") from error
    if found != FORMAT:
        raise InputError(f"{path}: format {found!r}, expected {FORMAT!r}")
    if version != __version__:
        raise InputError(f"{path}: written by lowalt {version}, expected {__version__}: install that version")
    check_brought("recipe", head, path)
    check(head["config"], shipped(SCHEMA))
    return head


def unpack(path: str | Path, out: str | Path) -> list[str]:
    """Make the whole data set of a recipe below `out`; return one line for each file that differs from its checksum.

    Raises: InputError where the file is no recipe or of another version, or a cloud of it is damaged.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        head = _extracted(Path(path), folder)
        expected = manifest.read(folder / "manifest.sha256")
        for file, digest in expected.items():
            if file.startswith("clouds/") and sha256(existing(folder / file, "cloud of the recipe")) != digest:
                raise InputError(f"{path}: {file} is damaged (SHA-256 differs)")
        dataset = Dataset(head["config"], CloudFolder(folder / "clouds"), published=head["published"])
        write_run(dataset, out, head["config"]["shards"]["kind"])
        return manifest.faults(folder / "manifest.sha256", out, ("echo", "noise", "tiles"))


def main(arguments: list[str]) -> None:
    """Pack a finished run into a recipe, or make the whole data set of a recipe and compare every file."""
    options = argparse.ArgumentParser(prog="python -m lowalt.shards.recipe", description=main.__doc__)
    commands = options.add_subparsers(dest="command", required=True)
    packing = commands.add_parser("pack", help="write the recipe of a finished run", description=pack.__doc__)
    packing.add_argument("--run", required=True, help="folder of the run, such as results/default")
    packing.add_argument("--out", required=True, help="recipe to write (.tar)")
    unpacking = commands.add_parser("unpack", help="make the data set of a recipe", description=unpack.__doc__)
    unpacking.add_argument("recipe", help="recipe (.tar)")
    unpacking.add_argument("--out", required=True, help="folder to write into")
    given = options.parse_args(arguments)
    if given.command == "pack":
        print(f"{given.out}: {pack(given.run, given.out) / 1e6:.1f} MB")
        return
    lines = unpack(given.recipe, given.out)
    for line in lines:
        print(line)
    if lines:
        raise SystemExit(1)
    print(f"{given.out}: equal to the recipe's checksums in every byte")


if __name__ == "__main__":
    run(main)
