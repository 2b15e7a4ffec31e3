# Cost: error of the echo against computing time, with one cloud per category.
# REQUIRED INPUTS: results/{run}/clouds/*.npz of those subtypes; a quiet machine (nothing else of
#                  this workflow runs meanwhile)
# OUTPUTS: results/{run}/cost.csv, results/{run}/cost.svg
from lowalt.workflow.stages.cost import CostStage

cost = UserErrorsInOneLine(CostStage(RUN))


rule cost_table:
    input:
        code=code("lowalt.measure.echo_cost"),
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=cost.first_subtypes),
    output:
        "results/{run}/cost.csv",
    log:
        "results/{run}/logs/cost.log",
    benchmark:
        "results/{run}/benchmarks/cost.jsonl"
    conda:
        "../../envs/environment.yaml"
    threads: workflow.cores
    params:
        settings=cost.settings,
    shell:
        "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python -m lowalt.measure.echo_cost"
        " --settings {params.settings:q} --clouds {input.clouds:q} --out {output:q} 2> {log:q}"


rule cost_figure:
    input:
        code=code("lowalt.report.figures.cost_plots"),
        table="results/{run}/cost.csv",
    output:
        report("results/{run}/cost.svg", caption="../report/cost.rst", category="Cost"),
    log:
        "results/{run}/logs/cost_figure.log",
    benchmark:
        "results/{run}/benchmarks/cost_figure.jsonl"
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.report.figures.cost_plots echo --table {input.table:q}"
        " --figure {output:q} 2> {log:q}"
