"""An effect is one file, and little else names it.

What does are the order of all effects, its entry in the schema, its tests and the documents.
"""

import functools
import re
from pathlib import Path

import pytest

from lowalt.config.extensions import owner
from lowalt.scene.effects import ADDED, PLACES, dotted

ORDER = "src/lowalt/scene/effects/__init__.py"
ENGLISH = {"town", "clutter", "companions", "walls", "canceller", "detector", "fluctuation"} | {
    *("gusts", "interference", "occlusion", "squint", "wavefront", "adc"),
}
"""Names that sentences use as words: only in quotes, or behind `effects.`, do they name the effect."""
OTHER_MEANINGS = {
    "companions": [
        *("scene/contract.py", "scene/chain.py"),
        *("shards/receive.py", "shards/record_types.py"),
    ],
    "cross_sections": [
        *("scene/contract.py", "scene/chain.py", "scene/observe.py"),
        "scene/effects/channel/mean_cross_section.py",
    ],
    "canceller": ["shards/receive.py"],
    "clutter": ["scene/effects/detection/canceller.py", "extensions/benchmark/"],
    "mean_cross_section": ["motion/cross_section.py", "scene/levels.py"],
    "slow_time": ["extensions/recordings/"],
    "town": ["extensions/benchmark/"],
    "walls": ["extensions/__init__.py", "extensions/town/"],
}
"""Files and folders in which a name means something else: a function of the contract, a field of
records and echoes, what
`lowalt.receive` reads at, a kind of filter, a mean, a direction of samples, a part of the
benchmark, a wall.
"""
RELATED = {
    "carrier_offset": {"clock_offset", "transmit_leakage"},
    "clock_offset": {"transmit_leakage"},
    "cross_sections": {"fluctuation"},
    "interference": {"offsets"},
    "link_offset": {"interference", "offsets"},
    "phase_noise": {"offsets", "transmit_leakage"},
    "rotor_spread": {"twin_echo", "twin_scenes"},
    "timing_offset": {"clock_offset"},
}
"""Effects that share an oscillator or a law with another, and files that say so or use the law."""


@functools.cache
def searched() -> dict[str, str]:
    """Return the text of all files of the package and the workflow that hold code, by path."""
    files = [path for path in Path("src/lowalt").rglob("*") if path.suffix in (".py", ".jinja")]
    files += [*Path("workflow/rules").glob("*.smk"), Path("Snakefile")]
    return {str(path): path.read_text() for path in files}


def homes(name: str) -> list[str]:
    """Return the beginnings of the paths of an effect's own files."""
    path = Path("src", *dotted(name).split("."))
    if name not in ADDED:
        return [f"{path}.py", ORDER]
    return [f"{path.parent}/", "src/lowalt/extensions/__init__.py", ORDER]


def files_that_name(name: str) -> set[str]:
    """Return the files outside of its own that name an effect."""
    quoted = rf"[\"'`]{name}[\"'`]|effects\.{name}\b"
    pattern = re.compile(quoted if name in ENGLISH else rf"\b{name}\b")
    found = set()
    for path, text in searched().items():
        if not path.startswith(tuple(homes(name))) and pattern.search(text):
            found.add(path)
    return found


def other_meanings(name: str) -> list[str]:
    """Return the beginnings of the paths of files in which an effect's name means something else."""
    return [f"src/lowalt/{path}" for path in OTHER_MEANINGS.get(name, [])]


@pytest.mark.parametrize("name", PLACES)
def test_only_its_own_file_and_the_order_name_an_effect(name):
    if name in ADDED and owner("effects", name) != "town":
        pytest.skip("an effect of an extension from elsewhere")
    related = RELATED.get(name, set())
    unexplained = [
        path
        for path in files_that_name(name)
        if Path(path).stem not in related and not path.startswith(tuple(other_meanings(name)))
    ]
    assert unexplained == []
