# Names that the rules share. A rule's script is the module that computes or draws.


onstart:
    # Snakemake's own handler waits for a lock that the loop which it interrupts may hold, and then hangs
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    remove_abandoned(R) # files that a killed job was writing


def figure(name):
    """PNG and SVG of a figure; scripts name the first, the other is saved beside it."""
    return [f"{R}/figures/{name}.{ending}" for ending in ("png", "svg")]


def requested_studies(wildcards):
    """Studies that this run makes: those that every run has, and what is asked for; targets are known after parsing."""
    requested = {*workflow.dag_settings.targets, *CONFIG.default_studies}
    return [name for name in STUDIES if name in requested or "studies" in requested]


def recording(run):
    return f"{R}/runs/{run}.npz"


ROUNDED = [f"rounded/{rpm:g}rpm" for rpm in CONFIG.rounded_speeds]


# Named by the hash of the kernels' sources: other sources, another file, and everything that needs it runs.
KERNELS = f"{R}/kernels/{kernel_digest()}.npz"


def method_kernels(method):
    """The same of another method or of motion in space: of studies side by side one would compile it, so would the next."""
    return KERNELS if method == "semi_implicit" else KERNELS.replace(".npz", f"_{method}.npz")


def scene_kernels(fields):
    """Those that a scene with these fields runs."""
    return method_kernels("spatial" if fields.get("space") == "spatial" else fields.get("integrator", "semi_implicit"))


SEVERAL_METHODS = [KERNELS, method_kernels("linearly_implicit"), method_kernels("rk4")]
