"""Collection of inputs for a data set: a catalogue of candidate photos and meshes with their sources and licences."""
