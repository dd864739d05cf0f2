"""What pictures of scenes show, told exactly: the truth of each picture, and data sets for perception made of it."""
