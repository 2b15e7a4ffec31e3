# Report: one self-contained page of the run, and the table of the time that each stage took.
# REQUIRED INPUTS: the recognition tables, the shards' index, all clouds, one motion table, every
#                  job's benchmark; where report.cost says so the echo's cost
# OUTPUTS: results/{run}/report.json (its manifest), results/{run}/report.html,
#          results/{run}/stages.csv, results/{run}/figures (each plot as SVG and CSV)
from lowalt.workflow.stages.report import ReportStage

page = UserErrorsInOneLine(ReportStage(RUN))


rule report_manifest:
    output:
        "results/{run}/report.json",
    log:
        "results/{run}/logs/report_manifest.log",
    localrule: True
    conda:
        "../../envs/environment.yaml"
    params:
        manifest=page.manifest,
    shell:
        "printf '%s\\n' {params.manifest:q} > {output:q} 2> {log:q}"


rule report:
    input:
        unpack(page.files),
        code=code("lowalt.report"),
        templates=page.templates,
        added=page.added_sections,
        configuration="results/{run}/config.yaml",
        manifest="results/{run}/report.json",
    output:
        page=report("results/{run}/report.html", caption="../report/report.rst", category="Run"),
        stages="results/{run}/stages.csv",
        figures=directory("results/{run}/figures"),
    log:
        "results/{run}/logs/report.log",
    conda:
        "../../envs/environment.yaml"
    threads: 2
    params:
        settings=page.settings,
    shell:
        "python -m lowalt.report --settings {params.settings:q} --manifest {input.manifest:q}"
        " --jobs {threads} --stages {output.stages:q} --figures {output.figures:q}"
        " --out {output.page:q} 2> {log:q}"
