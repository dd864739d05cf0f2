"""Assets of other tools become inputs of the pipeline, with all that is known of them."""
