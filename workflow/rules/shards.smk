# Shards: the samples of a chunk and fold in one WebDataset tar, the table of its samples next to it, and one index.
# REQUIRED INPUTS: motion table of a chunk; by kind its tiles and noisy signals, its noisy signals (for cubes with clouds and surfaces), or its clean echoes
# OUTPUTS: results/{run}/shards/{group}-{fold}-{part}{piece}.tar and .npz, results/{run}/shards/index.json,
#          and next to them the data card: README.md, samples.csv, croissant.json, SHA256SUMS


rule shard:
    input:
        unpack(products.shard_content),
        code=code("lowalt.shards", *options.shard_modules(config)),
        motion=products.motion,
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
        settings=settings.shard,
        content=options.content,
        piece=products.piece,
    shell:
        "python -m lowalt.shards write --settings {params.settings:q} --motion {input.motion:q}"
        " {params.content:q} --fold {wildcards.fold:q} {params.piece:q} --out {output.tar:q} 2> {log:q}"


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
        settings=settings.index,
    shell:
        "python -m lowalt.shards index --settings {params.settings:q} --shards {input.tars:q} --out {output:q} 2> {log:q}"


rule card:
    input:
        code=code("lowalt.shards.card"),
        template=products.card_template,
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
        "python -m lowalt.shards.card --index {input.index:q} --config {input.configuration:q} 2> {log:q}"


rule configuration:
    output:
        "results/{run}/config.yaml",
    log:
        "results/{run}/logs/configuration.log",
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.configuration,
    shell:
        "python -m lowalt.config.layers --settings {params.settings:q} --out {output:q} 2> {log:q}"
