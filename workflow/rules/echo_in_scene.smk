# Echo in a scene with effects: the signals at one base station, or at all in one job, and the powers of the targets'
# own echoes.
# REQUIRED INPUTS: results/{run}/motion/{group}-{part}.csv, results/{run}/clouds/*.npz; results/{run}/occluders/*.npz
#                  where the scene hides points behind surfaces; the file of buildings that effects.town names
# OUTPUTS: results/{run}/echo/{group}-{part}/{station}.npy, complex64 (models, symbols), and {station}.power.npy


rule echo_in_scene:
    input:
        code=code("lowalt.scene", *map(dotted, config["effects"])),
        motion="results/{run}/motion/{group}-{part}.csv",
        clouds=products.scene_clouds,
        occluders=products.chunk_occluders,
        town=products.town,
    output:
        signals=expand("results/{{run}}/echo/{{group}}-{{part}}/{station}.npy", station=LISTENING),
        power=expand(
            "results/{{run}}/echo/{{group}}-{{part}}/{station}.power.npy", station=LISTENING
        ),
    log:
        f"results/{{run}}/logs/echo/{{group}}-{{part}}{OF_STATION}.log",
    benchmark:
        f"results/{{run}}/benchmarks/echo/{{group}}-{{part}}{OF_STATION}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.echo_in_scene,
        occluders=options.occluders,
        stations=products.listening,
    shell:
        "python -m lowalt.scene --settings {params.settings:q} --motion {input.motion:q} --clouds {input.clouds:q}"
        " {params.occluders:q} --station {params.stations:q} --out {output.signals:q} --power {output.power:q} 2> {log:q}"
