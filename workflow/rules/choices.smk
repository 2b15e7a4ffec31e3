# Choices: recipes tried on validation alone, with subtypes held out of those that the unseen protocol trains on.
# REQUIRED INPUTS: results/{run}/views/{size}/seen-train-*.npz and seen-val-*.npz; no shard that a table tests on
# OUTPUTS: results/{run}/choices/{candidate}/{fold}-{train_seed}/predictions.csv, results/{run}/choices.csv and
#          results/{run}/choices_subtypes.csv


rule trial:
    input:
        code=code("lowalt.recognition.trial", "lowalt.recognition.choose"),
        views=products.trial_views,
        extra=products.trial_extra,
        candidates="config/choices/default.yaml",
        schemes=config["recognition"]["table"],
    output:
        table="results/{run}/choices/{candidate}/{held}-{train_seed}/predictions.csv",
        about="results/{run}/choices/{candidate}/{held}-{train_seed}/predictions.json",
        model="results/{run}/choices/{candidate}/{held}-{train_seed}/model.pt",
    log:
        "results/{run}/logs/choices/{candidate}/{held}-{train_seed}.log",
    benchmark:
        "results/{run}/benchmarks/choices/{candidate}/{held}-{train_seed}.jsonl"
    conda:
        "../../envs/environment.yaml"
    threads: config["recognition"]["training"]["threads"]
    resources:
        gpu=int(RUN.launch.gpu),
    params:
        settings=settings.trial,
        stations=RUN.stations,
        extra=options.extra,
    shell:
        "python -m lowalt.recognition.trial --settings {params.settings:q} --views {input.views:q}"
        " {params.extra:q}"
        " --candidates {input.candidates:q} --candidate {wildcards.candidate:q} --fold {wildcards.held:q}"
        ' --schemes {input.schemes:q} --stations {params.stations:q} --out "$(dirname {output.table:q})" 2> {log:q}'


rule choices_tables:
    input:
        code=code("lowalt.recognition.choose"),
        predictions=products.trials,
    output:
        multiext("results/{run}/choices", ".csv", "_subtypes.csv"),
    log:
        "results/{run}/logs/choices.log",
    benchmark:
        "results/{run}/benchmarks/choices.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.seed,
    shell:
        "python -m lowalt.recognition.choose --settings {params.settings:q} --predictions {input.predictions:q}"
        " --out results/{wildcards.run:q} 2> {log:q}"
