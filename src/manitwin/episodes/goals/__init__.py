"""Goal language and its evaluation: literals over the objects of a scene, measured on the state of the world."""
