# Accuracy: what recognition accuracy costs in time, over the schemes trained and the networks only timed.
# REQUIRED INPUTS: predictions of the run in the unseen protocol; results/fidelity-exact/transfer.csv (`make accuracy`
#                  makes it first); a quiet machine
# OUTPUTS: results/{run}/speed/{scheme}.json, results/{run}/accuracy_cost.csv, results/{run}/accuracy_cost.png


rule speed:
    input:
        code=code("lowalt.measure.network_speed"),
        schemes=config["recognition"]["table"],
    output:
        "results/{run}/speed/{scheme}.json",
    log:
        "results/{run}/logs/speed/{scheme}.log",
    benchmark:
        "results/{run}/benchmarks/speed/{scheme}.jsonl"
    conda:
        "../../envs/environment.yaml"
    # All cores, so that nothing else runs beside what is timed.
    threads: workflow.cores or 1
    params:
        settings=training_settings,
    shell:
        "python -m lowalt.measure.network_speed --settings {params.settings:q} --scheme {wildcards.scheme}"
        " --schemes {input.schemes:q} --out {output:q} 2> {log:q}"


rule accuracy_table:
    input:
        code=code("lowalt.measure.accuracy_cost"),
        predictions=expand("results/{{run}}/predictions/{training}.csv", training=PRICED),
        about=expand("results/{{run}}/predictions/{training}.json", training=PRICED),
        speeds=expand("results/{{run}}/speed/{scheme}.json", scheme=BY_SCHEME),
        index="results/{run}/shards/index.json",
        fidelity="results/fidelity-exact/transfer.csv",
        schemes=config["recognition"]["table"],
    output:
        "results/{run}/accuracy_cost.csv",
    log:
        "results/{run}/logs/accuracy_table.log",
    benchmark:
        "results/{run}/benchmarks/accuracy_table.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=canonical({"seed": config["seed"]}),
    shell:
        "python -m lowalt.measure.accuracy_cost --settings {params.settings:q} --predictions {input.predictions:q}"
        " --speeds {input.speeds:q} --index {input.index:q} --fidelity {input.fidelity:q}"
        " --schemes {input.schemes:q} --out {output:q} 2> {log:q}"


rule accuracy_figure:
    input:
        code=code("lowalt.report.figures.accuracy_cost"),
        table="results/{run}/accuracy_cost.csv",
    output:
        "results/{run}/accuracy_cost.png",
    log:
        "results/{run}/logs/accuracy_figure.log",
    benchmark:
        "results/{run}/benchmarks/accuracy_figure.jsonl"
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.report.figures.accuracy_cost --table {input.table:q} --figure {output:q} 2> {log:q}"
