# Echo: the clean symbol-domain signals that one base station hears of a chunk's motion models.
# REQUIRED INPUTS: results/{run}/motion/{group}-{part}.csv, results/{run}/clouds/*.npz
# OUTPUTS: results/{run}/echo/{group}-{part}/{station}.npy, complex64 (models, symbols)


rule echo:
    input:
        code=code("lowalt.echo"),
        motion="results/{run}/motion/{group}-{part}.csv",
        clouds=group_clouds,
    output:
        "results/{run}/echo/{group}-{part}/{station}.npy",
    log:
        "results/{run}/logs/echo/{group}-{part}-{station}.log",
    benchmark:
        "results/{run}/benchmarks/echo/{group}-{part}-{station}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=canonical({"network": config["network"], "tolerance": config["echo"]["tolerance"]}),
    shell:
        "python -m lowalt.echo --settings {params.settings:q} --motion {input.motion:q} --clouds {input.clouds:q}"
        " --station {wildcards.station} --out {output:q} 2> {log:q}"
