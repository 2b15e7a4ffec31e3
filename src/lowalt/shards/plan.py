"""The plan of a run: its subtypes, chunks and shards, which follow from the configuration.

A data set can grow without remaking it: subtypes and SNRs under `added` in the configuration get
their own chunks. If step t (1, 2, ...) of that list adds subtypes, their motion models are in
chunks {group}-{part}t{t}. If it adds SNRs, there is a chunk {chunk}s{t} for every earlier chunk,
with the same motion models and echoes.
"""

import itertools
import math
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

from lowalt.config.blocks import snrs_of
from lowalt.config.splits import FOLDS, fold
from lowalt.files.errors import InputError, instead
from lowalt.scene.effects import breaks_tracks
from lowalt.shards.sizes import sample_bytes

GROUPS = ("seen", "unseen")
PART = r"\d{5}(?:t\d+)?(?:s\d+)?"
"""Regular expression of {part}, a chunk's name behind its group."""
PIECE = r"(?:p\d+)?"
"""Regular expression of a shard's piece, if a fold of a chunk is packed into several shards."""
EVERY = 2**53
"""Limit of samples per shard where there is no limit of size."""


def _refuse_tracks(config: dict) -> None:
    """Refuse tracks that a split would divide, or whose targets would jump between looks."""
    if "looks" not in config["motion"]:
        return
    if config["split"]["by"] != "motion":
        raise InputError(
            f"split.by: {config['split']['by']!r} together with motion.looks, expected 'motion'"
        )
    jumping = breaks_tracks(config["effects"])
    if jumping:
        raise InputError(
            f"effects: {jumping} together with motion.looks, expected none of them: each draws a "
            "motion for every look, and the looks of a track would not join"
        )


def _block_of(split: dict) -> int:
    """Return how many consecutive motion models a split divides into its exact shares."""
    return sum(split[name] for name in FOLDS)


def _refuse_split_chunks(models_per_chunk: int, split: dict) -> None:
    """Refuse chunks that do not hold whole blocks of the split."""
    block = _block_of(split)
    if models_per_chunk % block:
        raise InputError(
            f"motion.models_per_chunk: value {models_per_chunk}, expected a multiple of {block}, "
            "the block of split (train + val + test), so that every chunk has its exact share "
            "of every fold"
        )


def _subtypes_by_step(config: dict, published: Collection[str]) -> list[tuple[str, ...]]:
    """Return the subtypes that are selected, and those of each step added to them.

    published: all subtypes of the table. Raises: InputError for one that the table lacks, and for
    one that is selected or added twice.
    """
    select = config["targets"]["select"]
    later = [tuple(step.get("subtypes", [])) for step in config.get("added", [])]
    more = list(itertools.chain.from_iterable(later))
    unknown = [name for name in (*select, *more) if name not in published]
    if unknown:
        otherwise = f"names of the table, such as {next(iter(published))!r}"
        raise InputError(
            f"targets.select: {unknown}, expected {instead(unknown, published, otherwise)}"
        )
    twice = sorted({name for name in more if more.count(name) > 1 or name in select})
    if twice:
        raise InputError(f"added: subtypes {twice}, expected each once, either selected or added")
    first = [name for name in published if name not in more and (not select or name in select)]
    return [tuple(first), *later]


@dataclass(frozen=True)
class Chunk:
    """Motion models of some subtypes at some SNRs (dB).

    source: the chunk whose motion and echoes it shares; first, count: of the models.
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
        """Return the plan of a checked configuration.

        published: the row of every subtype in the table of targets. Raises: InputError for a
        selected subtype the table lacks, one that is selected and added, or a chunk that breaks the
        blocks of the split.
        """
        motion = config["motion"]
        split = config["split"]
        _refuse_tracks(config)
        subtypes = _subtypes_by_step(config, published)
        _refuse_split_chunks(motion["models_per_chunk"], split)
        selected = set(itertools.chain.from_iterable(subtypes))
        groups = {}
        for group in GROUPS:
            members = []
            for name, row in published.items():
                if name in selected and row["unseen_protocol"] == group:
                    members.append(name)
            if members:
                groups[group] = tuple(members)
        snrs = []
        for step in (config["noise"], *config.get("added", [])):
            snrs.append(tuple(float(snr) for snr in step.get("snr_db", [])))
        largest: float = EVERY
        largest_mb = config.get("shards", {}).get("largest_mb")
        if largest_mb:
            largest = max(1, 1e6 * largest_mb // sample_bytes(config))
        looks = motion.get("looks", 1)
        return cls(
            groups=groups,
            models=looks * motion["models"],
            models_per_chunk=looks * motion["models_per_chunk"],
            snrs=snrs_of(config),
            split=split,
            seed=config["seed"],
            steps=tuple(zip(subtypes, snrs, strict=True)),
            largest=largest,
            looks=looks,
        )

    @cached_property
    def _chunks(self) -> dict[str, Chunk]:
        """All chunks by name, step by step.

        A step's SNRs make a chunk for each earlier one; its subtypes make chunks at all SNRs so
        far.
        """
        chunks: dict[str, Chunk] = {}
        known: tuple[float, ...] = ()
        for step, (subtypes, snrs) in enumerate(self.steps):
            earlier = [chunk for chunk in chunks.values() if chunk.name == chunk.source]
            if snrs and step:
                for chunk in earlier:
                    name = f"{chunk.name}s{step}"
                    chunks[name] = replace(chunk, name=name, snrs=snrs)
            known += snrs
            suffix = f"t{step}" if step else ""
            for group, names in self.groups.items():
                members = tuple(name for name in names if name in subtypes)
                if not members:
                    continue
                # The last chunk of a group may be smaller.
                for number in range(-(-self.models // self.models_per_chunk)):
                    name = f"{group}-{number:05d}{suffix}"
                    first = number * self.models_per_chunk
                    count = min(self.models_per_chunk, self.models - first)
                    chunks[name] = Chunk(name, name, members, known, first, count)
        return chunks

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
        """Return a chunk by its name."""
        return self._chunks[name]

    def folds(self, chunk: str) -> list[str]:
        """Return the folds that have a sample in this chunk; each becomes one shard."""
        held = self._chunks[chunk]
        if held.count // self.looks % _block_of(self.split) == 0:
            return [name for name in FOLDS if self.split[name]]
        dealt = set()
        for subtype in held.members:
            for model in range(held.first, held.first + held.count, self.looks):
                for snr in held.snrs:
                    dealt.add(fold(self.split, self.seed, subtype, model // self.looks, snr))
        return [name for name in FOLDS if name in dealt]

    def pieces(self, chunk: str, fold: str) -> list[str]:
        """Return the suffixes of a chunk's shards of one fold: "", or p0, p1, ... for several."""
        held = self._chunks[chunk]
        models = held.count * len(held.members) * self.split[fold] / _block_of(self.split)
        # The samples of a motion model stay together.
        count = math.ceil(models / max(1, self.largest // len(held.snrs)))
        if count <= 1:
            return [""]
        return [f"p{number}" for number in range(count)]

    @cached_property
    def shards(self) -> list[str]:
        """Names {group}-{fold}-{part}{piece} of all shards."""
        names = []
        for chunk in self.chunks:
            group, number = chunk.split("-")
            for fold_name in self.folds(chunk):
                for piece in self.pieces(chunk, fold_name):
                    names.append(f"{group}-{fold_name}-{number}{piece}")
        return names
