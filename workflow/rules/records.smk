# Sect. 5: metrics of every run, Table 1 and 3, Figures 15, 17, 18, the loop.

LETTERS = dict(zip("abcdefgh", CONFIG.records.speeds_rpm))


rule metrics:
    """One row a run: the numbers that tables, figures and claims are made of."""
    input:
        needs("metrics.py"),
        recordings=recordings(SCENES),
    output:
        csv=f"{R}/metrics.csv",
        schema=f"{R}/metrics.schema.json",
    params: runs=list(SCENES)
    log: f"{R}/logs/metrics.log"
    message: "Measuring {output.csv}"
    script: "../scripts/metrics.py"


use rule metrics as metrics_other with:
    input:
        needs("metrics.py"),
        recordings=lambda wildcards: recordings(OTHERS[wildcards.other], f"rigs/{wildcards.other}/"),
    output:
        csv=f"{R}/rigs/{{other}}/metrics.csv",
        schema=f"{R}/rigs/{{other}}/metrics.schema.json",
    params: runs=lambda wildcards: list(OTHERS[wildcards.other])
    log: f"{R}/logs/rigs/{{other}}/metrics.log"


rule parameters:
    """Every parameter with its kind: what is printed, derived, assumed and fitted."""
    input:
        needs("parameters.py"),
        rig=CONFIG.rig,
    output:
        **table("parameters"),
        **table("table1", "groove"),
    log: f"{R}/logs/parameters.log"
    message: "Table 1 and the list of parameters"
    script: "../scripts/parameters.py"


rule sensor_records:
    """The sensor's records at the simulation's rate, and what reading them did."""
    input:
        needs("sensor_records.py"),
        rig=CONFIG.rig,
        sensors=[CONFIG.sensor_path(rpm) for rpm in CONFIG.records.speeds_rpm],
        mapping=[CONFIG.sensor_mapping] if CONFIG.sensor_mapping else [],
    output:
        records=RECORDS,
        **table("sensor_records"),
    params:
        speeds=CONFIG.records.speeds_rpm,
        synthetic=CONFIG.sensor_is_synthetic,
    priority: 100 # what is wrong with a record is said before anything is simulated
    log: f"{R}/logs/sensor_records.log"
    message: "Reading the sensor's records"
    script: "../scripts/sensor_records.py"


rule statistics:
    """Table 3 and the dominant peaks, beside the sensor's."""
    input:
        needs("sensor_tables.py"),
        metrics=f"{R}/metrics.csv",
        sensors=RECORDS,
    output:
        **table("table3"),
        **table("lines", "lines"),
    params:
        runs=SPEEDS,
        speeds=CONFIG.records.speeds_rpm,
        synthetic=CONFIG.sensor_is_synthetic,
    log: f"{R}/logs/statistics.log"
    message: "Table 3"
    script: "../scripts/sensor_tables.py"


rule closure:
    """Figure 15: the closure error."""
    input:
        needs("closure.py"),
        recordings=[recording(run) for run in SPEEDS],
    output: figure("fig15")
    params: speeds=CONFIG.records.speeds_rpm
    log: f"{R}/logs/fig15.log"
    message: "Figure 15"
    script: "../scripts/closure.py"


rule sensor_figures:
    """Figures 17 and 18: time histories and spectra of every speed beside the sensor's."""
    input:
        needs("sensor_figures.py"),
        recordings=[recording(run) for run in SPEEDS],
        sensors=RECORDS,
    output:
        **figures([f"fig17_{letter}" for letter in LETTERS], key="histories"),
        **figures([f"fig18_{letter}" for letter in LETTERS], key="spectra"),
    params: synthetic=CONFIG.sensor_is_synthetic
    log: f"{R}/logs/fig17_18.log"
    message: "Figures 17 and 18"
    script: "../scripts/sensor_figures.py"


rule loop_figure:
    """The loop on its wheels."""
    input:
        needs("loop_figure.py"),
        recording=recording(SPEEDS[0]),
    output: figure("loop")
    log: f"{R}/logs/loop.log"
    message: "A picture of the loop"
    script: "../scripts/loop_figure.py"


rule records:
    input:
        f"{R}/metrics.csv",
        rules.parameters.output,
        rules.statistics.output,
        rules.closure.output,
        rules.loop_figure.output,
        [figure(f"fig{number}_{letter}") for number in (17, 18) for letter in LETTERS],
