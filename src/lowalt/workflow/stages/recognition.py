"""What the rules of recognition take: samples, schemes, networks, and models of other runs."""

from pathlib import Path
from typing import Any

from lowalt.files.errors import InputError
from lowalt.recognition.schemes import Scheme
from lowalt.scene.effects import needs_surfaces
from lowalt.workflow.stages.stage import RunStage, text


class RecognitionStage(RunStage):
    """Trainings of a run, their predictions and tables."""

    def _scheme(self, wildcards: Any) -> Scheme:
        """Return the scheme of a job."""
        return self._run.schemes_by_slug[wildcards.scheme]

    @property
    def first_chunks(self) -> list[str]:
        """The chunks whose motion tables together hold at least one model of every subtype."""
        plan = self._run.plan
        return [name for name in plan.sources if plan.chunk(name).first == 0]

    def is_reduced(self, wildcards: Any) -> bool:
        """Return whether the tiles stage makes images of a job's size for a whole chunk."""
        return self._run.is_reduced(int(wildcards.size))

    def views(self, wildcards: Any) -> str:
        """Return pixels per side of the shrunk images.

        Where the tiles stage makes them for a whole chunk, the SNRs follow.
        """
        size = int(wildcards.size)
        if self._run.is_reduced(size):
            return text(size=size, snr_db=self._snrs(wildcards))
        return text(size=size)

    def samples(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Return the inputs of a training or evaluation as configured.

        They are images reduced to the scheme's size, the index of the shards, or what samples
        simulated on access are made from.
        """
        data = f"results/{self._run.data}"
        block = self._config["recognition"]
        if block.get("input") == "dataset":
            return self._simulated(data)
        if not block["cache"]:
            return {"index": f"{data}/shards/index.json"}
        views = f"{data}/views/{self._run.pixels(self._scheme(wildcards))}"
        return {"views": [f"{views}/{shard}.npz" for shard in self._run.plan.shards]}

    def _simulated(self, data: str) -> dict[str, str | list[str]]:
        """Return configuration, clouds and, if effects need them, surfaces of a data set's run."""
        subtypes = self._run.subtypes
        files: dict[str, str | list[str]] = {
            "dataset": f"{data}/config.yaml",
            "clouds": [f"{data}/clouds/{subtype}.npz" for subtype in subtypes],
        }
        if needs_surfaces(self._config["effects"]):
            files["surfaces"] = [f"{data}/occluders/{subtype}.npz" for subtype in subtypes]
        return files

    def backbone_file(self, wildcards: Any) -> list[str]:
        """Return the user's file that defines the backbone of a job's scheme, if one does."""
        name = self._run.own_backbone(self._scheme(wildcards))
        if not name:
            return []
        file, _, _ = name.rpartition(":")
        return [file]

    def training(self, wildcards: Any) -> str:
        """Return settings of a training with its scheme and its seed.

        The seed is the training's own or, if the job has none, the run's.
        """
        block = self._config["recognition"]
        kept = {key: block[key] for key in ("size", "network", "training", "augmentation")}
        return text(
            **kept,
            seed=int(wildcards.get("train_seed", self._config["seed"])),
            scheme=self._scheme(wildcards).record,
            colour_map=self._config["images"]["colour_map"],
            classes=self._run.classes,
        )

    def evaluation(self, wildcards: Any) -> str:
        """Return settings with which a network predicts."""
        return text(**self._config["recognition"]["evaluation"])

    def backbone(self, wildcards: Any) -> list[str]:
        """Return the option that names the user's code of a scheme's backbone, if it has some."""
        name = self._run.own_backbone(self._scheme(wildcards))
        if not name:
            return []
        return ["--backbone", name]

    def seed(self, wildcards: Any) -> str:
        """Return only the run's seed, for tables with intervals."""
        return text(seed=self._config["seed"])

    def transferred(self, wildcards: Any) -> list[str]:
        """Return this run and those whose models are tested on its samples.

        Raises: InputError naming a run that is missing, or has not trained what this one trains.
        """
        others = self._config["recognition"]["transfer"]
        needed = ["config.yaml"]
        for training in self._run.trainings:
            needed.append(f"models/{training}/model.safetensors")
        for other in others:
            for name in needed:
                path = f"results/{other}/{name}"
                if not Path(path).is_file():
                    raise InputError(
                        f"recognition.transfer: no {path}, expected a finished run {other!r} with "
                        "the schemes, protocols and seeds of this one"
                    )
        return [wildcards.run, *others]
