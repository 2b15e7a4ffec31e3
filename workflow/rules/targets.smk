# Targets: one calibration point cloud per subtype, from a built-in model, a mesh or a recording.
# REQUIRED INPUTS: config/targets.csv and the record files; the user's files where a record names
#                  one.
# OUTPUTS: results/{run}/clouds/{subtype}.npz, results/{run}/clouds.png
from lowalt.workflow.stages.targets import TargetsStage

targets = UserErrorsInOneLine(TargetsStage(RUN))


rule cloud:
    input:
        code=code("lowalt.targets"),
        files=targets.record_files,
    output:
        "results/{run}/clouds/{subtype}.npz",
    log:
        "results/{run}/logs/cloud/{subtype}.log",
    benchmark:
        "results/{run}/benchmarks/cloud/{subtype}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=targets.settings,
    shell:
        "python -m lowalt.targets --settings {params.settings:q} --out {output:q} 2> {log:q}"


rule gallery:
    input:
        code=code("lowalt.targets.gallery"),
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=RUN.subtypes),
    output:
        report("results/{run}/clouds.png", caption="../report/clouds.rst", category="Data set"),
    log:
        "results/{run}/logs/gallery.log",
    benchmark:
        "results/{run}/benchmarks/gallery.jsonl"
    conda:
        "../../envs/environment.yaml"
    shell:
        "python -m lowalt.targets.gallery --clouds {input.clouds:q} --out {output:q} 2> {log:q}"
