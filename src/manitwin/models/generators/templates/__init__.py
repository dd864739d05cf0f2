"""The built-in generator of things that can be described by a few measures: see ``template``."""
