# lowalt: from records of targets to a benchmark and its report. One rule file per stage, in
# pipeline order.
import sys

from snakemake.utils import min_version

min_version("9.23")


configfile: "config/default.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/targets.smk"
include: "workflow/rules/motion.smk"
include: "workflow/rules/occluders.smk"
include: "workflow/rules/echo_in_scene.smk" if config["effects"] else "workflow/rules/echo.smk"
include: "workflow/rules/noise.smk"
include: "workflow/rules/tiles.smk"
include: "workflow/rules/shards.smk"
include: "workflow/rules/recognition.smk"
include: "workflow/rules/cost.smk"
include: "workflow/rules/accuracy_cost.smk"
include: "workflow/rules/report.smk"


onstart:
    print(*filter(None, (RUN.sources, RUN.folding)), sep="\n", file=sys.stderr)
    with user_errors_in_one_line():
        space.before(workflow, RUN.plan, config)


rule all:
    default_target: True
    input:
        f"results/{RUN.name}/report.html",
        f"results/{RUN.name}/accuracy.csv",
        f"{DATA}/shards/README.md",
        f"{DATA}/clouds.png",
        [f"results/{RUN.name}/transfer.csv"] if config["recognition"]["transfer"] else [],
    localrule: True


rule clouds:
    input:
        expand("results/{run}/clouds/{subtype}.npz", run=RUN.name, subtype=RUN.subtypes),
        f"results/{RUN.name}/clouds.png",
    localrule: True


rule signals:
    input:
        expand("results/{run}/noisy/{chunk}.npy", run=RUN.name, chunk=RUN.plan.chunks),
    localrule: True


rule data:
    input:
        expand("results/{run}/shards/{file}", run=RUN.name, file=["index.json", "README.md"]),
        expand(
            "results/{run}/shards/{shard}.{ending}",
            run=RUN.name,
            shard=RUN.plan.shards,
            ending=["tar", "npz"],
        ),
    localrule: True


rule training_samples:
    input:
        OWN_VIEWS,
        f"results/{RUN.name}/SHA256SUMS",
        f"results/{RUN.name}/config.yaml",
    localrule: True


# Everything before the first training that needs no torch: `make` makes it while torch is being
# downloaded.
rule prepared:
    input:
        branch(
            RUN.data == RUN.name,
            then=[
                f"{DATA}/SHA256SUMS",
                f"{DATA}/distances.csv",
                f"{DATA}/clouds.png",
                f"{DATA}/shards/README.md",
            ],
        ),
        branch(RUN.data == RUN.name and config["recognition"]["cache"], then=OWN_VIEWS),
    localrule: True


rule models:
    input:
        expand(
            "results/{run}/models/{training}/model.safetensors",
            run=RUN.name,
            training=RUN.trainings,
        ),
        f"results/{RUN.name}/config.yaml",
    localrule: True


rule cost:
    input:
        f"results/{RUN.name}/cost.csv",
        f"results/{RUN.name}/cost.svg",
    localrule: True


rule accuracy_cost:
    input:
        f"results/{RUN.name}/accuracy_cost.csv",
        f"results/{RUN.name}/accuracy_cost.svg",
    localrule: True
