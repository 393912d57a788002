from tests.first_fit import driven_loop, make_scene, rig  # noqa: F401
