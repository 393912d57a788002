from tests.viscous import driven_loop, make_scene, rig  # noqa: F401
