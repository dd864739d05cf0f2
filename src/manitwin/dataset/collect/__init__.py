"""The catalogue of a collection: what could be made into twins, whence it is, and under which licence."""
