"""Input files of the rules for clouds, motion, echoes, noise, tiles and shards, derived from the plan of the run.

Each method takes the wildcards of a job and can be used in a rule's `input:`. No file is read here.
"""

from typing import Any

from lowalt.config.named_code import buildings_of
from lowalt.files.atomic import slug
from lowalt.scene.effects import module_of
from lowalt.scene.lateness import late_effects
from lowalt.spectra.catalogue import of_cells
from lowalt.targets.records import source_files
from lowalt.workflow.run import Run


class DataProducts:
    """Paths of the files from which the data set of one run is made."""

    def __init__(self, run: Run) -> None:
        """Keep the run."""
        self._run, self._config = run, run.config

    def _of_chunk(self, folder: str, wildcards: Any) -> list[str]:
        """Files of a folder of the run, one for each subtype of a chunk, in the table's order."""
        names = self._run.plan.chunk(f"{wildcards.group}-{wildcards.part}").members
        return [f"results/{wildcards.run}/{folder}/{slug(name)}.npz" for name in names]

    def record_files(self, wildcards: Any) -> list[str]:
        """The user's mesh or recording files that the record of one subtype names."""
        return source_files(self._run.records[self._run.subtypes[wildcards.subtype]], self._run.inputs)

    def chunk_clouds(self, wildcards: Any) -> list[str]:
        """Clouds of the subtypes of a chunk, in the table's order."""
        return self._of_chunk("clouds", wildcards)

    def motion(self, wildcards: Any) -> str:
        """The motion table of a chunk; a chunk of added SNRs uses that of its source chunk."""
        return f"results/{wildcards.run}/motion/{self._source(wildcards)}.csv"

    def first_motion(self, wildcards: Any) -> list[str]:
        """Motion tables that together hold at least one model of every subtype."""
        names = [name for name in self._run.plan.sources if not self._run.plan.span(name)[0]]
        return [f"results/{wildcards.run}/motion/{name}.csv" for name in names]

    def _source(self, wildcards: Any) -> str:
        """Name of the source chunk, whose motion and echoes a chunk uses: itself, or the one to which it adds SNRs."""
        return self._run.plan.chunk(f"{wildcards.group}-{wildcards.part}").source

    def track(self, wildcards: Any) -> list[str]:
        """The flight log whose path motion models follow; none where paths are drawn."""
        return [self._config["motion"]["track"]] if "track" in self._config["motion"] else []

    def scene_clouds(self, wildcards: Any) -> list[str]:
        """Clouds of a chunk's subtypes and of the scene's companions."""
        companions = (self._config["effects"].get("companions") or {}).get("subtypes", [])
        beside = [f"results/{wildcards.run}/clouds/{slug(name)}.npz" for name in companions]
        return list(dict.fromkeys([*self.chunk_clouds(wildcards), *beside]))

    def chunk_occluders(self, wildcards: Any) -> list[str]:
        """Surfaces of a chunk's subtypes, if the scene has the effect `occlusion`."""
        return self._of_chunk("occluders", wildcards) if "occlusion" in self._config["effects"] else []

    def town(self, wildcards: Any) -> list[str]:
        """The file of buildings and the meshes that it names, in a scene with the effect `town`."""
        buildings = buildings_of(self._config["effects"])
        if buildings is None:
            return []
        return module_of("town").files_of(buildings)

    def span(self, wildcards: Any) -> list[str]:
        """The motion models of a chunk within its group, as command-line words."""
        first, count = self._run.plan.span(f"{wildcards.group}-{wildcards.part}")
        return ["--first", str(first), "--count", str(count)]

    def cost_clouds(self, wildcards: Any) -> list[str]:
        """Clouds of the first subtype of each category, in the table's order."""
        first: dict[str, str] = {}
        for name, record in self._run.records.items():
            first.setdefault(record["published"]["category"], name)
        return [f"results/{wildcards.run}/clouds/{slug(name)}.npz" for name in first.values()]

    def piece(self, wildcards: Any) -> list[str]:
        """The number of a shard among the pieces of its chunk's fold, as command-line words; empty if alone."""
        pieces = self._run.plan.pieces(f"{wildcards.group}-{wildcards.part}", wildcards.fold)
        return ["--piece", str(pieces.index(wildcards.piece)), str(len(pieces))] if len(pieces) > 1 else []

    def listening(self, wildcards: Any) -> list[str]:
        """Names of the stations whose signals one echo job makes."""
        return [wildcards.station] if self._run.echo_per_station else self._run.stations

    def chunk_echoes(self, wildcards: Any) -> list[str]:
        """The clean signals of a chunk, in the order of the stations."""
        stem = f"results/{wildcards.run}/echo/{self._source(wildcards)}"
        return [f"{stem}/{station}.npy" for station in self._run.stations]

    def chunk_powers(self, wildcards: Any) -> list[str]:
        """Powers of the targets' own echoes, to which SNRs refer in a scene with effects; empty without effects."""
        stem = f"results/{wildcards.run}/echo/{self._source(wildcards)}"
        return [f"{stem}/{station}.power.npy" for station in self._run.stations] if self._config["effects"] else []

    def tile_content(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Inputs of tiles other than signals: the motion table, if spectra use known symbol instants or range cells;
        for range cells also clouds and surfaces."""
        cells = bool(of_cells(self._config["spectra"]))
        motion = {"motion": self.motion(wildcards)} if cells or late_effects(self._config) else {}
        return motion | (self._scene(wildcards) if cells else {})

    def _scene(self, wildcards: Any) -> dict[str, list[str]]:
        """Clouds, surfaces and buildings that cubes of a chunk are made from."""
        found = {"clouds": self.scene_clouds(wildcards), "occluders": self.chunk_occluders(wildcards)}
        return found | self._town(wildcards)

    def _town(self, wildcards: Any) -> dict[str, list[str]]:
        """The files of the buildings, by which a record names the paths; none in a scene without a town."""
        files = self.town(wildcards)
        return {"town": files} if files else {}

    def shard_content(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Files from which shards are packed, by kind: noisy signals and tiles (image), noisy signals (signal), clean
        echoes (recipe), or noisy signals, clouds and surfaces (cube); in a town the buildings too."""
        base, chunk = f"results/{wildcards.run}", f"{wildcards.group}-{wildcards.part}"
        kind, town = self._config["shards"]["kind"], self._town(wildcards)
        if kind == "recipe":
            return {"echoes": self.chunk_echoes(wildcards), "powers": self.chunk_powers(wildcards), **town}
        signals = {"signals": f"{base}/noisy/{chunk}.npy", **town}
        if kind == "cube":
            return {**signals, **self._scene(wildcards)}
        return {**signals, "tiles": f"{base}/tiles/{chunk}.npz"} if kind == "image" else signals

    def reduced(self, wildcards: Any) -> dict[str, str]:
        """Reduced images of a chunk and its motion table; empty if the tiles stage makes none of this size."""
        if not self._run.is_reduced(int(wildcards.size)):
            return {}
        base, chunk = f"results/{wildcards.run}", f"{wildcards.group}-{wildcards.part}"
        return {"reduced": f"{base}/reduced/{wildcards.size}/{chunk}.npy", "motion": self.motion(wildcards)}
