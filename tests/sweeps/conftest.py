from tests.viscous import make_scene, rig, rig_path  # noqa: F401
