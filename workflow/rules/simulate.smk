rule warm_up:
    """Compile the kernels once: parallel jobs on a cold cache would each compile them."""
    output:
        KERNELS,
    params:
        rig=CONFIG.rig,
    log:
        f"{R}/logs/warm_up.log",
    benchmark:
        f"{R}/benchmarks/warm_up.tsv"
    message:
        "Compiling the kernels"
    script:
        "../scripts/warm_up.py"


rule simulate:
    """One run: settle, start, record."""
    input:
        SIMULATOR,
        rig=CONFIG.rig,
        kernels=KERNELS,
    output:
        recording=f"{R}/runs/{{run}}.npz",
        cost=f"{R}/runs/{{run}}.cost.json",
    params:
        scene=scene_parameters,
    log:
        f"{R}/logs/simulate/{{run}}.log",
    benchmark:
        f"{R}/benchmarks/simulate/{{run}}.tsv"
    message:
        "Simulating {wildcards.run}"
    script:
        "../scripts/simulate.py"
