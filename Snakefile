# lowalt: from records of targets to a benchmark and its report. One rule file a stage, in pipeline order.
from snakemake.utils import min_version

min_version("9.0")


configfile: "config/default.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/targets.smk"
include: "workflow/rules/motion.smk"
include: "workflow/rules/occluders.smk"
include: "workflow/rules/effects.smk" if config["effects"] else "workflow/rules/echo.smk"
include: "workflow/rules/noise.smk"
include: "workflow/rules/tiles.smk"
include: "workflow/rules/cost.smk"
include: "workflow/rules/shards.smk"
include: "workflow/rules/recognition.smk"
include: "workflow/rules/accuracy.smk"
include: "workflow/rules/effects_table.smk"
include: "workflow/rules/report.smk"


localrules:
    all,
    clouds,
    signals,
    data,
    models,
    accuracy,
    cost,
    effects,


onstart:
    space_check.before(workflow, PLAN, config)


onerror:
    space_check.after()


rule all:
    default_target: True
    input:
        f"results/{RUN}/report.html",
        f"results/{RUN}/accuracy.csv",
        f"results/{RUN}/shards/README.md",
        [f"results/{RUN}/transfer.csv"] if OTHERS else [],


rule clouds:
    input:
        expand("results/{run}/clouds/{subtype}.npz", run=RUN, subtype=SLUGS),
        f"results/{RUN}/clouds.png",


rule signals:
    input:
        expand("results/{run}/noisy/{chunk}.npy", run=RUN, chunk=PLAN.chunks),


rule data:
    input:
        f"results/{RUN}/shards/index.json",
        f"results/{RUN}/shards/README.md",


rule models:
    input:
        expand("results/{run}/models/{training}/model.pt", run=RUN, training=TRAININGS),
        f"results/{RUN}/config.yaml",


rule accuracy:
    input:
        f"results/{RUN}/accuracy_cost.csv",
        f"results/{RUN}/accuracy_cost.png",


rule cost:
    input:
        f"results/{RUN}/cost.csv",
        f"results/{RUN}/cost_pixels.csv",
        f"results/{RUN}/cost.png",


rule effects:
    input:
        f"results/{RUN}/effects.csv",
        f"results/{RUN}/effects.png",
