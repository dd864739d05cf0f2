"""Layout generation (paper, Scene Layout Generation): several twins on furniture, at rest, that do not collide."""
