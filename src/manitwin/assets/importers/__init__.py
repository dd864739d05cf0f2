"""Import of assets of other tools as inputs of a build, with all declared properties that are usable."""
