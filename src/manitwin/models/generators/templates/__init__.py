"""Built-in parametric generator: objects described by a few measures. See ``template``."""
