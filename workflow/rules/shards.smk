# Shards: the samples of a chunk and fold in one WebDataset tar, the table of its samples next to
# it, and one index.
# REQUIRED INPUTS: motion table of a chunk; by kind its tiles and noisy signals, its noisy signals
#                  (for cubes with clouds and surfaces), or its clean echoes
# OUTPUTS: results/{run}/shards/{group}-{fold}-{part}{piece}.tar and .npz,
#          results/{run}/shards/index.json, and next to them the data card: README.md, samples.csv,
#          croissant.json, SHA256SUMS
from lowalt.workflow.stages.shards import ShardsStage

shards = UserErrorsInOneLine(ShardsStage(RUN))


rule shard:
    input:
        code=code("lowalt.shards", *shards.modules),
        motion=expand("results/{{run}}/motion/{source}.csv", source=shards.source),
        signals=branch(shards.kind != "recipe", then="results/{run}/noisy/{group}-{part}.npy"),
        tiles=branch(shards.kind == "image", then="results/{run}/tiles/{group}-{part}.npz"),
        echoes=branch(
            shards.kind == "recipe",
            then=expand(
                "results/{{run}}/echo/{source}/{station}.npy",
                source=shards.source,
                station=RUN.stations,
            ),
        ),
        powers=branch(
            shards.kind == "recipe",
            then=expand(
                "results/{{run}}/echo/{source}/{station}.power.npy",
                source=shards.source,
                station=shards.power_stations,
            ),
        ),
        clouds=branch(
            shards.kind == "cube",
            then=expand("results/{{run}}/clouds/{subtype}.npz", subtype=shards.scene_subtypes),
        ),
        occluders=branch(
            shards.kind == "cube",
            then=expand("results/{{run}}/occluders/{subtype}.npz", subtype=shards.opaque_subtypes),
        ),
        effect_files=shards.effect_files,
    output:
        tar="results/{run}/shards/{group}-{fold}-{part}{piece}.tar",
        table="results/{run}/shards/{group}-{fold}-{part}{piece}.npz",
    log:
        "results/{run}/logs/shard/{group}-{fold}-{part}{piece}.log",
    benchmark:
        "results/{run}/benchmarks/shard/{group}-{fold}-{part}{piece}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=shards.settings,
        content=given("signals", "tiles", "echoes", "powers", "clouds", "occluders"),
        piece=shards.piece,
    shell:
        "python -m lowalt.shards write --settings {params.settings:q} --motion {input.motion:q}"
        " {params.content:q} --fold {wildcards.fold:q} {params.piece:q} --out {output.tar:q}"
        " 2> {log:q}"


rule index:
    input:
        code=code("lowalt.shards"),
        tars=expand("results/{{run}}/shards/{shard}.tar", shard=RUN.plan.shards),
        tables=expand("results/{{run}}/shards/{shard}.npz", shard=RUN.plan.shards),
    output:
        "results/{run}/shards/index.json",
    log:
        "results/{run}/logs/index.log",
    benchmark:
        "results/{run}/benchmarks/index.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=shards.index_settings,
    shell:
        "python -m lowalt.shards index --settings {params.settings:q} --shards {input.tars:q}"
        " --out {output:q} 2> {log:q}"


rule card:
    input:
        code=code("lowalt.shards.card"),
        template=shards.card_template,
        index="results/{run}/shards/index.json",
        configuration="results/{run}/config.yaml",
    output:
        multiext(
            "results/{run}/shards/", "README.md", "samples.csv", "croissant.json", "SHA256SUMS"
        ),
    log:
        "results/{run}/logs/card.log",
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.shards.card --index {input.index:q} --config {input.configuration:q}"
        " 2> {log:q}"


rule configuration:
    output:
        "results/{run}/config.yaml",
    log:
        "results/{run}/logs/configuration.log",
    conda:
        "../../envs/environment.yaml"
    params:
        settings=shards.configuration,
    shell:
        "python -m lowalt.config.layers --settings {params.settings:q} --out {output:q} 2> {log:q}"
