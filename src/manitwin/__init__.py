"""Turn a photo, a text or a mesh into a data-generation-ready digital twin."""
