# Echo: the clean symbol-domain signals of a chunk's motion models at one base station, or at all
# in one job.
# REQUIRED INPUTS: results/{run}/motion/{group}-{part}.csv, results/{run}/clouds/*.npz
# OUTPUTS: results/{run}/echo/{group}-{part}/{station}.npy, complex64 (models, symbols)
from lowalt.workflow.stages.echo import EchoStage

echo = UserErrorsInOneLine(EchoStage(RUN))


rule echo:
    input:
        code=code("lowalt.echo"),
        motion="results/{run}/motion/{group}-{part}.csv",
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=echo.subtypes),
    output:
        expand("results/{{run}}/echo/{{group}}-{{part}}/{station}.npy", station=LISTENING),
    log:
        f"results/{{run}}/logs/echo/{{group}}-{{part}}{OF_STATION}.log",
    benchmark:
        f"results/{{run}}/benchmarks/echo/{{group}}-{{part}}{OF_STATION}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=echo.settings,
        stations=echo.stations,
    shell:
        "python -m lowalt.echo --settings {params.settings:q} --motion {input.motion:q}"
        " --clouds {input.clouds:q} --station {params.stations:q} --out {output:q} 2> {log:q}"
