"""What episodes do with objects: each skill is a module that says which goals it sets, and where the object is to go."""
