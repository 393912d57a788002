# Files that results are made from but no rule makes: a job runs again when the content of one of its own changes.


def below_root(path):
    """A file of this checkout by its place in it, another one by its path."""
    return str(Path(path)).removeprefix(f"{ROOT}/")


TABLES_OF_TRACKS = ("sentences", "claims", "map", "draws", "mobilised", "near")
PLAUSIBLE = {name: f"data/plausible/plausible_{name}.csv" for name in TABLES_OF_TRACKS}
# of the rig that `searched_rigs` finds with a ring that grips (config/grips.yaml)
GRIPS = {name: f"data/plausible/grips_{name}.csv" for name in ("ring", "sentences")}
# of the study of the ring's tangential force (`snakemake -s laboratory/Snakefile -j2 grip`)
GRIP = "data/plausible/grip.csv"
TRACKS = PLAUSIBLE | {
    "rings": "data/plausible/rings.csv",
    "grips": GRIPS["sentences"],
    "study": GRIP,
    "picture": "docs/pictures/plausible.png",
}
# everything that the results are made from, but for the program
RUN_INPUTS = [
    below_root(path)
    for paths in (
        reversed(workflow.configfiles),
        ("config/claims.yaml", config["studies"], *TRACKS.values(), GRIPS["ring"]),
        *CONFIG.files.values(),
    )
    for path in paths
]


@cache
def content_hash(file):
    if file.suffix == ".py":
        return meaning(file) # a comment makes nothing due
    return sha256(file.read_bytes()).hexdigest() if file.is_file() else ""


def contents(wildcards, reader):
    """Hash the files that a job reads and no rule makes: inputs, the files of a rig among them, its script's imports."""
    items = [item(wildcards) if callable(item) else item for item in reader.input]
    files = {Path(file) for item in items for file in ([item] if isinstance(item, str) else item)}
    stated = {file for file in files if str(file) in RUN_INPUTS or not file.is_relative_to(R)}
    if Path(CONFIG.rig) in stated:
        stated.update(CONFIG.files["rig"])
    if reader.script: # Snakemake sees an edit of the script, but not one of these
        stated.update(imported_files((Path(reader.snakefile).parent / reader.script).resolve(), ROOT))
    return sha256(repr([(below_root(file), content_hash(file)) for file in sorted(stated)]).encode()).hexdigest()


def make_missing(wildcards, reader):
    """No input, but have a result of this job made if it is missing.

    Snakemake makes a missing file only if it is a target, or if a job that runs reads it. Deleted results, and those of a
    job that was killed after its old ones were removed, would stay missing below newer ones. Compiled kernels are no result.
    """
    if workflow.is_main_process and not reader.name.startswith("warm_up"):
        made = (file.apply_wildcards(wildcards) for file in reader.output)
        workflow.dag.forcefiles.update(file for file in made if not Path(file).exists())
    return []


def follow_contents():
    """Rerun jobs whose files have other content, whatever their dates, and make missing results.

    A record copied from a card is older than results. A rule's message is its docstring, its log has its name, by default.
    """
    for reader in workflow.rules:
        reader.message = reader.message or reader.docstring
        if reader.output and not reader.log:
            wildcards = (f"{{{name}}}" for name in sorted(reader.wildcard_names))
            reader.log_modifier = reader.output_modifier
            reader.set_log(f"{R}/logs/{'/'.join([reader.name, *wildcards])}.log")
        if reader.output and "contents" not in reader.params.keys():
            reader.set_params(contents=partial(contents, reader=reader))
            reader.set_input(partial(make_missing, reader=reader))
