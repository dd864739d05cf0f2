"""Browser pages of data sets, twins, scenes and episodes, from a local server or as static files, and the review pages."""
