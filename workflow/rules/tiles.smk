# Tiles: three spectra a station, nine images a sample, tiled 3 x 3 and encoded without loss.
# REQUIRED INPUTS: results/{run}/noisy/{group}-{part}.npy
# OUTPUTS: results/{run}/tiles/{group}-{part}.npz, gone once its shards are written


rule tiles:
    input:
        code=code("lowalt.tiles"),
        signals="results/{run}/noisy/{group}-{part}.npy",
    output:
        temp("results/{run}/tiles/{group}-{part}.npz"),
    log:
        "results/{run}/logs/tiles/{group}-{part}.log",
    benchmark:
        "results/{run}/benchmarks/tiles/{group}-{part}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.images,
    shell:
        "python -m lowalt.tiles --settings {params.settings:q} --signals {input.signals:q} --out {output:q} 2> {log:q}"
