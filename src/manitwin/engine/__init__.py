"""The engine of a run: what is to be done next, for which item, and on what; it knows nothing of meshes or grasps."""
