# Names that the rules share. A rule's script is the module that computes or draws.


onstart:
    # Snakemake's own handler waits for a lock that the loop which it interrupts may hold, and then hangs
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    remove_abandoned(R) # files that a killed job was writing


def figure(name):
    """PNG and SVG of a figure; scripts name the first, the other is saved next to it."""
    return [f"{R}/figures/{name}.{ending}" for ending in ("png", "svg")]


def requested_studies(wildcards):
    """Studies of this run: those that every run has, and the requested ones; targets are known after parsing."""
    requested = {*workflow.dag_settings.targets, *CONFIG.default_studies}
    return [name for name in STUDIES if name in requested or "studies" in requested]


def recording(run):
    return f"{R}/runs/{run}.npz"


ROUNDED = [f"rounded/{rpm:g}rpm" for rpm in CONFIG.rounded_speeds]


# Named by the hash of the kernels' sources: other sources, another file, and everything that needs it runs.
KERNELS = f"{R}/kernels/{kernel_digest()}.npz"


def method_kernels(method):
    """Kernels of another integrator or of motion in space, compiled once before parallel studies."""
    return KERNELS if method == "semi_implicit" else KERNELS.replace(".npz", f"_{method}.npz")


def scene_kernels(fields):
    """Kernels that a scene with these fields runs."""
    return method_kernels("spatial" if fields.get("space") == "spatial" else fields.get("integrator", "semi_implicit"))


SEVERAL_METHODS = [KERNELS, method_kernels("linearly_implicit"), method_kernels("rk4")]
