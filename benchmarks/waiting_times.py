"""Where the time of a command goes: core-seconds of imports by package, and of everything else.

    python benchmarks/waiting_times.py --out results/benchmarks/waiting_times.csv

Each command runs REPEATS times as a user runs it, and the row keeps the run of the fewest
core-seconds; one more run, with `python -X importtime`, says what the imports of each package take.
`from_clone.py` does the same for `make` and for `config/tiny.yaml`, stage by stage.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from lowalt.files.csv_tables import write_csv
from lowalt.machine.hardware import describe

REPEATS = 3
PACKAGES = (
    "torch",
    "timm",
    "torchvision",
    "numba",
    "scipy",
    "numpy",
    "matplotlib",
    "snakemake",
    "pandas",
    "lowalt",
)
MISSING = "predict default-seen missing.png"
COMMANDS = {
    "--help": "lowalt --help",
    "sample": "lowalt sample Crow 3 --snr 13 --out {out}",
    "predict": "lowalt predict default-seen {out}/crow-000003-snr013.png",
    "a refusal": f"lowalt {MISSING}",
    "explain urban": "lowalt explain config/scenes/urban.yaml",
    "snakemake -n": "snakemake -n --forceall",
}


def once(words: list[str]) -> dict:
    """Run a command and return its wall-clock and core-seconds and its largest memory (MB)."""
    start = time.monotonic()
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        _, process.returncode, used = os.wait4(process.pid, 0)
    wall = time.monotonic() - start
    return {
        "wall_s": wall,
        "core_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
    }


def imports(words: list[str]) -> Counter:
    """Seconds that the imports of a Python program take, by package; those of small packages are
    "others".
    """
    text = subprocess.run(
        [sys.executable, "-X", "importtime", *words], capture_output=True, text=True
    ).stderr
    found: Counter[str] = Counter()
    for own, name in re.findall(r"^import time:\s+(\d+) \|\s+\d+ \|\s*(\S+)$", text, re.MULTILINE):
        package = name.partition(".")[0]
        found[package if package in PACKAGES else "others"] += int(own) / 1e6
    return found


def measured(name: str, command: str) -> dict:
    """Return the row of a command."""
    program, *rest = command.split()
    runs = [once([str(Path(sys.executable).with_name(program)), *rest]) for _ in range(REPEATS)]
    best = min(runs, key=lambda run: run["core_s"])
    spent = imports(["-m", program, *rest])
    # Measuring imports makes them slower, so they are never more than the whole.
    share = min(1.0, best["core_s"] / max(sum(spent.values()), 1e-9))
    parts = {f"{package}_s": share * spent[package] for package in (*PACKAGES, "others")}
    return {
        "command": name,
        **best,
        **parts,
        "work_s": best["core_s"] - sum(parts.values()),
        "hardware": describe(),
    }


def main() -> None:
    """Measure every command and write the table."""
    line = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    line.add_argument("--out", type=Path, required=True, help="table to write (.csv)")
    options = line.parse_args()
    os.environ.pop("LOWALT_INPUTS", None)
    with tempfile.TemporaryDirectory() as out:
        rows = [measured(name, command.format(out=out)) for name, command in COMMANDS.items()]
    for row in rows:
        print(
            {
                key: round(value, 2) if isinstance(value, float) else value
                for key, value in row.items()
            }
        )
    write_csv(
        options.out,
        list(rows[0]),
        [
            {
                key: f"{value:.4g}" if isinstance(value, float) else value
                for key, value in row.items()
            }
            for row in rows
        ],
    )


if __name__ == "__main__":
    main()
