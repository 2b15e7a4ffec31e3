# Motion: the table of motion models of one chunk, one row per model (per look where motion.looks
# asks for tracks), every parameter drawn from its own stream.
# REQUIRED INPUTS: results/{run}/clouds/*.npz of the chunk's subtypes; the flight log that
#                  motion.track names
# OUTPUTS: results/{run}/motion/{group}-{part}.csv
from lowalt.workflow.stages.motion import MotionStage

motion = UserErrorsInOneLine(MotionStage(RUN))


rule motion:
    input:
        code=code("lowalt.motion"),
        clouds=expand("results/{{run}}/clouds/{subtype}.npz", subtype=motion.subtypes),
        track=motion.track,
    output:
        "results/{run}/motion/{group}-{part}.csv",
    log:
        "results/{run}/logs/motion/{group}-{part}.log",
    benchmark:
        "results/{run}/benchmarks/motion/{group}-{part}.jsonl"
    conda:
        "../../envs/environment.yaml"
    params:
        settings=motion.settings,
        span=motion.span,
    shell:
        "python -m lowalt.motion --settings {params.settings:q} --clouds {input.clouds:q}"
        " --group {wildcards.group:q} {params.span:q} --out {output:q} 2> {log:q}"
