"""Layout generation (paper, Scene Layout Generation): several twins at rest on furniture without collisions."""
