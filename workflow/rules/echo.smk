# Echo: the clean symbol-domain signals that every base station hears of a chunk's motion models, a file a station.
# REQUIRED INPUTS: results/{run}/motion/{group}-{part}.csv, results/{run}/clouds/*.npz
# OUTPUTS: results/{run}/echo/{group}-{part}/*.npy, one a station, complex64 (models, symbols)


rule echo:
    input:
        code=code("lowalt.echo"),
        motion="results/{run}/motion/{group}-{part}.csv",
        clouds=group_clouds,
    output:
        expand("results/{{run}}/echo/{{group}}-{{part}}/{station}.npy", station=STATIONS),
    log:
        "results/{run}/logs/echo/{group}-{part}.log",
    benchmark:
        "results/{run}/benchmarks/echo/{group}-{part}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        stations=STATIONS,
        settings=canonical({"network": config["network"], "tolerance": config["echo"]["tolerance"]}),
    shell:
        "python -m lowalt.echo --settings {params.settings:q} --motion {input.motion:q} --clouds {input.clouds:q}"
        " --station {params.stations:q} --out {output:q} 2> {log:q}"
