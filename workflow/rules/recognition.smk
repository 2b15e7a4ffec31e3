# Recognition: freeze the simulated data, train every scheme in its protocols, predict, and make
# the tables.
# REQUIRED INPUTS: results/{run}/shards/index.json and its shards, all clouds and motion tables
# OUTPUTS: results/{run}/models/, results/{run}/predictions/, results/{run}/accuracy.csv and its
#          companions; where the configuration names other runs, results/{run}/transfer.csv: their
#          models on this run's test samples
from lowalt.workflow.stages.recognition import RecognitionStage

recognition = UserErrorsInOneLine(RecognitionStage(RUN))


rule views:
    input:
        code=code("lowalt.recognition", "lowalt.recognition.views"),
        # All that is read of the index follows from the shard and from `render`; it grows where
        # chunks are added.
        index=ancient("results/{run}/shards/index.json"),
        shard="results/{run}/shards/{group}-{fold}-{part}{piece}.tar",
        reduced=branch(
            recognition.is_made_by_tiles_stage,
            then="results/{run}/reduced/{size}/{group}-{part}.npy",
        ),
        motion=branch(
            recognition.is_made_by_tiles_stage,
            then=expand("results/{{run}}/motion/{source}.csv", source=recognition.source),
        ),
    output:
        "results/{run}/views/{size}/{group}-{fold}-{part}{piece}.npz",
    log:
        "results/{run}/logs/views/{size}/{group}-{fold}-{part}{piece}.log",
    benchmark:
        "results/{run}/benchmarks/views/{size}/{group}-{fold}-{part}{piece}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=recognition.view_settings,
        render=shards.index_settings,
        reduced=given("reduced", "motion"),
    shell:
        "python -m lowalt.recognition views --settings {params.settings:q} --index {input.index:q}"
        " --shard {wildcards.group:q}-{wildcards.fold:q}-{wildcards.part:q}{wildcards.piece:q}.tar"
        " {params.reduced:q} --out {output:q} 2> {log:q}"


rule freeze:
    input:
        code=code("lowalt.recognition", "lowalt.recognition.freeze"),
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=RUN.subtypes),
        motion=expand("results/{{run}}/motion/{chunk}.csv", chunk=RUN.plan.sources),
    output:
        "results/{run}/SHA256SUMS",
    log:
        "results/{run}/logs/freeze.log",
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.recognition freeze --settings '{{}}'"
        " --files {input.clouds:q} {input.motion:q} --out {output:q} 2> {log:q}"


rule distances:
    input:
        code=code("lowalt.recognition", "lowalt.recognition.distances"),
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=RUN.subtypes),
        motion=expand("results/{{run}}/motion/{chunk}.csv", chunk=recognition.first_chunks),
    output:
        "results/{run}/distances.csv",
    log:
        "results/{run}/logs/distances.log",
    benchmark:
        "results/{run}/benchmarks/distances.jsonl"
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.recognition distances --settings '{{}}' --clouds {input.clouds:q}"
        " --motion {input.motion:q} --out {output:q} 2> {log:q}"


rule train:
    input:
        unpack(recognition.samples),
        code=code(
            "lowalt.recognition",
            "lowalt.recognition.runs",
            "lowalt.recognition.sample_sources",
            "lowalt.recognition.freeze",
        ),
        frozen=f"{DATA}/SHA256SUMS",
        backbone=recognition.backbone_file,
    output:
        model="results/{run}/models/{protocol}/{scheme}/{train_seed}/model.safetensors",
        history="results/{run}/models/{protocol}/{scheme}/{train_seed}/history.csv",
    log:
        "results/{run}/logs/train/{protocol}/{scheme}/{train_seed}.log",
    benchmark:
        "results/{run}/benchmarks/train/{protocol}/{scheme}/{train_seed}.jsonl"
    # Trainings with more images take longer. Start the longest first, so that no core waits for it
    # at the end.
    priority: RUN.images_of_job
    conda:
        "../../envs/environment.yaml"
    threads: config["recognition"]["training"]["threads"]
    resources:
        gpu=RUN.gpus,
    params:
        settings=recognition.training,
        source=given("dataset", "views", "index"),
        events=["--tensorboard"] if config["recognition"]["tensorboard"] else [],
    shell:
        "python -m lowalt.recognition train --settings {params.settings:q} {params.source:q}"
        " --frozen {input.frozen:q} --protocol {wildcards.protocol:q}"
        ' {params.events:q} --out "$(dirname {output.model:q})" 2> {log:q}'


rule evaluate:
    input:
        unpack(recognition.samples),
        code=code(
            "lowalt.recognition",
            "lowalt.recognition.runs",
            "lowalt.recognition.sample_sources",
            "lowalt.recognition.freeze",
        ),
        frozen=f"{DATA}/SHA256SUMS",
        model="results/{run}/models/{protocol}/{scheme}/{train_seed}/model.safetensors",
    output:
        table="results/{run}/predictions/{protocol}/{scheme}/{train_seed}.csv",
        about="results/{run}/predictions/{protocol}/{scheme}/{train_seed}.json",
    log:
        "results/{run}/logs/evaluate/{protocol}/{scheme}/{train_seed}.log",
    benchmark:
        "results/{run}/benchmarks/evaluate/{protocol}/{scheme}/{train_seed}.jsonl"
    conda:
        "../../envs/environment.yaml"
    threads: config["recognition"]["evaluation"]["threads"]
    resources:
        gpu=RUN.gpus,
    params:
        settings=recognition.evaluation,
        source=given("dataset", "views", "index"),
        backbone=recognition.backbone,
    shell:
        "python -m lowalt.recognition evaluate --settings {params.settings:q} {params.source:q}"
        " --frozen {input.frozen:q} --model {input.model:q} {params.backbone:q}"
        " --out {output.table:q} 2> {log:q}"


rule tables:
    input:
        code=code("lowalt.recognition", "lowalt.recognition.tables"),
        predictions=expand("results/{{run}}/predictions/{training}.csv", training=RUN.trainings),
        about=expand("results/{{run}}/predictions/{training}.json", training=RUN.trainings),
        schemes=config["recognition"]["table"],
        published=config["report"]["published"],
    output:
        report(
            multiext(
                "results/{run}/",
                "accuracy.csv",
                "confusion.csv",
                "confusion_by_snr.csv",
                "subtypes.csv",
                "comparisons.csv",
                "orderings.csv",
                "alarms.csv",
                "calibration.csv",
                "seeds.csv",
                "seen_test.csv",
                "ranges.csv",
                "aspects.csv",
            ),
            caption="../report/tables.rst",
            category="Recognition",
        ),
    log:
        "results/{run}/logs/tables.log",
    benchmark:
        "results/{run}/benchmarks/tables.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=recognition.seed,
    shell:
        "python -m lowalt.recognition tables --settings {params.settings:q}"
        " --predictions {input.predictions:q} --published {input.published:q}"
        " --schemes {input.schemes:q} --out results/{wildcards.run:q} 2> {log:q}"


rule transfer_evaluate:
    input:
        unpack(recognition.samples),
        code=code(
            "lowalt.recognition",
            "lowalt.recognition.runs",
            "lowalt.recognition.sample_sources",
            "lowalt.recognition.freeze",
        ),
        frozen=f"{DATA}/SHA256SUMS",
        model="results/{other}/models/{protocol}/{scheme}/{train_seed}/model.safetensors",
    output:
        table="results/{run}/transfer/{other}/{protocol}/{scheme}/{train_seed}.csv",
        about="results/{run}/transfer/{other}/{protocol}/{scheme}/{train_seed}.json",
    log:
        "results/{run}/logs/transfer/{other}/{protocol}/{scheme}/{train_seed}.log",
    benchmark:
        "results/{run}/benchmarks/transfer/{other}/{protocol}/{scheme}/{train_seed}.jsonl"
    conda:
        "../../envs/environment.yaml"
    threads: config["recognition"]["evaluation"]["threads"]
    resources:
        gpu=RUN.gpus,
    params:
        settings=recognition.evaluation,
        source=given("dataset", "views", "index"),
        backbone=recognition.backbone,
    shell:
        "python -m lowalt.recognition evaluate --settings {params.settings:q} {params.source:q}"
        " --frozen {input.frozen:q} --model {input.model:q} {params.backbone:q}"
        " --trained-on {wildcards.other:q} --out {output.table:q} 2> {log:q}"


rule transfer:
    input:
        code=code("lowalt.recognition", "lowalt.recognition.transfer"),
        own=expand("results/{{run}}/predictions/{training}.csv", training=RUN.trainings),
        own_about=expand("results/{{run}}/predictions/{training}.json", training=RUN.trainings),
        other=expand(
            "results/{{run}}/transfer/{other}/{training}.csv",
            other=config["recognition"]["transfer"],
            training=RUN.trainings,
        ),
        other_about=expand(
            "results/{{run}}/transfer/{other}/{training}.json",
            other=config["recognition"]["transfer"],
            training=RUN.trainings,
        ),
        configs=expand("results/{other}/config.yaml", other=recognition.transferred),
        schemes=config["recognition"]["table"],
    output:
        report(
            "results/{run}/transfer.csv", caption="../report/transfer.rst", category="Recognition"
        ),
    log:
        "results/{run}/logs/transfer.log",
    benchmark:
        "results/{run}/benchmarks/transfer.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=recognition.seed,
    shell:
        "python -m lowalt.recognition transfer --settings {params.settings:q} --own {input.own:q}"
        " --other {input.other:q} --configs {input.configs:q} --schemes {input.schemes:q}"
        " --out {output:q} 2> {log:q}"
