# Tiles: three spectra per station, nine images per sample, tiled 3 x 3 and encoded without loss.
# REQUIRED INPUTS: results/{run}/noisy/{group}-{part}.npy; the motion table where spectra know late
#                  symbols' instants, and with it clouds and surfaces where spectra show range
#                  cells
# OUTPUTS: results/{run}/tiles/{group}-{part}.npz, deleted once its shards are written, and for
#          every size of tiles.reduced results/{run}/reduced/{size}/{group}-{part}.npy
from lowalt.workflow.stages.tiles import TilesStage

tiles = UserErrorsInOneLine(TilesStage(RUN))


rule tiles:
    input:
        code=code("lowalt.tiles", *tiles.modules),
        signals="results/{run}/noisy/{group}-{part}.npy",
        motion=branch(
            tiles.reads_motion,
            then=expand("results/{{run}}/motion/{source}.csv", source=tiles.source),
        ),
        clouds=branch(
            tiles.shows_cells,
            then=expand("results/{{run}}/clouds/{subtype}.npz", subtype=tiles.scene_subtypes),
        ),
        occluders=branch(
            tiles.shows_cells,
            then=expand("results/{{run}}/occluders/{subtype}.npz", subtype=tiles.opaque_subtypes),
        ),
        effect_files=tiles.effect_files if tiles.shows_cells else [],
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
        settings=tiles.settings,
        reduced=tiles.reduced,
        scene=given("motion", "clouds", "occluders"),
    shell:
        "python -m lowalt.tiles --settings {params.settings:q} --signals {input.signals:q}"
        " {params.reduced:q} {params.scene:q} --out {output.tiles:q} 2> {log:q}"
