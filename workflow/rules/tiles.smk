# Tiles: three spectra per station, nine images per sample, tiled 3 x 3 and encoded without loss.
# REQUIRED INPUTS: results/{run}/noisy/{group}-{part}.npy; the motion table where spectra know late symbols' instants,
#                  and with it clouds and surfaces where spectra show range cells
# OUTPUTS: results/{run}/tiles/{group}-{part}.npz, deleted once its shards are written, and for every size of tiles.reduced
#          results/{run}/reduced/{size}/{group}-{part}.npy


rule tiles:
    input:
        unpack(products.tile_content),
        code=code("lowalt.tiles", *options.tile_modules(config)),
        signals="results/{run}/noisy/{group}-{part}.npy",
    output:
        tiles=temp("results/{run}/tiles/{group}-{part}.npz"),
        reduced=expand(
            "results/{{run}}/reduced/{size}/{{group}}-{{part}}.npy",
            size=config["tiles"]["reduced"],
        ),
    log:
        "results/{run}/logs/tiles/{group}-{part}.log",
    benchmark:
        "results/{run}/benchmarks/tiles/{group}-{part}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.images,
        reduced=options.reduced,
        scene=options.scene,
    shell:
        "python -m lowalt.tiles --settings {params.settings:q} --signals {input.signals:q} {params.reduced:q}"
        " {params.scene:q} --out {output.tiles:q} 2> {log:q}"
