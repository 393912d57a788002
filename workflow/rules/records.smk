# Sect. 5: metrics of every run, Table 1 and 3, Figures 15, 17, 18.

LETTERS = dict(zip("abcdefgh", CONFIG.records.speeds_rpm))
# the sensor's records of all speeds, as they are compared, where there are any
RECORDS = [f"{R}/sensor/{rpm}.csv" for rpm in SPEEDS] if CONFIG.sensor_csv else []


# runs that are measured together, each kind as soon as it is there; the meshing process where all are gathered
PATTERNS = {"records": r"[\d.]+rpm|coarse/.*", "ring": "ring/.*", "meshing": "meshing/.*"}
RUNS = {kind: [run for run in SCENES if re.fullmatch(pattern, run)] for kind, pattern in PATTERNS.items()}


rule measure:
    """The numbers of some runs, a row per run."""
    input: recordings=lambda wildcards: [recording(run) for run in RUNS[wildcards.kind]]
    output: csv=f"{R}/measured/{{kind}}.csv"
    params: runs=lambda wildcards: RUNS[wildcards.kind]
    wildcard_constraints: kind="records|ring"
    message: "Measuring {output.csv}"
    script: "../trackdyn_replication/pipeline/metrics.py"


rule metrics:
    """All numbers that claims and the page are made of, and the events of the meshing process."""
    input:
        parts=[f"{R}/measured/{kind}.csv" for kind in ("records", "ring")],
        recordings=[recording(run) for run in RUNS["meshing"]],
    output: csv=f"{R}/metrics.csv", events=f"{R}/events.csv"
    params: runs=RUNS["meshing"]
    message: "Measuring {output.csv}"
    script: "../trackdyn_replication/pipeline/metrics.py"


rule parameters:
    """Every parameter with its kind: printed, derived, assumed or fitted."""
    input: rig=CONFIG.rig
    output: csv=f"{R}/tables/parameters.csv", groove=f"{R}/tables/table1.csv"
    script: "../trackdyn_replication/report/tables.py"


rule sensor_records:
    """The sensor's records at the simulation's rate, and the conversions made in reading them."""
    input: rig=CONFIG.rig, sensors=CONFIG.sensor_files, mapping=CONFIG.files["sensor_mapping"]
    output: records=RECORDS, csv=f"{R}/tables/sensor_records.csv"
    params: speeds=CONFIG.records.speeds_rpm, synthetic=CONFIG.synthetic
    priority: 100 # a fault of a record is reported before anything is simulated
    script: "../trackdyn_replication/report/tables.py"


rule statistics:
    """Table 3 and the dominant peaks, compared with the sensor's; Table 4, the effect of the coarser tooth contact."""
    input: metrics=f"{R}/measured/records.csv", sensors=RECORDS
    output: csv=f"{R}/tables/table3.csv", lines=f"{R}/tables/lines.csv", coarse=f"{R}/tables/table4.csv"
    params: runs=SPEEDS, speeds=CONFIG.records.speeds_rpm, synthetic=CONFIG.synthetic
    script: "../trackdyn_replication/report/tables.py"


rule closure:
    """Figure 15: the closure error."""
    input: recordings=[recording(run) for run in SPEEDS]
    output: figure("fig15")
    params: speeds=CONFIG.records.speeds_rpm
    script: "../trackdyn_replication/report/figures/records.py"


rule sensor_figures:
    """Figures 17 and 18: time histories and spectra of every speed, compared with the sensor's."""
    input: recordings=[recording(run) for run in SPEEDS], rounded=[recording(run) for run in ROUNDED], sensors=RECORDS
    output:
        histories=[f"{R}/figures/fig17_{letter}.png" for letter in LETTERS],
        histories_svg=[f"{R}/figures/fig17_{letter}.svg" for letter in LETTERS],
        spectra=[f"{R}/figures/fig18_{letter}.png" for letter in LETTERS],
        spectra_svg=[f"{R}/figures/fig18_{letter}.svg" for letter in LETTERS],
    params: speeds=CONFIG.rounded_speeds, synthetic=CONFIG.synthetic
    script: "../trackdyn_replication/report/figures/records.py"


rule records:
    input:
        f"{R}/metrics.csv",
        rules.parameters.output,
        rules.statistics.output,
        rules.closure.output,
        [figure(f"fig{number}_{letter}") for number in (17, 18) for letter in LETTERS],
