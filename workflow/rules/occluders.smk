# Occluders: the opaque surfaces of a subtype, made only for scenes whose effects need them.
# REQUIRED INPUTS: as the cloud of the subtype
# OUTPUTS: results/{run}/occluders/{subtype}.npz


rule occluders:
    input:
        code=code("lowalt.targets.occluders"),
        files=targets.record_files,
    output:
        "results/{run}/occluders/{subtype}.npz",
    log:
        "results/{run}/logs/occluders/{subtype}.log",
    benchmark:
        "results/{run}/benchmarks/occluders/{subtype}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=targets.settings,
    shell:
        "python -m lowalt.targets.occluders --settings {params.settings:q} --out {output:q}"
        " 2> {log:q}"
