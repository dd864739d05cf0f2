"""Pages in the browser: the gallery of a data set and a page of each twin, from a server of this machine or as plain files."""
