# Report: one self-contained page of the run, and the table of what each stage took.
# REQUIRED INPUTS: the recognition tables, the shards' index, all clouds, one motion table, every job's benchmark,
#                  where report.cost says so what accuracy costs, and where report.effects does what effects do
# OUTPUTS: results/{run}/report.html, results/{run}/stages.csv


rule report:
    input:
        code=code("lowalt.report"),
        page="src/lowalt/report/page.html",
        published=config["report"]["published"],
        tables=multiext("results/{run}/", *TABLES, "seeds.csv", "ranges.csv", "aspects.csv"),
        index=DATA + "/shards/index.json",
        configuration="results/{run}/config.yaml",
        clouds=expand(DATA + "/clouds/{subtype}.npz", subtype=RUN.subtypes),
        gallery=DATA + "/clouds.png",
        motion=f"{DATA}/motion/{RUN.plan.chunks[0]}.csv",
        distances=DATA + "/distances.csv",
        transfer=["results/{run}/transfer.csv"] if config["recognition"]["transfer"] else [],
        accuracy=config["report"]["accuracy"] or [],
        benchmarks=products.benchmarks,
        cost=products.cost,
        effects=products.effects,
    output:
        page="results/{run}/report.html",
        stages="results/{run}/stages.csv",
    log:
        "results/{run}/logs/report.log",
    conda:
        "../../envs/environment.yaml"
    params:
        settings=settings.report,
        tables=options.recognition,
        cost=options.cost,
        effects=options.effects,
    shell:
        "python -m lowalt.report --settings {params.settings:q} --accuracy results/{wildcards.run}/accuracy.csv"
        " --published {input.published:q} --confusion results/{wildcards.run}/confusion.csv"
        " --subtypes results/{wildcards.run}/subtypes.csv --comparisons results/{wildcards.run}/comparisons.csv"
        " --index {input.index:q} --clouds {input.clouds:q} --gallery {input.gallery:q} --motion {input.motion:q}"
        " --seeds results/{wildcards.run}/seeds.csv --ranges results/{wildcards.run}/ranges.csv"
        " --aspects results/{wildcards.run}/aspects.csv {params.tables}"
        " --benchmarks {input.benchmarks:q} {params.cost} {params.effects} --stages {output.stages:q} --out {output.page:q} 2> {log:q}"
