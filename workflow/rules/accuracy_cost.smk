# Accuracy: recognition accuracy against computing time, for trained schemes and for networks that
# are only timed.
# REQUIRED INPUTS: predictions of the run in the unseen protocol; those of the presets that a study
#                  trains (`make accuracy-cost` does all); a quiet machine
# OUTPUTS: results/{run}/speed/{scheme}.json, results/{run}/accuracy_cost.csv,
#          results/{run}/accuracy_cost.svg
from lowalt.workflow.stages.accuracy_cost import AccuracyCostStage

accuracy_cost = UserErrorsInOneLine(AccuracyCostStage(RUN))


rule speed:
    input:
        code=code("lowalt.measure.network_speed"),
    output:
        "results/{run}/speed/{scheme}.json",
    log:
        "results/{run}/logs/speed/{scheme}.log",
    benchmark:
        "results/{run}/benchmarks/speed/{scheme}.jsonl"
    conda:
        "../../envs/environment.yaml"
    # Reserve all cores, so that nothing else runs during the timing.
    threads: workflow.cores or 1
    params:
        settings=recognition.training,
    shell:
        "python -m lowalt.measure.network_speed --settings {params.settings:q} --out {output:q}"
        " 2> {log:q}"


rule accuracy_cost_table:
    input:
        code=code("lowalt.measure.accuracy_cost"),
        predictions=expand("results/{{run}}/predictions/{training}.csv", training=RUN.priced),
        studied=accuracy_cost.studied,
        about=expand("results/{{run}}/predictions/{training}.json", training=RUN.priced),
        speeds=expand("results/{{run}}/speed/{scheme}.json", scheme=RUN.schemes_by_slug),
        index=f"{DATA}/shards/index.json",
        data_jobs=expand(f"{DATA}/benchmarks/{{job}}.jsonl", job=accuracy_cost.data_jobs),
        presets=accuracy_cost.presets,
        schemes=config["recognition"]["table"],
    output:
        report(
            "results/{run}/accuracy_cost.csv",
            caption="../report/accuracy_cost.rst",
            category="Cost",
        ),
    log:
        "results/{run}/logs/accuracy_cost_table.log",
    benchmark:
        "results/{run}/benchmarks/accuracy_cost_table.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=recognition.seed,
    shell:
        "python -m lowalt.measure.accuracy_cost --settings {params.settings:q}"
        " --predictions {input.predictions:q} {input.studied:q} --speeds {input.speeds:q}"
        " --data-jobs {input.data_jobs:q} --index {input.index:q} --presets {input.presets:q}"
        " --schemes {input.schemes:q} --out {output:q} 2> {log:q}"


rule accuracy_cost_figure:
    input:
        code=code("lowalt.report.figures.cost_plots"),
        table="results/{run}/accuracy_cost.csv",
    output:
        report(
            "results/{run}/accuracy_cost.svg",
            caption="../report/accuracy_cost.rst",
            category="Cost",
        ),
    log:
        "results/{run}/logs/accuracy_cost_figure.log",
    benchmark:
        "results/{run}/benchmarks/accuracy_cost_figure.jsonl"
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.report.figures.cost_plots recognition --table {input.table:q}"
        " --figure {output:q} 2> {log:q}"
