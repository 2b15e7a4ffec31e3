"""Input files of the remaining rules, derived from the plan of the run (data stages: `data_products`).

Each method takes the wildcards of a job and can be used in a rule's `input:`. No file is read here. A method checks
the existence of a file only if no rule of the run can make it.
"""

import json
from pathlib import Path
from typing import Any

from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.files.package_plan import PACKAGE
from lowalt.files.shipped import shipped
from lowalt.report.inputs import KEPT
from lowalt.workflow.data_products import DataProducts
from lowalt.workflow.sources import near

PRESETS = "config/cost/presets.csv"
"""The presets for the cost of recognition, some of which a study trains."""
REFERENCE = "results/reference"
PAGE = (".html", ".css", ".js")
"""Suffixes of the templates of the report."""
TABLES = (
    "accuracy.csv", "confusion.csv", "confusion_by_snr.csv", "subtypes.csv", "comparisons.csv", "orderings.csv",
    "alarms.csv", "calibration.csv",
)  # fmt: skip
"""Tables of recognition; their rows name a protocol and a scheme."""
PAGE_TABLES = ("accuracy", "confusion_by_snr", "subtypes", "comparisons", "orderings", "seeds")
"""Tables that the report shows."""


class Products(DataProducts):
    """Paths of the products of one run: those of its data set, of its trainings and of its report."""

    def samples(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Inputs of training and evaluation as configured: images reduced to the scheme's size, the index of the
        shards, or clouds for samples simulated on access."""
        base, scheme = f"results/{self._run.data}", self._run.schemes_by_slug[wildcards.scheme]
        if self._config["recognition"].get("input") == "dataset":
            return self._made()
        if not self._config["recognition"]["cache"]:
            return {"index": f"{base}/shards/index.json"}
        size = self._run.pixels(scheme)
        return {"views": [f"{base}/views/{size}/{shard}.npz" for shard in self._run.plan.shards]}

    def _made(self) -> dict[str, str | list[str]]:
        """Inputs for samples simulated on access: configuration, clouds, and surfaces for the effect `occlusion`."""
        base = f"results/{self._run.data}"
        clouds = [f"{base}/clouds/{subtype}.npz" for subtype in self._run.subtypes]
        surfaces = [path.replace("/clouds/", "/occluders/") for path in clouds]
        hidden = {"surfaces": surfaces} if "occlusion" in self._config["effects"] else {}
        return {"dataset": f"{base}/config.yaml", "clouds": clouds, **hidden}

    def training_samples(self, wildcards: Any) -> dict[str, str | list[str]]:
        """Inputs of one training: `samples`, and the user's file if it defines the scheme's backbone."""
        name = self._run.own_backbone(self._run.schemes_by_slug[wildcards.scheme])
        return self.samples(wildcards) | ({"backbone": name.rpartition(":")[0]} if name else {})

    def data(self, wildcards: Any) -> list[str]:
        """Files of the run's data set: shards, their tables, index and data card."""
        shards = [f"{shard}.{ending}" for shard in self._run.plan.shards for ending in ("tar", "npz")]
        return [f"results/{self._run.name}/shards/{name}" for name in ("index.json", "README.md", *shards)]

    def own_views(self, wildcards: Any) -> list[str]:
        """Images of this run's own samples, shrunk to the sizes of the schemes that are trained."""
        sizes, shards = self._run.image_sizes, self._run.plan.shards
        return [f"results/{self._run.name}/views/{size}/{shard}.npz" for size in sizes for shard in shards]

    def studied(self, wildcards: Any) -> list[str]:
        """Predictions of the presets that a study trains on this run's data, one per training seed.

        Raises: InputError naming the command that makes them, where one is missing.
        """
        paths = []
        for row in read_csv(shipped(PRESETS), "command", "predictions"):
            for seed in self._config["recognition"]["seeds"] if row["predictions"] else ():
                paths.append(f"results/{self._run.data}-{row['predictions']}/{seed}.csv")
                if not Path(paths[-1]).is_file():
                    raise InputError(f"no {paths[-1]}: `{row['command']}` makes it first")
        return paths

    def transferred(self, wildcards: Any) -> list[str]:
        """Configurations of this run and of the runs whose models are tested on its samples.

        Raises: InputError naming a run that is missing, or has not trained what this one trains.
        """
        others = self._config["recognition"]["transfer"]
        for other in others:
            names = ["config.yaml", *(f"models/{training}/model.safetensors" for training in self._run.trainings)]
            missing = [name for name in names if not Path(f"results/{other}/{name}").is_file()]
            if missing:
                raise InputError(
                    f"recognition.transfer: no results/{other}/{missing[0]}, expected a finished run {other!r} with "
                    "the schemes, protocols and seeds of this one"
                )
        return [f"results/{name}/config.yaml" for name in [wildcards.run, *others]]

    def report(self, wildcards: Any) -> dict[str, str | list[str]]:
        """The files of the report by the names of its manifest (`lowalt.report.inputs`)."""
        base, data, block = f"results/{wildcards.run}", f"results/{self._run.data}", self._config["report"]
        files: dict[str, str | list[str]] = {
            **{name: f"{base}/{name}.csv" for name in PAGE_TABLES},
            "published": block["published"],
            "index": f"{data}/shards/index.json",
            "clouds": [f"{data}/clouds/{subtype}.npz" for subtype in self._run.subtypes],
            "distances": f"{data}/distances.csv",
            "benchmarks": self.benchmarks(wildcards),
        }
        if self._config["recognition"]["transfer"]:
            files["transfer"] = f"{base}/transfer.csv"
        files |= {
            f"kept_{name}": str(shipped(f"{REFERENCE}/{file}"))
            for name, file in KEPT.items()
            if shipped(f"{REFERENCE}/{file}").is_file()
        }
        # A benchmark's data set has a kept table of baselines.
        baselines = shipped(f"{REFERENCE}/{self._run.data}/table.csv")
        if baselines.is_file():
            files["benchmark"] = str(baselines)
        if self._run.trainings:
            files["predictions"] = [f"{base}/predictions/{training}.csv" for training in self._run.trainings]
        asked = {"accuracy_cost": block["accuracy"], "echo_cost": block["cost"]}
        return files | {name: path for name, path in asked.items() if path}

    def manifest(self, wildcards: Any) -> str:
        """The files of the report as the JSON text of its manifest."""
        return json.dumps(self.report(wildcards), indent=1)

    def prepared(self, wildcards: Any) -> list[str]:
        """Files made without torch before the first training; empty if the data set is another run's."""
        run, base = self._run, f"results/{self._run.name}"
        if run.data != run.name:
            return []
        names = ["SHA256SUMS", "distances.csv", "clouds.png", "shards/README.md"]
        views = self.own_views(wildcards) if self._config["recognition"]["cache"] else []
        return [*(f"{base}/{name}" for name in names), *views]

    def card_template(self, wildcards: Any) -> str:
        """The text of the data card."""
        return near(PACKAGE / "shards/card.md.jinja")

    def page_templates(self, wildcards: Any) -> list[str]:
        """Templates, style and scripts of the report."""
        return [near(path) for path in sorted((PACKAGE / "report").rglob("*")) if path.suffix in PAGE]

    def data_benchmarks(self, wildcards: Any) -> list[str]:
        """Measurements of the jobs of the data set, in pipeline order."""
        run, plan = self._run, self._run.plan
        kind = self._config["shards"]["kind"]
        cached = self._config["recognition"]["cache"]
        sizes = run.image_sizes if cached else []
        echoes = [f"{chunk}-{station}" for chunk in plan.sources for station in run.stations]
        jobs = [
            *(f"cloud/{subtype}" for subtype in run.subtypes),
            *(f"motion/{chunk}" for chunk in plan.sources),
            *(f"echo/{name}" for name in (echoes if run.echo_per_station else plan.sources)),
            *(f"noise/{chunk}" for chunk in plan.chunks if kind != "recipe"),
            *(f"tiles/{chunk}" for chunk in plan.chunks if kind == "image"),
            *(f"shard/{shard}" for shard in plan.shards),
            "index",
            *(f"views/{size}/{shard}" for size in sizes for shard in plan.shards),
        ]
        return [f"results/{run.data}/benchmarks/{name}.jsonl" for name in jobs]

    def benchmarks(self, wildcards: Any) -> list[str]:
        """Measurements of all jobs, in pipeline order."""
        trainings, folder = self._run.trainings, f"results/{wildcards.run}/benchmarks"
        return [
            *self.data_benchmarks(wildcards),
            *(f"{folder}/{kind}/{training}.jsonl" for kind in ("train", "evaluate") for training in trainings),
            f"results/{self._run.data}/benchmarks/distances.jsonl",
            f"{folder}/tables.jsonl",
        ]
