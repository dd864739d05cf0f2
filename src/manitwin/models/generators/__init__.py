"""3D generators: an image or a text to a mesh file, behind one job protocol (submit, poll, fetch) for local code and services."""
