# Noise: complex white Gaussian noise at every SNR of the set, independent from station to station
# and SNR to SNR.
# REQUIRED INPUTS: motion table and echoes of the chunk
# OUTPUTS: results/{run}/noisy/{group}-{part}.npy, complex64 (models, snrs, stations, symbols)
from lowalt.workflow.stages.noise import NoiseStage

noise = UserErrorsInOneLine(NoiseStage(RUN))


rule noise:
    input:
        code=code("lowalt.noise", *noise.modules),
        motion=expand("results/{{run}}/motion/{source}.csv", source=noise.source),
        echoes=expand(
            "results/{{run}}/echo/{source}/{station}.npy",
            source=noise.source,
            station=RUN.stations,
        ),
        powers=expand(
            "results/{{run}}/echo/{source}/{station}.power.npy",
            source=noise.source,
            station=noise.power_stations,
        ),
    output:
        "results/{run}/noisy/{group}-{part}.npy",
    log:
        "results/{run}/logs/noise/{group}-{part}.log",
    benchmark:
        "results/{run}/benchmarks/noise/{group}-{part}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=noise.settings,
        powers=given("powers"),
    shell:
        "python -m lowalt.noise --settings {params.settings:q} --motion {input.motion:q}"
        " --echoes {input.echoes:q} {params.powers:q} --out {output:q} 2> {log:q}"
