"""Files of meshes, pictures and documents: read safely, written."""
