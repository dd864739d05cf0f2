"""Goals in words that a program can judge: literals over the objects of a scene, measured on the state of the world."""
