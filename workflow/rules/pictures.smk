# The pictures of the README, copied from a full run. Asked for by name, because they stand in version control.


rule pictures:
    """Pictures of the README from the present results."""
    input:
        f"{R}/figures/animation.gif",
        f"{R}/figures/fig24.png",
    params:
        folder="docs/pictures",
    log:
        f"{R}/logs/pictures.log",
    benchmark:
        f"{R}/benchmarks/pictures.tsv"
    message:
        "Pictures of the README"
    shell:
        "cp {input} {params.folder} > {log} 2>&1"
