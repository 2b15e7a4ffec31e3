"""The plan of a run: its subtypes, chunks and shards, which follow from the configuration before
any job starts.

A data set can grow without remaking it: subtypes and SNRs under `added` in the configuration get
their own chunks. If step t (1, 2, ...) of that list adds subtypes, their motion models are in
chunks {group}-{part}t{t}. If it adds SNRs, there is a chunk {chunk}s{t} for every earlier chunk,
with the same motion models and echoes.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from tarfile import BLOCKSIZE

from lowalt.config.network import band
from lowalt.config.splits import FOLDS, fold
from lowalt.files.errors import InputError, instead

GROUPS = ("seen", "unseen")
PART = r"\d{5}(?:t\d+)?(?:s\d+)?"
"""Regular expression of a chunk's part."""
PIECE = r"(?:p\d+)?"
"""Regular expression of a shard's piece, if a fold of a chunk is packed into several shards."""
RECORD_BYTES = 2048
"""Bytes of a sample's JSON record in the tar, including padding."""
PIXEL_BYTES = 0.5
"""Largest measured number of bytes in a shard per pixel of a tile."""
CELL_BYTES = {"complex64": 8, "int16": 4}
"""Bytes of a range cell of a cube, by the type that it is stored as."""
TRUTH_BYTES = 65
"""Bytes of the record per symbol of a cube, for its ground truth: the chosen cell and the numbers
`cube.TRUTH`.
"""


EVERY = 2**53
"""Limit of samples per shard where there is no limit of size."""


def snrs_of(config: dict) -> tuple[float, ...]:
    """Return all SNRs (dB) of a configuration, those added later last.

    Raises: InputError where an SNR stands twice.
    """
    steps = [config["noise"], *config.get("added", [])]
    snrs = tuple(float(snr) for step in steps for snr in step.get("snr_db", []))
    if len(set(snrs)) < len(snrs):
        raise InputError(f"noise.snr_db: value {list(snrs)}, expected every SNR once")
    return snrs


def motion_block(config: dict) -> dict:
    """Return the block `motion` of a configuration; where it has `looks`, with look_s, the length
    of a look (s).
    """
    motion = config["motion"]
    network = config["network"]
    return motion | (
        {"look_s": network["symbols"] * network["symbol_interval_s"]} if "looks" in motion else {}
    )


def _refuse_tracks(config: dict) -> None:
    """Refuse tracks that a split would divide."""
    if "looks" in config["motion"] and config["split"]["by"] != "motion":
        raise InputError(
            f"split.by: {config['split']['by']!r} together with motion.looks, expected 'motion'"
        )


def cell_type(config: dict) -> str:
    """Return the type in which range cells of cubes are stored: "complex64" or "int16"."""
    return config["shards"].get("cells", "complex64")


def sample_bytes(config: dict) -> int:
    """Return the approximate bytes of a sample in a shard, padding included, by its kind; of
    recipes, its share.
    """
    kind = config["shards"]["kind"]
    stations = len(config["network"]["stations"])
    symbols = stations * config["network"]["symbols"]
    record = RECORD_BYTES
    if kind == "image":
        spectra = sum(isinstance(block, dict) for block in config["spectra"].values())
        data = int(PIXEL_BYTES * stations * spectra * config["images"]["size"] ** 2)
    elif kind == "cube":
        record += TRUTH_BYTES * symbols
        data = (
            128 + CELL_BYTES[cell_type(config)] * symbols * band(config["network"])["subcarriers"]
        )
    else:
        data = 128 + 8 * symbols
    whole = 2 * BLOCKSIZE + sum(size + -size % BLOCKSIZE for size in (record, data))
    return whole // len(snrs_of(config)) if kind == "recipe" else whole


@dataclass(frozen=True)
class Chunk:
    """Motion models of some subtypes at some SNRs (dB); `source` is the chunk whose motion and
    echoes it shares.
    """

    name: str
    source: str
    members: tuple[str, ...]
    snrs: tuple[float, ...]
    first: int
    count: int


@dataclass(frozen=True)
class Plan:
    """Chunks and shards of a run; `groups` maps a group to its subtypes in the table's order.

    groups, snrs: all of them; steps: the subtypes and SNRs of the configuration's lists and of each
    step added to them;
    models: rows of the motion table per subtype, one per look; looks: number per motion model;
    largest: samples per shard.
    """

    groups: dict[str, tuple[str, ...]]
    models: int
    models_per_chunk: int
    snrs: tuple[float, ...]
    split: dict
    seed: int
    steps: tuple[tuple[tuple[str, ...], tuple[float, ...]], ...]
    largest: float = EVERY
    looks: int = 1

    @classmethod
    def of(cls, config: dict, published: dict[str, dict]) -> "Plan":
        """Return the plan of a checked configuration; `published` maps every subtype to its row of
        the table.

        Raises: InputError for a selected subtype the table lacks, one that is selected and added,
        or a chunk that breaks the blocks of the split.
        """
        select = config["targets"]["select"]
        motion = config["motion"]
        split = config["split"]
        _refuse_tracks(config)
        later = [tuple(step.get("subtypes", [])) for step in config.get("added", [])]
        more = [name for step in later for name in step]
        unknown = [name for name in (*select, *more) if name not in published]
        if unknown:
            otherwise = f"names of the table, such as {next(iter(published))!r}"
            raise InputError(
                f"targets.select: {unknown}, expected {instead(unknown, published, otherwise)}"
            )
        twice = sorted({name for name in more if more.count(name) > 1 or name in select})
        if twice:
            raise InputError(
                f"added: subtypes {twice}, expected each once, either selected or added"
            )
        names = [name for name in published if not select or name in (*select, *more)]
        block = sum(split[name] for name in FOLDS)
        if motion["models_per_chunk"] % block:
            raise InputError(
                f"motion.models_per_chunk: value {motion['models_per_chunk']}, expected a multiple of {block}, "
                "the block of split (train + val + test), so that every chunk has its exact share "
                "of every fold"
            )
        groups = {
            group: tuple(name for name in names if published[name]["unseen_protocol"] == group)
            for group in GROUPS
        }
        groups = {group: members for group, members in groups.items() if members}
        levels = [
            tuple(map(float, step.get("snr_db", [])))
            for step in (config["noise"], *config.get("added", []))
        ]
        subtypes = [tuple(name for name in names if name not in more), *later]
        steps = tuple(zip(subtypes, levels, strict=True))
        largest: float = EVERY
        if config.get("shards", {}).get("largest_mb"):
            largest = max(1, 1e6 * config["shards"]["largest_mb"] // sample_bytes(config))
        looks = motion.get("looks", 1)
        numbers = (
            looks * motion["models"],
            looks * motion["models_per_chunk"],
            snrs_of(config),
            split,
            config["seed"],
        )
        return cls(groups, *numbers, steps, largest, looks)

    @cached_property
    def _chunks(self) -> dict[str, Chunk]:
        """All chunks by name, step by step: subtypes of a step at all SNRs so far, then its SNRs
        for all chunks.
        """
        chunks: dict[str, Chunk] = {}
        known: tuple[float, ...] = ()
        for step, (subtypes, snrs) in enumerate(self.steps):
            earlier = [chunk for chunk in chunks.values() if chunk.name == chunk.source]
            if snrs and step:
                for chunk in earlier:
                    name = f"{chunk.name}s{step}"
                    chunks[name] = Chunk(
                        name, chunk.name, chunk.members, snrs, chunk.first, chunk.count
                    )
            known += snrs
            for group, part in (
                (group, part) for group in self.groups for part in range(self._parts)
            ):
                members = tuple(name for name in self.groups[group] if name in subtypes)
                name = f"{group}-{part:05d}{f't{step}' if step else ''}"
                first = part * self.models_per_chunk
                count = min(self.models_per_chunk, self.models - first)
                if members:
                    chunks[name] = Chunk(name, name, members, known, first, count)
        return chunks

    @property
    def _parts(self) -> int:
        """Number of chunks that hold the motion models of one group, the last one possibly smaller."""
        return -(-self.models // self.models_per_chunk)

    @property
    def samples(self) -> int:
        """Number of all samples."""
        return sum(
            chunk.count * len(chunk.members) * len(chunk.snrs) for chunk in self._chunks.values()
        )

    @property
    def chunks(self) -> list[str]:
        """Names {group}-{part} of all chunks."""
        return list(self._chunks)

    @property
    def sources(self) -> list[str]:
        """Names of the chunks that have their own motion models."""
        return [name for name, chunk in self._chunks.items() if chunk.source == name]

    def chunk(self, name: str) -> Chunk:
        """A chunk by its name."""
        return self._chunks[name]

    def span(self, chunk: str) -> tuple[int, int]:
        """First model number and count of models of each subtype in a chunk."""
        return self._chunks[chunk].first, self._chunks[chunk].count

    def folds(self, chunk: str) -> list[str]:
        """Folds that have a sample in this chunk; each becomes one shard."""
        held = self._chunks[chunk]
        if held.count // self.looks % sum(self.split[name] for name in FOLDS) == 0:
            return [name for name in FOLDS if self.split[name]]
        dealt = {
            fold(self.split, self.seed, subtype, model // self.looks, snr)
            for subtype in held.members
            for model in range(held.first, held.first + held.count, self.looks)
            for snr in held.snrs
        }
        return [name for name in FOLDS if name in dealt]

    def pieces(self, chunk: str, fold: str) -> list[str]:
        """Return the suffixes of a chunk's shards of one fold: an empty one, or p0, p1, ... for
        several.
        """
        held = self._chunks[chunk]
        models = (
            held.count
            * len(held.members)
            * self.split[fold]
            / sum(self.split[name] for name in FOLDS)
        )
        # The samples of a motion model stay together.
        count = math.ceil(models / max(1, self.largest // len(held.snrs)))
        return [f"p{number}" for number in range(count)] if count > 1 else [""]

    @property
    def shards(self) -> list[str]:
        """Names {group}-{fold}-{part}{piece} of all shards."""
        return [
            f"{group}-{name}-{part}{piece}"
            for group, part in (chunk.split("-") for chunk in self.chunks)
            for name in self.folds(f"{group}-{part}")
            for piece in self.pieces(f"{group}-{part}", name)
        ]
