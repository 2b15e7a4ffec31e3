"""The plan of a run: its subtypes, chunks and shards, all known from the configuration before any job starts."""

from dataclasses import dataclass

from lowalt.common.errors import InputError
from lowalt.common.splits import FOLDS, fold

GROUPS = ("seen", "unseen")


@dataclass(frozen=True)
class Plan:
    """Chunks and shards of a run; `groups` maps a group to its subtypes in the table's order."""

    groups: dict[str, tuple[str, ...]]
    models: int
    models_per_chunk: int
    snrs: tuple[float, ...]
    split: dict
    seed: int

    @classmethod
    def of(cls, config: dict, published: dict[str, dict]) -> "Plan":
        """Return the plan of a checked configuration; `published` maps every subtype to its row of the table.

        Raises: InputError for a selected subtype the table lacks, or a chunk that breaks the blocks of the split.
        """
        select, motion, split = config["targets"]["select"], config["motion"], config["split"]
        unknown = [name for name in select if name not in published]
        if unknown:
            raise InputError(
                f"targets.select: {unknown}, expected names of the table, such as {next(iter(published))!r}"
            )
        names = [name for name in published if not select or name in select]
        block = sum(split[name] for name in FOLDS)
        if motion["models_per_chunk"] % block:
            raise InputError(
                f"motion.models_per_chunk: value {motion['models_per_chunk']}, expected a multiple of {block}, "
                "the block of split (train + val + test), so that every chunk has its exact share of every fold"
            )
        groups = {
            group: tuple(name for name in names if published[name]["unseen_protocol"] == group) for group in GROUPS
        }
        groups = {group: members for group, members in groups.items() if members}
        snrs = tuple(float(snr) for snr in config["noise"]["snr_db"])
        if len(set(snrs)) < len(snrs):
            raise InputError(f"noise.snr_db: value {list(snrs)}, expected every SNR once")
        return cls(groups, motion["models"], motion["models_per_chunk"], snrs, split, config["seed"])

    @property
    def chunks(self) -> list[str]:
        """Names {group}-{part} of all chunks."""
        parts = -(-self.models // self.models_per_chunk)
        return [f"{group}-{part:05d}" for group in self.groups for part in range(parts)]

    def span(self, chunk: str) -> tuple[int, int]:
        """First model number and count of models of each subtype in a chunk."""
        first = int(chunk.rpartition("-")[2]) * self.models_per_chunk
        return first, min(self.models_per_chunk, self.models - first)

    def folds(self, chunk: str) -> list[str]:
        """Folds that have a sample in this chunk; each becomes one shard."""
        first, count = self.span(chunk)
        if count % sum(self.split[name] for name in FOLDS) == 0:
            return [name for name in FOLDS if self.split[name]]
        found = {
            fold(self.split, self.seed, subtype, model, snr)
            for subtype in self.groups[chunk.partition("-")[0]]
            for model in range(first, first + count)
            for snr in self.snrs
        }
        return [name for name in FOLDS if name in found]

    @property
    def shards(self) -> list[str]:
        """Names {group}-{fold}-{part} of all shards."""
        return [
            f"{group}-{name}-{part}"
            for group, part in (chunk.split("-") for chunk in self.chunks)
            for name in self.folds(f"{group}-{part}")
        ]
