"""Damaged inputs for every reader of files (`fuzzed_readers`, `fuzzed_extensions`): seeded ways to break a good file,
and the ends allowed.

    PYTHONPATH=src:tests/support:tests/extensions/support python -m fuzzing --count 2000 --out results/benchmarks/fuzz.csv

A reader must accept its good file. A damaged one it may accept or refuse with one `InputError`.
Every other end is a
fault: another exception, a crash of the process, more than LIMIT_S seconds or more than LIMIT_MB of
memory. Where a file has checksums, every second one is damaged behind them: its parts are changed
and sealed again (`fuzzed_seals`). Of a part that is a JSON object, every second time one value is
replaced by one of VALUES.
"""

import argparse
import contextlib
import csv
import hashlib
import importlib.util
import io
import json
import multiprocessing
import os
import re
import resource
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from lowalt.files.errors import LONGEST, InputError

LIMIT_S = 20.0
LIMIT_MB = 2048
COLUMNS = (
    "reader",
    "inputs",
    "accepted",
    "refused",
    "faults",
    "longest_s",
    "largest_mb",
    "first_fault",
)
TOKENS = (
    b"1e400",
    b"-1e400",
    b"nan",
    b"inf",
    b"-0",
    b"0",
    b"9" * 400,
    b"9" * 5000,
    b"\x00",
    b"\xff\xfe",
    b"\xc3\x28",
    b"{",
    b"}",
    b"[",
    b"*a",
    b"&a ",
    b"!!python/object/apply:os.system ",
    b"../",
    b"/etc/passwd",
    b"$(id)",
    b"; rm",
    b"\r\n",
    b"null",
    b"true",
    b"2001-99-99",
    b"\xc2\xb2",
    b"\xd9\xa1",
    b"1_000",
    b"0x10",
    b"?",
    b": ",
)
"""What is written over a number or word of a text."""
NUMBERS = (
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x80",
    b"\x00" * 8,
    b"\xff" * 8,
    b"\xff" * 7 + b"\x7f",
)
"""What is written over a number of a binary file."""


VALUES = (
    b"NaN",
    b"Infinity",
    b"-Infinity",
    b".nan",
    b".inf",
    b"-.inf",
    b"1e400",
    b"-1",
    b"9" * 400,
    b"9" * 5000,
    b"[" * 100_000 + b"]" * 100_000,
    b'{"a":' * 300 + b"1" + b"}" * 300,
    b'"' + b"x" * 100_000 + b'"',
    b"{}",
    b"[]",
    b"null",
    b"true",
    b'""',
    b'"../x"',
    b'"/etc/passwd"',
    b'"a.py:f"',
    b'"\\u0000"',
)
"""What a value of a JSON object is replaced by: numbers that are none, huge and deeply nested
values, other types.
"""


def revalued(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a JSON object with one of its values, at any depth, replaced by one of VALUES."""
    whole = json.loads(data)
    places = [*_places(whole)]
    block, key = places[int(rng.integers(len(places)))]
    block[key] = "the value"
    return (
        json.dumps(whole)
        .encode()
        .replace(b'"the value"', VALUES[int(rng.integers(len(VALUES)))], 1)
    )


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every block of nested mappings and lists with each of its keys."""
    for key, item in (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    ):
        yield value, key
        yield from _places(item)


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """Return `data` with one to four seeded changes: bytes turned, cut out, doubled or replaced."""
    for _ in range(int(rng.integers(1, 5))):
        if not data:
            return data
        first = int(rng.integers(0, len(data)))
        last = min(len(data), first + int(2 ** rng.uniform(0, 12)))
        way = int(rng.integers(0, 6))
        if way == 0:
            turned = bytes([data[first] ^ (1 << int(rng.integers(0, 8)))])
            data = data[:first] + turned + data[first + 1 :]
        elif way == 1:
            data = data[:first] if rng.random() < 0.3 else data[:first] + data[last:]
        elif way == 2:
            data = data[:last] + data[first:]
        elif way == 3:
            data = data[:first] + rng.bytes(last - first) + data[last:]
        elif way == 4:
            number = NUMBERS[int(rng.integers(0, len(NUMBERS)))]
            data = data[:first] + number + data[first + len(number) :]
        else:
            words = [*_words(data)]
            start, end = words[int(rng.integers(0, len(words)))] if words else (first, last)
            data = data[:start] + TOKENS[int(rng.integers(0, len(TOKENS)))] + data[end:]
    return data


def _words(data: bytes) -> list[tuple[int, int]]:
    """Places of up to 4000 words and numbers at the start of a file."""
    return [found.span() for found in re.finditer(rb"[\w.+-]+", data[:40000])][:4000]


class Reader:
    """One reader of files: its name, a good file's name and bytes, and the function that reads a
    path.

    share: of the damaged files of a run; a reader that starts a process for each file gets fewer.
    seal: how files with checksums are taken apart and sealed again.
    """

    def __init__(
        self,
        name: str,
        file: str,
        data: bytes,
        read: Callable[[Path], object],
        share: float = 1.0,
        seal: Any = None,
    ) -> None:
        self.name = name
        self.file = file
        self.data = data
        self.read = read
        self.share = share
        self.seal = seal

    def damaged(self, rng: np.random.Generator, sealed: bool) -> bytes:
        """The good file with seeded damage: `sealed` in one of its parts, under right checksums,
        else anywhere.
        """
        if not (sealed and self.seal):
            return mutated(self.data, rng)
        parts = self.seal.opened(self.data)
        name = list(parts)[int(rng.integers(len(parts)))]
        change = revalued if parts[name].startswith(b"{") and rng.random() < 0.5 else mutated
        return self.seal.closed(parts | {name: change(parts[name], rng)})

    def outcome(self, data: bytes, folder: Path) -> str:
        """Return "accepted", "refused" or the fault that reading these bytes ends with."""
        path = folder / self.file
        path.write_bytes(data)
        try:
            with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
                warnings.simplefilter("ignore")
                self.read(path)
        except InputError as error:
            length = len(str(error))
            return "refused" if 0 < length <= LONGEST else f"a refusal of {length} characters"
        except (Exception, SystemExit) as error:
            return f"{type(error).__name__}: {error}"[:200]
        return "accepted"


def attack(reader: Reader, count: int, seed: int, folder: Path) -> dict:
    """Return a row (keys COLUMNS) of what becomes of `count` damaged files; a good file that is
    refused is a fault.
    """
    found = dict.fromkeys(COLUMNS, 0) | {"reader": reader.name, "inputs": count, "first_fault": ""}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    digest = int.from_bytes(hashlib.sha256(reader.name.encode()).digest()[:4], "big")
    good = [
        reader.data,
        *([reader.seal.closed(reader.seal.opened(reader.data))] if reader.seal else []),
    ]
    if controls := {
        outcome for data in good if (outcome := reader.outcome(data, folder)) != "accepted"
    }:
        return found | {"faults": 1, "first_fault": f"the good file: {', '.join(sorted(controls))}"}
    for number in range(count):
        data = reader.damaged(np.random.default_rng([seed, digest, number]), number % 2 == 1)
        start = time.monotonic()
        outcome = reader.outcome(data, folder)
        spent = time.monotonic() - start
        found["longest_s"] = max(found["longest_s"], spent)
        if spent > LIMIT_S and outcome in ("accepted", "refused"):
            outcome = f"took {spent:.1f} s"
        found[outcome if outcome in ("accepted", "refused") else "faults"] += 1
        if outcome not in ("accepted", "refused") and not found["first_fault"]:
            found["first_fault"] = f"input {number}: {outcome}"
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found["largest_mb"] = round((after - before) / 1024)
    if found["largest_mb"] > LIMIT_MB:
        found["faults"] += 1
        found["first_fault"] = found["first_fault"] or f"took {found['largest_mb']} MB"
    found["longest_s"] = round(found["longest_s"], 2)
    return found


def all_readers() -> list[Reader]:
    """Every reader of the core and, where they are there, of the extensions."""
    from fuzzed_readers import readers

    found = readers()
    if importlib.util.find_spec("fuzzed_extensions"):
        found += importlib.import_module("fuzzed_extensions").readers()
    return found


def _apart(name: str, count: int, seed: int, queue) -> None:
    """Read damaged files in a process of its own, with limited memory, and put the faults into the
    queue.
    """
    # Memory beyond the limit fails instead of filling the machine; the process itself needs some
    # three gigabytes.
    resource.setrlimit(resource.RLIMIT_AS, ((LIMIT_MB + 6144) << 20,) * 2)
    with Path(os.devnull).open("w") as silent, tempfile.TemporaryDirectory() as folder:
        os.dup2(silent.fileno(), 2)
        (reader,) = [reader for reader in all_readers() if reader.name == name]
        queue.put(attack(reader, max(1, round(count * reader.share)), seed, Path(folder)))


def main() -> None:
    """Attack every reader in a process of its own and write the table."""
    line = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    line.add_argument("--count", type=int, default=2000, help="damaged files a reader")
    line.add_argument("--seed", type=int, default=1)
    line.add_argument("--only", help="part of the names of the readers to attack")
    line.add_argument("--out", required=True, help="table to write (.csv)")
    given = line.parse_args()
    context = multiprocessing.get_context("spawn")
    rows = []
    for reader in all_readers():
        if given.only and given.only not in reader.name:
            continue
        queue = context.Queue()
        process = context.Process(target=_apart, args=(reader.name, given.count, given.seed, queue))
        process.start()
        while process.is_alive() and queue.empty():
            time.sleep(0.05)
        if queue.empty() and process.exitcode:
            fault = f"the process ended with {process.exitcode}"
            rows.append(
                dict.fromkeys(COLUMNS, 0)
                | {
                    "reader": reader.name,
                    "faults": 1,
                    "first_fault": fault,
                }
            )
        else:
            rows.append(queue.get())
        process.join()
        print(rows[-1], flush=True)
    Path(given.out).parent.mkdir(parents=True, exist_ok=True)
    with Path(given.out).open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    raise SystemExit(any(row["faults"] for row in rows))


if __name__ == "__main__":
    main()
