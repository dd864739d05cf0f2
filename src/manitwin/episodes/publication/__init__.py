"""A folder of episodes as a repository that others can download and train on."""
