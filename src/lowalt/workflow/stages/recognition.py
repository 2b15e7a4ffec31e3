"""What the rules of recognition take: samples, schemes, networks, and models of other runs."""

from pathlib import Path
from typing import Any

from lowalt.config.named_code import file_and_function
from lowalt.files.errors import InputError
from lowalt.recognition.schemes import Scheme
from lowalt.scene.effects import needs_surfaces
from lowalt.workflow.refusals import SIMULATED_ON_ACCESS
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

    def is_made_by_tiles_stage(self, wildcards: Any) -> bool:
        """Return whether the tiles stage makes images of a job's size, one file a chunk."""
        return self._run.is_made_by_tiles_stage(int(wildcards.size))

    def view_settings(self, wildcards: Any) -> str:
        """Return settings of the rule that shrinks a shard's images: pixels per side.

        The images of the tiles stage stand in one array of all SNRs (dB) of a chunk, so these are
        named too where they are used.
        """
        size = int(wildcards.size)
        if self._run.is_made_by_tiles_stage(size):
            return text(size=size, snr_db=self._snrs(wildcards))
        return text(size=size)

    def samples(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Return the input files of a training or evaluation, by the name of their option.

        They are images shrunk to the scheme's size ("views"), the index of the shards, or the files
        from which samples are simulated on access ("dataset").
        """
        data = f"results/{self._run.data}"
        block = self._config["recognition"]
        if block.get("input") == SIMULATED_ON_ACCESS:
            return self._simulated(data)
        # With the cache, shrunk images are files that all trainings share; without it each training
        # reads and shrinks those of the shards.
        if not block["cache"]:
            return {"index": f"{data}/shards/index.json"}
        folder = f"{data}/views/{self._run.pixels(self._scheme(wildcards))}"
        return {"views": [f"{folder}/{shard}.npz" for shard in self._run.plan.shards]}

    def _simulated(self, data: str) -> dict[str, str | list[str]]:
        """Return configuration, clouds and, if effects need them, occluders of a data set's run."""
        subtypes = self._run.subtypes
        files: dict[str, str | list[str]] = {
            "dataset": f"{data}/config.yaml",
            "clouds": [f"{data}/clouds/{subtype}.npz" for subtype in subtypes],
        }
        if needs_surfaces(self._config["effects"]):
            files["occluders"] = [f"{data}/occluders/{subtype}.npz" for subtype in subtypes]
        return files

    def backbone_file(self, wildcards: Any) -> list[str]:
        """Return the user's file that defines the backbone of a job's scheme.

        The list is empty if a library defines it.
        """
        name = self._run.own_backbone(self._scheme(wildcards))
        if not name:
            return []
        file, _ = file_and_function(name)
        return [file]

    def training(self, wildcards: Any) -> str:
        """Return the settings of a training, with its scheme and its seed.

        The seed is that of the job, or the run's if the job has no wildcard `train_seed`.
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
        """Return the settings with which a trained network predicts."""
        return text(**self._config["recognition"]["evaluation"])

    def backbone(self, wildcards: Any) -> list[str]:
        """Return the option that names the user's code of the backbone of a job's scheme.

        The list is empty if the backbone is a library's.
        """
        name = self._run.own_backbone(self._scheme(wildcards))
        if not name:
            return []
        return ["--backbone", name]

    def seed(self, wildcards: Any) -> str:
        """Return the run's seed, from which tables draw samples for their intervals."""
        return text(seed=self._config["seed"])

    def transferred(self, wildcards: Any) -> list[str]:
        """Return the names of this run and of the runs whose models are tested on its samples.

        Raises: InputError naming a run that is missing, or that lacks a training of this run.
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
