# Echo in a scene with effects: the signals at one base station, or at all in one job, and the
# powers of the targets' own echoes.
# REQUIRED INPUTS: results/{run}/motion/{group}-{part}.csv, results/{run}/clouds/*.npz;
#                  results/{run}/occluders/*.npz where the scene hides points behind surfaces; the
#                  files that effects read
# OUTPUTS: results/{run}/echo/{group}-{part}/{station}.npy, complex64 (models, symbols), and
#          {station}.power.npy
from lowalt.workflow.stages.echo import EchoStage

echo = UserErrorsInOneLine(EchoStage(RUN))


rule echo_in_scene:
    input:
        code=code("lowalt.scene", *map(dotted, config["effects"])),
        motion="results/{run}/motion/{group}-{part}.csv",
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=echo.scene_subtypes),
        occluders=expand("results/{{run}}/occluders/{subtype}.npz", subtype=echo.opaque_subtypes),
        effect_files=echo.effect_files,
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
        settings=echo.settings_in_scene,
        occluders=given("occluders"),
        stations=echo.stations,
    shell:
        "python -m lowalt.scene --settings {params.settings:q} --motion {input.motion:q}"
        " --clouds {input.clouds:q} {params.occluders:q} --station {params.stations:q}"
        " --out {output.signals:q} --power {output.power:q} 2> {log:q}"
