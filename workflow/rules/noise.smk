# Noise: complex white Gaussian noise at every SNR of the set, independent from station to station and SNR to SNR.
# REQUIRED INPUTS: motion table and echoes of the chunk
# OUTPUTS: results/{run}/noisy/{group}-{part}.npy, complex64 (models, snrs, stations, symbols)


rule noise:
    input:
        code=code("lowalt.noise", *options.noise_modules(config)),
        motion=products.motion,
        echoes=products.chunk_echoes,
        powers=products.chunk_powers,
    output:
        "results/{run}/noisy/{group}-{part}.npy",
    log:
        "results/{run}/logs/noise/{group}-{part}.log",
    benchmark:
        "results/{run}/benchmarks/noise/{group}-{part}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.noise,
        powers=options.powers,
    shell:
        "python -m lowalt.noise --settings {params.settings:q} --motion {input.motion:q}"
        " --echoes {input.echoes:q} {params.powers:q} --out {output:q} 2> {log:q}"
