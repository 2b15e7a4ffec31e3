# Effects priced: what each effect costs and does, alone and together, on test samples of a run without effects.
# REQUIRED INPUTS: results/{run}/clouds/*.npz, results/{run}/motion/{group}-00000.csv, a model trained on the run
# OUTPUTS: results/{run}/effects/{group}-{call}.npz, results/{run}/effects.csv, results/{run}/effects.png


rule effect_samples:
    input:
        code=lambda wildcards: code("lowalt.measure.effects_samples", *calls.modules(wildcards.call)),
        motion="results/{run}/motion/{group}-00000.csv",
        clouds=products.group_clouds,
        occluders=products.call_occluders,
    output:
        "results/{run}/effects/{group}-{call}.npz",
    log:
        "results/{run}/logs/effects/{group}-{call}.log",
    benchmark:
        "results/{run}/benchmarks/effects/{group}-{call}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.effect_samples,
        occluders=options.occluders,
    shell:
        "python -m lowalt.measure.effects_samples --settings {params.settings:q} --motion {input.motion:q}"
        " --clouds {input.clouds:q} {params.occluders:q} --out {output:q} 2> {log:q}"


rule effects_table:
    input:
        code=code("lowalt.measure.effects_cost"),
        samples=products.call_samples,
        model=products.asked_model,
    output:
        report("results/{run}/effects.csv", caption="../report/effects.rst", category="Effects"),
    log:
        "results/{run}/logs/effects_table.log",
    benchmark:
        "results/{run}/benchmarks/effects_table.jsonl"
    conda:
        "../../envs/environment.yaml"
    threads: config["recognition"]["evaluation"]["threads"]
    params:
        settings=settings.effects_table,
        backbone=settings.backbone,
    shell:
        "python -m lowalt.measure.effects_cost --settings {params.settings:q} --samples {input.samples:q}"
        " --model {input.model:q} {params.backbone:q} --out {output:q} 2> {log:q}"


rule effects_figure:
    input:
        code=code("lowalt.report.figures.effects"),
        table="results/{run}/effects.csv",
        samples=products.call_samples,
    output:
        report("results/{run}/effects.png", caption="../report/effects.rst", category="Effects"),
    log:
        "results/{run}/logs/effects_figure.log",
    benchmark:
        "results/{run}/benchmarks/effects_figure.jsonl"
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.report.figures.effects --table {input.table:q} --samples {input.samples:q}"
        " --figure {output:q} 2> {log:q}"
