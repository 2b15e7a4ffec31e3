"""The manifest of a run: the SHA-256 of every file that configuration and version determine.

One line per file in the format of `sha256sum`, in the order of the stages. The comparison of a
rebuilt run names the first stage that differs, because all later stages then differ too. In a
manifest by groups a line stands for all files of a pattern, such as `shards/seen-train-*.tar`; its
checksum is that of their lines in a manifest by files, so that `sha256sum shards/seen-train-*.tar |
sha256sum` gives it too.
"""

import argparse
import hashlib
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.atomic import sha256, text_of, write_file
from lowalt.files.errors import InputError

STAGES = {
    "clouds": ("clouds/*.npz",),
    "motion": ("motion/*.csv",),
    "echo": ("echo/*/*.npy",),
    "noise": ("noisy/*.npy",),
    "tiles": ("tiles/*.npz",),
    "shards": ("shards/*.tar", "shards/*.npz", "shards/index.json"),
}
"""Stages in the order of the pipeline, and the files that each leaves in a run's folder.

Tiles are deleted once they are in shards.
"""


def files(folder: str | Path) -> Iterator[str]:
    """Yield the paths of all covered files of a run, relative to its folder, stage by stage."""
    folder = Path(folder)
    for patterns in STAGES.values():
        for pattern in patterns:
            yield from sorted(path.relative_to(folder).as_posix() for path in folder.glob(pattern))


def _line(folder: str | Path, name: str) -> str:
    """Return the line of a file in a run's folder."""
    return f"{sha256(Path(folder) / name)}  {name}\n"


def text(folder: str | Path) -> str:
    """Return the manifest of a run's folder.

    Raises: InputError where the folder has none of the covered files.
    """
    lines = [_line(folder, name) for name in files(folder)]
    if not lines:
        raise InputError(
            f"{folder}: no cloud, motion table, signal or shard, expected the folder of a run"
        )
    return "".join(lines)


def _checksum(name: str, lines: list[str]) -> str:
    """Return what a manifest holds for a file or a pattern.

    lines: of its files in a manifest by files.
    """
    if "*" in name:
        return hashlib.sha256("".join(lines).encode()).hexdigest()
    return lines[0].partition(" ")[0]


def by_groups(text: str) -> str:
    """Return a manifest with one line for each group of files.

    The names of a group differ in the number of the chunk alone; the clouds are one group.
    """
    groups = defaultdict(list)
    for line in text.splitlines(keepends=True):
        name = line.split("  ", 1)[1].strip()
        pattern = re.sub(r"-\d{5}", "-*", name)
        if stage_of(name) == "clouds":
            pattern = "clouds/*.npz"
        groups[pattern].append(line)
    return "".join(f"{_checksum(name, lines)}  {name}\n" for name, lines in groups.items())


def read(path: str | Path) -> dict[str, str]:
    """Return the checksums of a manifest by file or pattern of files.

    Raises: InputError naming the file and the line that is no checksum and name, or whose file no
    stage makes.
    """
    result = {}
    for number, line in enumerate(text_of(path, "manifest").splitlines(), start=1):
        digest, _, name = line.partition("  ")
        if not re.fullmatch("[0-9a-f]{64}", digest) or not name:
            raise InputError(
                f"{path}, line {number}: {line!r}, expected a SHA-256, two spaces and a file"
            )
        if stage_of(name) not in STAGES:
            # No stage would compare such a file, so a difference would go unnoticed.
            raise InputError(
                f"{path}, line {number}: {name!r}, expected a file of one of {tuple(STAGES)}"
            )
        result[name] = digest
    return result


def stage_of(name: str) -> str:
    """Return the stage that makes a file of a manifest."""
    folder = name.partition("/")[0]
    if folder == "noisy":
        return "noise"
    return folder


def faults(
    path: str | Path, folder: str | Path, temporary: tuple[str, ...] = ("tiles",)
) -> list[str]:
    """Return one line for each file that is missing, differs or is not in the manifest.

    The lines are in the order of the stages. Files of the stages in `temporary` may be missing. An
    empty list means that all bytes are equal.
    Raises: InputError where the manifest cannot be read.
    """
    expected = read(path)
    present = list(files(folder))
    lines = []
    for stage in STAGES:
        unnamed = [name for name in present if stage_of(name) == stage]
        for name in [name for name in expected if stage_of(name) == stage]:
            found = [file for file in unnamed if fnmatchcase(file, name)]
            unnamed = [file for file in unnamed if file not in found]
            if not found:
                if stage not in temporary:
                    lines.append(f"{stage}: {name} is missing")
            elif _checksum(name, [_line(folder, file) for file in found]) != expected[name]:
                lines.append(f"{stage}: {name} differs")
        if stage not in temporary:
            lines += [f"{stage}: {name} is not in the manifest" for name in sorted(unnamed)]
    return lines


def main(arguments: list[str]) -> None:
    """Write the manifest of a run, or compare a run with one; status 1 where a byte differs."""
    line = argparse.ArgumentParser(
        prog="python -m lowalt.shards.manifest", description=main.__doc__
    )
    line.add_argument("command", choices=("write", "check"))
    line.add_argument("--run", required=True, help="folder of the run, such as results/default")
    line.add_argument(
        "--manifest", required=True, help="manifest, such as results/reference/default.sha256"
    )
    line.add_argument(
        "--by-groups", action="store_true", help="write one line for each group of files"
    )
    line.add_argument(
        "--without", nargs="*", default=[], choices=list(STAGES), help="stages that left no files"
    )
    options = line.parse_args(arguments)
    if options.command == "write":
        found = text(options.run)
        if options.by_groups:
            found = by_groups(found)
        write_file(options.manifest, found)
        return
    lines = faults(options.manifest, options.run, ("tiles", *options.without))
    for fault in lines:
        print(fault)
    if lines:
        print(f"first stage that differs: {lines[0].partition(':')[0]}", file=sys.stderr)
        raise SystemExit(1)
    expected = read(options.manifest)
    unit = "groups" if any("*" in name for name in expected) else "files"
    print(f"{options.run}: all {len(expected)} {unit} are equal to {options.manifest}")


if __name__ == "__main__":
    run(main)
